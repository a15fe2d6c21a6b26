"""The verdict in words: what is missing, how sure, and what cannot be told apart."""

import math
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, replace

from datasets.vocabulary.effects import in_words
from estimator.diagnosis.diagnose import Diagnosis, Finding, TestedValue, blind_to, says_nothing, tested_values
from estimator.diagnosis.explain import ESTABLISHED, Explanation, Step
from estimator.diagnosis.selection.groups import FACTOR
from tumble.reports.words import names_in_words

NOTHING_KNOWN = "something that no known effect describes"
NOTHING_MORE = "Then nothing more is missing"
EXPLAINED, PART_EXPLAINED = "The campaign is explained with", "Part of what the campaign shows is explained with"
NOT_ESTABLISHED = "Nothing is established."
MOST_LIKELY = 4
"""Effects that are told where none stands out."""


@dataclass(frozen=True)
class Verdict:
    """``kind``: "nothing missing", "found", "unknown", "judged" or "says nothing"; a sentence, remarks, and the effects to add next."""

    kind: str
    sentence: str
    remarks: tuple[str, ...]
    add: tuple[str, ...]


TOO_SHORT, RECORD_MORE = "This campaign is too short to say anything", "Record more frames, more sequences, or longer flights."


def sureness(probability: float) -> str:
    """The probability that nothing is missing in words."""
    if probability < 1e-6:
        return "as good as certain"
    if probability < 1e-2:
        return "very likely"
    return "likely" if probability < 0.5 else "not established"


def verdict_of(diagnosis: Diagnosis, *, named: Collection[str] = (), seen: Collection[str] = ()) -> Verdict:
    """The verdict on a diagnosis: what the most probable set of effects has that the model lacks.

    ``named``: keys of effects that are told as other names of what is in the model, which these data cannot show beside it; ``seen``: of
    those that would have shown before anything was in it.
    """
    n = len(diagnosis.findings)
    if n == 0:
        return Verdict("nothing missing", "Every known effect is in the model already: there is nothing left to test.", (), ())
    if says_nothing(diagnosis):
        blind = blind_to(diagnosis)
        sentence = f"{TOO_SHORT}: {len(blind)} of {n} effects would not show in it, however large within reason."
        return Verdict("says nothing", sentence, (f"It is blind to: {_listed(blind)}.", RECORD_MORE), ())
    if not diagnosis.missing:
        sure = percent(diagnosis.probability)
        if diagnosis.probability < 0.5:
            return Verdict("judged", f"{NOT_ESTABLISHED} {likely_more(diagnosis)}", tuple(_blind(diagnosis, named, seen)), ())
        sentence = f"Nothing is missing (probability {sure}): with none of {n} further effects is the model more probable."
        needless = (f"The evidence does without: {_listed(diagnosis.superfluous)}.",) if diagnosis.superfluous else ()
        return Verdict("nothing missing", sentence, (*needless, *_blind(diagnosis, named, seen)), ())
    opening = f"The model misses something: {sureness(diagnosis.probability)} (nothing missing: {percent(diagnosis.probability)})."
    known = {f.key: f for f in diagnosis.findings}
    named = tuple(key for key in diagnosis.missing if key in known)
    if not named:
        sentence = f"{opening} No known effect explains it."
        return Verdict("unknown", sentence, ("Look at the maps of residuals (tumble compare) for where it sits.",), ())
    told = " and ".join(f"{key.replace('_', ' ')} ({value_words(known[key])})" for key in named)
    return Verdict("found", f"{opening} Most probable: {told}.", _remarks(diagnosis, known[named[0]]), named)


def far_off(short: Verdict, checks: Iterable[str]) -> Verdict:
    """A verdict that a campaign is too short, where residuals are no noise: what they are hides the rest, and there is what to check."""
    sentence = short.sentence.replace(TOO_SHORT, "The model misses something, and beside that nothing can be said")
    return replace(short, sentence=sentence, remarks=(*checks, *(remark for remark in short.remarks if remark != RECORD_MORE)))


def likely_more(diagnosis: Diagnosis) -> str:
    """That something more is probably missing, though no one effect stands out."""
    likely = sorted((f for f in diagnosis.findings if f.probability > 1.0 / (1.0 + FACTOR)), key=lambda f: -f.probability)[:MOST_LIKELY]
    sure = percent(1.0 - diagnosis.probability)
    if len(likely) == 1:
        return f"Suspected, though not established: {in_words(likely[0].key)} or something in its place ({sure})."
    told = f": {' or '.join(in_words(f.key) for f in likely)}" if likely else ""
    return f"Something more is probably missing ({sure}), and the data do not tell what{told}."


def percent(probability: float) -> str:
    """A probability for people."""
    return f"{probability:.1%}" if 1e-3 <= probability <= 0.999 else "< 0.1%" if probability < 0.5 else "> 99.9%"


