"""The verdict in words: what is missing, how sure, and what cannot be told apart."""

import math
from dataclasses import dataclass

from estimator.diagnosis.diagnose import Diagnosis, Finding, blind_to, says_nothing
from estimator.diagnosis.tested_values import TestedValue, p_words, tested_values

MOST = 0.5
"""Share of the excess below which an effect does not explain it."""


@dataclass(frozen=True)
class Verdict:
    """``kind``: "nothing missing", "found", "unknown" or "says nothing"; a sentence, remarks, and the effects to add next."""

    kind: str
    sentence: str
    remarks: tuple[str, ...]
    add: tuple[str, ...]


def sureness(p: float) -> str:
    """A p-value in words."""
    if p < 1e-6:
        return "as good as certain"
    if p < 1e-3:
        return "very likely"
    return "likely" if p < 0.01 else "not established"


def verdict_of(diagnosis: Diagnosis, *, alpha: float) -> Verdict:
    """The verdict on a diagnosis; ``alpha``: p-value, corrected for the number of candidates, below which something is missing."""
    n = len(diagnosis.findings)
    if n == 0:
        return Verdict("nothing missing", "Every known effect is in the model already: there is nothing left to test.", (), ())
    if says_nothing(diagnosis):
        blind = blind_to(diagnosis)
        sentence = (
            f"This campaign is too short to say anything: {len(blind)} of {n} effects would not show in it, however large within reason."
        )
        remarks = (f"It is blind to: {_listed(blind)}.", "Record more frames, more sequences, or longer flights.")
        return Verdict("says nothing", sentence, remarks, ())
    if diagnosis.p > alpha:
        sentence = (
            f"Nothing is missing: none of {n} effects explains anything that noise would not (smallest p, corrected: {diagnosis.p:.2g})."
        )
        return Verdict("nothing missing", sentence, _blind(diagnosis), ())
    best = diagnosis.findings[0]
    how = sureness(diagnosis.p)
    opening = f"The model misses something: {how} ({p_words(diagnosis.p)}, corrected for {n} candidates)."
    if best.share < MOST:
        sentence = f"{opening} None of the known effects explains it: the best, {best.test.effect.entry.title}, takes {best.share:.0%}."
        return Verdict("unknown", sentence, ("Look at the maps of residuals (tumble compare) for where it sits.",), ())
    sentence = f"{opening} {best.test.effect.entry.title.capitalize()} explains {best.share:.0%} of the excess: {value_words(best)}."
    return Verdict("found", sentence, _remarks(diagnosis), (best.key,))


def _blind(diagnosis: Diagnosis) -> tuple[str, ...]:
    """What nothing can be said of."""
    blind = blind_to(diagnosis)
    return (f"Too little data for these, however large within reason: {_listed(blind)}.",) if blind else ()


def _listed(keys: tuple[str, ...]) -> str:
    return ", ".join(key.replace("_", " ") for key in keys)


def _remarks(diagnosis: Diagnosis) -> tuple[str, ...]:
    best, others = diagnosis.findings[0], [key.replace("_", " ") for key in diagnosis.group[1:]]
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
