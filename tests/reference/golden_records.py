"""What the golden corpus keeps of a result, and how far a renewed result may be from it.

A record has three parts: ``facts`` (statuses, names, counts), which have to be equal; ``numbers``, measured values each with its standard
deviation in the same unit (SI); and ``figures`` without one (RMS, chi-square, log evidence).

How far is allowed, and why. The corpus is to notice a change of what is computed, and to let pass what another BLAS, another processor or
another order of sums does. Fits end when a step is small against the standard deviations, so the distance is counted in these, and
``VALUE_SIGMAS`` of them are far below anything that matters to a user. A standard deviation follows from the normal equations at the end of
the fit and from the measured noise, which move a little with it: ``SIGMA_SHARE``. A figure may move by the same share, a log evidence or
log odds by ``NATS`` besides, since it is a difference of large numbers.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from datasets.estimate import CollisionEstimate, Estimate, Measured, VelocityEstimate
from estimator.contact_validation.validate import Validation
from estimator.diagnosis.diagnose import diagnosis_at
from estimator.diagnosis.explain import Explanation
from estimator.diagnosis.noise_floor import noise_floor
from estimator.fitting.campaigns.considered import Uncertain
from estimator.fitting.campaigns.registered import Registered
from estimator.reports.campaign_reporting import EffectValue, effect_values

VALUE_SIGMAS = 0.05
"""Pictures differ in their last bits from processor to processor: on two, a spin was 0.0201 standard deviations apart."""
SIGMA_SHARE = 0.01
NATS = 0.1
IN_NATS = "nats"
"""Word in the name of a figure that is a log evidence or log odds."""
DIGITS = 10
"""Significant digits that are kept."""
CANDIDATES = 3
"""Most probable candidates of a diagnosis that are kept."""
AXES = "xyz"
STATISTICS = ("noise_mean_square",)
"""Statistics of an estimate that are kept where it has them."""


@dataclass(frozen=True)
class Record:
    """A result: ``facts`` (strings, or lists of them), ``numbers`` (value, standard deviation), ``figures``."""

    facts: Mapping[str, Any]
    numbers: Mapping[str, tuple[float, float]]
    figures: Mapping[str, float]


@dataclass(frozen=True)
class Difference:
    """One quantity of a ``case`` that is not as it was; ``sigmas``: the change of its value in standard deviations, NaN for others."""

    case: str
    quantity: str
    before: Any
    after: Any
    sigmas: float = math.nan


def document_of(record: Record) -> dict[str, Any]:
    """A record as JSON has it."""
    return {
        "facts": {key: str(each) if isinstance(each, str) else each for key, each in record.facts.items()},
        "numbers": {key: [_rounded(part) for part in each] for key, each in record.numbers.items()},
        "figures": {key: _rounded(each) for key, each in record.figures.items()},
    }


def record_of(document: Mapping[str, Any]) -> Record:
    """A record from JSON."""
    numbers = {key: (float(value), float(sigma)) for key, (value, sigma) in document["numbers"].items()}
    return Record(document["facts"], numbers, document["figures"])


def differences(case: str, before: Record, after: Record) -> tuple[Difference, ...]:
    """What differs by more than the tolerances of this module."""
    one, other = asdict(before), asdict(record_of(document_of(after)))
    found = []
    for part in ("facts", "numbers", "figures"):
        for key in dict.fromkeys((*one[part], *other[part])):
            was, now = one[part].get(key), other[part].get(key)
            if was is None or now is None or not _alike(part, key, was, now):
                found.append(Difference(case, key, was, now, _moved(was, now) if part == "numbers" else math.nan))
    return tuple(found)


def _alike(part: str, key: str, was: Any, now: Any) -> bool:
    if part == "facts":
        return bool(was == now)
    if part == "numbers":
        return _moved(was, now) <= VALUE_SIGMAS and math.isclose(was[1], now[1], rel_tol=SIGMA_SHARE)
    return math.isclose(was, now, rel_tol=SIGMA_SHARE, abs_tol=NATS if IN_NATS in key else 0.0)


def _moved(was: tuple[float, float] | None, now: tuple[float, float] | None) -> float:
    """Change of a value in standard deviations."""
    if was is None or now is None:
        return math.nan
    return abs(now[0] - was[0]) / was[1] if was[1] > 0.0 else float("inf" if now[0] != was[0] else 0.0)


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def of_estimate(estimate: Estimate) -> Record:
    """One sequence: velocities, impacts, collision, and both particles of a pair."""
    reasons = [frame.reason for frame in estimate.frames if not frame.used]
    facts = {
        "status": estimate.status.value,
        "frames used": sum(frame.used for frame in estimate.frames),
        "left out": {reason: reasons.count(reason) for reason in sorted(set(reasons))},
        "impacts": len(estimate.impacts),
    }
    errors = [frame.rms_ete_px for frame in estimate.frames if frame.used]
    figures = {"rms": float(np.sqrt(np.mean(np.square(errors))))} if any(errors) else {}
    figures |= {key: estimate.statistics[key] for key in STATISTICS if key in estimate.statistics}
    record = Record(facts, dict(_measured(estimate)), figures)
    return record if estimate.companion is None else joined({"first": record, "second": of_estimate(estimate.companion)})


def joined(records: Mapping[str, Record]) -> Record:
    """Several records as one, each quantity after its record's name."""
    parts: dict[str, dict[str, Any]] = {"facts": {}, "numbers": {}, "figures": {}}
    for name, record in records.items():
        for part, found in asdict(record).items():
            parts[part] |= {f"{name}: {key}": each for key, each in found.items()}
    return Record(**parts)


