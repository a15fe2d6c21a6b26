"""The verdict in words: what is missing, how sure, and what cannot be told apart."""

from dataclasses import dataclass

from estimator.campaign_reporting import Z95, is_plausible
from estimator.diagnosis.diagnose import Diagnosis, Finding, blind_to, says_nothing

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
        return Verdict("nothing missing", sentence, (), ())
    best = diagnosis.findings[0]
    how = sureness(diagnosis.p)
    opening = f"The model misses something: {how} (p = {diagnosis.p:.1e}, corrected for {n} candidates)."
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
    if not all(plausible for *_, plausible in _values(best)):
        remarks.append("Its value lies outside of what is plausible: look for another cause that acts alike.")
    return tuple(remarks)


def value_words(finding: Finding) -> str:
    """Values of a finding's first parameters with their 95% intervals."""
    shown = [f"{name} = {value:.4g} ± {sigma:.2g} {unit}".rstrip(" 1") for name, unit, value, sigma, _ in _values(finding)[:3]]
    return ", ".join(shown)


def _values(finding: Finding) -> list[tuple[str, str, float, float, bool]]:
    test = finding.test
    found = []
    for row, (column, value) in enumerate(zip(test.columns, test.theta, strict=True)):
        parameter = test.effect.entry.parameters[column.parameter]
        sigma = float(max(test.covariance[row, row], 0.0)) ** 0.5
        interval = (float(value) - Z95 * sigma, float(value) + Z95 * sigma)
        found.append((parameter.name, parameter.unit, float(value), sigma, is_plausible(interval, parameter)))
    return found