def _blind(diagnosis: Diagnosis, named: Collection[str], seen: Collection[str]) -> Iterator[str]:
    """What nothing can be said of, nor is in what was said."""
    blind = [key for key in blind_to(diagnosis) if key not in named]
    if never := tuple(key for key in blind if key not in seen):
        yield f"Too little data for these, however large within reason: {_listed(never)}."
    if hidden := tuple(key for key in blind if key in seen):
        yield f"These data cannot show these beside what is in the model, however large within reason: {_listed(hidden)}."


def _listed(keys: tuple[str, ...]) -> str:
    return ", ".join(map(in_words, keys))


def _remarks(diagnosis: Diagnosis, best: Finding) -> tuple[str, ...]:
    families = {f.key for f in diagnosis.families}
    others = [NOTHING_KNOWN if key in families else names_in_words(key) for key in diagnosis.group[1:]]
    remarks = []
    if others:
        remarks.append(f"These data cannot tell it from: {', '.join(others)}.")
    if not all(value.plausible for value in tested_values(best.test)):
        remarks.append("Its value lies outside of what is plausible: look for another cause that acts alike.")
    return tuple(remarks)


def value_words(finding: Finding) -> str:
    """Values of a finding's first parameters with their standard deviations."""
    return ", ".join(_words(value) for value in tested_values(finding.test)[:3])


def _words(value: TestedValue) -> str:
    unit = "" if value.parameter.unit == "1" else f" {value.parameter.unit}"
    digits = 1 - math.floor(math.log10(value.sigma)) if value.sigma > 0 else 6
    return f"{value.parameter.name} = {round(value.value, digits):g} ± {value.sigma:.2g}{unit}"


def _with_rivals(step: Step) -> str:
    """An effect that is established, with those of its other names in the catalogue that are not improbable."""
    known = [name for name in step.names[1:] if not name.unknown and name.probability > 1.0 - ESTABLISHED]
    rivals = " or ".join(" with ".join(in_words(part.key) for part in name.parts) for name in known)
    return in_words(step.added) + (f" (or, which these data do not tell from it, {rivals})" if rivals else "")


def _instead(explanation: Explanation) -> str:
    """What was found that may be something unknown instead, by the probability of that; nothing where that is improbable."""
    instead = {step.added: _unknown_instead(step) for step in explanation.steps if step.established}
    doubted = [f"{in_words(key)} ({percent(p)})" for key, p in instead.items() if 0.5 >= p > 1.0 - ESTABLISHED]
    return f"{NOTHING_KNOWN} has the place of {' or '.join(doubted)}" if doubted else ""


def _unknown_instead(step: Step) -> float:
    """Probability that something unknown has the place of what a step added."""
    return sum(name.probability for name in step.names if name.unknown)


def _opening(steps: Iterable[Step], *, whole: bool) -> str:
    """What established ``steps`` explain, the ``whole`` or a part; of those that something unknown outdoes, that is told first."""
    sure, outdone = [], []
    for step in steps:
        if (unknown := _unknown_instead(step)) > 0.5:
            outdone.append(f"{NOTHING_KNOWN} ({percent(unknown)}) or, less probably, {_with_rivals(step)}")
        else:
            sure.append(_with_rivals(step))
    explained = EXPLAINED if whole and not outdone else PART_EXPLAINED
    told = [f"{explained} {', '.join(sure)}."] if sure else []
    if outdone:
        told.append(f"{'Beside that' if sure else 'What is missing'} is {'; and '.join(outdone)}.")
    return " ".join(told) or NOT_ESTABLISHED


def verdict_of_explanation(last: Verdict, explanation: Explanation) -> Verdict:
    """The verdict on what was found and on what is left."""
    found = explanation.found
    if not found:
        return last
    rest = [step for step in explanation.steps if not step.established]
    suspected = [f"{in_words(step.added)} or something in its place ({percent(step.sure)})" for step in rest]
    remarks: tuple[str, ...] = ()
    if explanation.left is not None and explanation.left.present:
        more, remarks = "Something is left that no effect of the catalogue explains.", last.remarks
    else:
        instead = _instead(explanation)
        more = f"{NOTHING_MORE}{', unless ' * bool(instead)}{instead}."
        if explanation.diagnosis.probability < 0.5:
            more = f"{likely_more(explanation.diagnosis)}{f' Or {instead}.' if instead else ''}"
    opening = _opening((step for step in explanation.steps if step.established), whole=more.startswith(NOTHING_MORE))
    beside = f" Suspected, and in the model, though not established: {', '.join(suspected)}." if suspected else ""
    return Verdict("found", f"{opening}{beside} {more}", remarks, found)