def _measured(estimate: Estimate) -> Iterator[tuple[str, tuple[float, float]]]:
    for name, velocity in (("start", estimate.start), ("middle", estimate.middle)):
        if velocity is not None:
            yield from _velocity(name, velocity)
    for number, impact in enumerate(estimate.impacts):
        yield f"impact {number} time", (impact.time_s, impact.time_sigma_s)
        yield from _velocity(f"impact {number} before", impact.before)
        yield from _velocity(f"impact {number} after", impact.after)
        if impact.plate is not None:
            yield f"impact {number} gap", (impact.plate.gap_m, impact.plate.sigma_m)
    if estimate.collision is not None:
        yield from _collision(estimate.collision)


def _velocity(name: str, velocity: VelocityEstimate) -> Iterator[tuple[str, tuple[float, float]]]:
    """Components that were measured: those of a gyroscope's v, say, are NaN."""
    values, sigmas = np.concatenate([velocity.v_world, velocity.omega_world]), np.sqrt(np.diag(velocity.covariance))
    for k, (value, sigma) in enumerate(zip(values, sigmas, strict=True)):
        if math.isfinite(value):
            yield f"{name} {'v' if k < 3 else 'omega'}_{AXES[k % 3]}", (float(value), float(sigma))


def _collision(collision: CollisionEstimate) -> Iterator[tuple[str, tuple[float, float]]]:
    for name, value in vars(collision).items():
        if isinstance(value, Measured):
            yield f"collision {name}", (value.value, value.sigma)


def of_explanation(registered: Registered, found: Explanation, of: Uncertain, estimates: tuple[Estimate, ...]) -> Record:
    """A campaign: what was found, its size, what was on trial, and the velocities under the last model."""
    begun = diagnosis_at(found.begun)
    facts = {
        "found": list(found.found),
        "groups": [sorted(step.group) for step in found.steps],
        "established": [step.established for step in found.steps],
        "missing at first": list(begun.missing),
        "left": found.left.stage.value if found.left is not None and found.left.present else "nothing",
    }
    values = {_name_of(each): (each.value, each.sigma) for each in effect_values(registered, of.fit, of.of_values)}
    floor = noise_floor(found.campaign, found.fit, np.random.default_rng(0))
    figures = {
        "held-out rms": found.held_out.rms_px,
        "reduced chi-square": floor.reduced,
        "score chi-square": begun.chi_square,
        **{f"worth of {step.added} ({IN_NATS})": step.worth for step in found.steps},
        **{f"odds of {each.key} ({IN_NATS})": each.log_odds for each in begun.findings[:CANDIDATES]},
    }
    own = Record(facts, values, figures)
    return joined({"campaign": own, **{each.name: of_estimate(each) for each in estimates}})


def _name_of(value: EffectValue) -> str:
    where = "" if value.sequence is None else f" of {value.sequence}"
    return f"{value.effect}.{value.parameter.name}{where}"


def of_validation(found: Validation) -> Record:
    """Contact models judged by impacts: their ranking, constants, and the ladder's verdict."""
    numbers = {}
    for ranked in found.ranking:
        fitted = ranked.judged.fitted
        named = zip(fitted.model.names, fitted.values, fitted.sigmas, strict=True)
        numbers |= {f"{ranked.model.key} {name}": (float(value), float(sigma)) for name, value, sigma in named}
    facts = {
        "ranking": [ranked.model.key for ranked in found.ranking],
        "ladder": [rung.key for rung in found.ladder.rungs if rung.accepted],
        "missing": list(found.verdict.missing),
        "verdict": found.verdict.kind,
    }
    figures = {f"cost of {ranked.model.key} (2 {IN_NATS})": ranked.judged.cost for ranked in found.ranking}
    return Record(facts, numbers, figures)
