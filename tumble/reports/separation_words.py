"""What further data would tell a pair of effects apart, in words."""

from collections.abc import Sequence
from dataclasses import replace

from datasets.vocabulary.effects import begins, in_words
from estimator.diagnosis.separation import Expected, Prospect, Separation
from estimator.effects.choosing import excluded, lacking
from tumble.reports.verdict import Verdict

MOST_NAMED = 2
FAR = 100.0
"""A difference of log likelihoods whose size says nothing more: linear models are not good for that far."""


def separation_sentence(separation: Separation) -> str:
    """What would tell the pair apart, what would not, and by how much."""
    first, second = map(in_words, separation.pair)
    opening = f"{begins(first)} or {second} (expected difference of log likelihoods now {_number(separation.now)}, more than "
    opening += f"{separation.margin:.2g} is needed): "
    recordings = [p for p in separation.prospects if p.drops]
    measurements = [p for p in separation.prospects if not p.drops and p.expected.separates]
    telling = [p for p in recordings if p.expected.separates]
    chosen = [p for p in telling if p.drops == 1] or telling
    named = [*chosen[:MOST_NAMED], *measurements[:MOST_NAMED]]
    if not named:
        return opening + f"no recording on trial would tell them apart{_best(recordings)}.{_one_at_a_time(separation.pair)}"
    would = " or ".join(_would(p) for p in named)
    return f"{opening}{would} would tell them apart{_would_not(recordings)}.{_one_at_a_time(separation.pair)}"


def advised(verdict: Verdict, separations: Sequence[Separation], command: str) -> Verdict:
    """The verdict with what would tell the members of its group apart, and what to type once that is there."""
    if not separations:
        return verdict
    sentences = [separation_sentence(s) for s in separations]
    recorded = any(p.drops and p.expected.separates for s in separations for p in s.prospects)
    then = (f"With the new recording in the same folder: {command}",) if recorded else ()
    return replace(verdict, remarks=(*verdict.remarks, *sentences, *then))


def _number(expected: Expected) -> str:
    if expected.difference >= FAR:
        return f"over {FAR:.0f}"
    return f"{max(expected.difference, 0.0):.1f}" if expected.difference < 10.0 else f"{expected.difference:.0f}"


def _would(prospect: Prospect) -> str:
    many = f"{prospect.drops} times " if prospect.drops > 1 else ""
    return f"{many}{prospect.words} ({_number(prospect.expected)})"


def _best(recordings: Sequence[Prospect]) -> str:
    best = max(recordings, key=lambda p: p.expected.difference, default=None)
    return "" if best is None else f"; the best, {_would(best)}, would not do"


def _would_not(recordings: Sequence[Prospect]) -> str:
    """The plainest recordings that would be in vain."""
    vain = [p for p in recordings if not p.expected.separates]
    plain = sorted(vain, key=lambda p: ("another", "longer", "faster").index(p.key) if p.key in ("another", "longer", "faster") else 3)
    if not plain:
        return ""
    return f"; {' or '.join(_would(p) for p in plain[:MOST_NAMED])} would not"


def _one_at_a_time(pair: tuple[str, str]) -> str:
    return " Either way only one of them can be in a model." if excluded(pair) is not None and lacking(pair) is None else ""
