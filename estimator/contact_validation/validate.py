"""From measured impacts to an answer: contacts, models fitted and ranked on held-out impacts, the ladder, residual maps, the verdict."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.errors import InputError
from estimator.contact_validation.detection import Detectable, detectable
from estimator.contact_validation.fitting import Fitted, Impacts, fit
from estimator.contact_validation.held_out import Gain, Judged, gain
from estimator.contact_validation.ladder import Ladder, climb
from estimator.contact_validation.laws.force_models import Materials, hertz_mindlin_at_corner, hertz_mindlin_clump
from estimator.contact_validation.laws.models import FRICTIONLESS, RIGID, SPHERE, ContactModel
from estimator.contact_validation.laws.point_contact import PointContact, point_contact
from estimator.contact_validation.measured import MeasuredImpact
from estimator.contact_validation.next_contacts import shared_by_corners
from estimator.contact_validation.quantities import Contact, contact_of
from estimator.contact_validation.residual_maps import ResidualMap, residual_maps
from estimator.contact_validation.spread import draws_of, predicted_covariance, prepared
from estimator.contact_validation.verdict import ContactVerdict, contact_verdict

Array = NDArray[np.float64]
LEAST_RUNS = 4
"""Runs with impacts, below which no model is judged. By judgement."""
MODELS: tuple[str, ...] = ("frictionless", "sphere_equivalent", "stronge_impulse", "hertz_mindlin", "hertz_mindlin_clump")
"""Keys of the models that a user may ask for; what the ladder adds comes besides."""
DEFAULT_MODELS = MODELS[:4]


@dataclass(frozen=True)
class Ranked:
    """A model with its held-out judgement; ``behind``: how much better the best model is on held-out impacts (``None``: it is the best)."""

    model: ContactModel
    judged: Judged
    behind: Gain | None


@dataclass(frozen=True)
class Validation:
    """Everything that was found.

    ``impacts``: the n that models are judged by; ``shared``: names of those that two corners share, by which none is judged;
    ``contacts`` of all of them. ``spread`` (n, 6): standard deviations of predictions, from the state measured before each impact.
    ``detectable``: how large what was not added would have to be to be found.
    """

    impacts: Impacts
    shared: tuple[str, ...]
    contacts: tuple[Contact, ...]
    ranking: tuple[Ranked, ...]
    ladder: Ladder
    maps: tuple[ResidualMap, ...]
    spread: Float[NDArray[np.float64], "impact 6"]
    detectable: tuple[Detectable, ...]
    verdict: ContactVerdict


@dataclass(frozen=True)
class Question:
    """Which ``models`` (keys), of which ``materials``, with how many ``spheres`` in a clump; ``seed`` of the draws."""

    models: tuple[str, ...] = DEFAULT_MODELS
    materials: Materials = field(default_factory=Materials)
    spheres: int = 50
    seed: int = 0

    def __post_init__(self) -> None:
        unknown = [key for key in self.models if key not in MODELS]
        if unknown or not self.models:
            raise InputError(f"contact models: expected some of {', '.join(MODELS)}, got {', '.join(unknown) or 'none'}")


def validate(measured: Sequence[MeasuredImpact], question: Question, told: Callable[[str], None]) -> Validation:
    """Judge contact models by ``measured`` impacts.

    Raises
    ------
    InputError
        Where fewer than :data:`LEAST_RUNS` runs have an impact.
    """
    runs = {impact.run for impact in measured}
    if len(runs) < LEAST_RUNS:
        raise InputError(f"contact validation: expected measured impacts of at least {LEAST_RUNS} runs, got {len(runs)}")
    impacts, shared = single_contacts(measured, question.seed)
    rng = np.random.default_rng(question.seed)
    told("uncertainty of predictions")
    ladder = climb(impacts, question.seed, told)
    rigid = ladder.rungs[1].judged
    law = point_contact(dict(zip(RIGID.names, rigid.fitted.values.tolist(), strict=True)))
    contacts = tuple(contact_of(impact, law.friction, rng) for impact in measured)
    told("contacts")
    ranking = ranked(ladder.impacts, _judged_models(question, ladder, told), rng)
    last = ladder.accepted[-1].judged
    carrier = replace(point_contact(last.fitted.by_name), tilt=0.0, tilt_across=0.0)
    spread = np.stack([np.sqrt(np.diag(predicted_covariance(i, carrier, draws_of(i, rng)))) for i in impacts.measured])
    maps = residual_maps(ladder.impacts, last)
    sizes = detectable(ladder.impacts, last, ladder.missing, rng)
    told("what these impacts could have shown")
    verdict = contact_verdict(ladder, ranking[0].model.title, contacts, shared)
    return Validation(impacts, shared, contacts, ranking, ladder, maps, spread, sizes, verdict)


def single_contacts(measured: Sequence[MeasuredImpact], seed: int) -> tuple[Impacts, tuple[str, ...]]:
    """The impacts that one contact makes, under the rigid impulse that fits best, and the names of the others.

    All are kept where otherwise fewer than :data:`LEAST_RUNS` runs were left.
    """
    impacts = prepared(measured, seed)
    shared = shared_by_corners(measured, PointContact(*fit(impacts, RIGID).values.tolist()))
    single = [impact for impact, several in zip(measured, shared, strict=True) if not several]
    if not shared.any() or len({impact.run for impact in single}) < LEAST_RUNS:
        return impacts, ()
    return prepared(single, seed), tuple(impact.name for impact, several in zip(measured, shared, strict=True) if several)


def _judged_models(question: Question, ladder: Ladder, told: Callable[[str], None]) -> list[tuple[ContactModel, Judged]]:
    """The models asked for, and the ladder's last where it has more than they; all under the uncertainty that the last one carries."""
    last = ladder.accepted[-1]
    known = {rung.key: rung.judged for rung in ladder.rungs[:2]} if not ladder.missing else {}
    found = []
    for key in question.models:
        model = _model(key, ladder.impacts, question)
        found.append((model, known[key] if key in known else ladder.judged(model)))
        told(model.title)
    if ladder.missing:
        found.append((last.judged.fitted.model, last.judged))
    return found


def _model(key: str, impacts: Impacts, question: Question) -> ContactModel:
    if key == "hertz_mindlin":
        return hertz_mindlin_at_corner(question.materials)
    if key == "hertz_mindlin_clump":
        return hertz_mindlin_clump(question.materials, impacts.measured, question.spheres)
    return {"frictionless": FRICTIONLESS, "sphere_equivalent": SPHERE, "stronge_impulse": RIGID}[key]


def ranked(impacts: Impacts, models: Sequence[tuple[ContactModel, Judged]], rng: np.random.Generator) -> tuple[Ranked, ...]:
    """By held-out cost, the best first."""
    ordered = sorted(models, key=lambda pair: pair[1].cost)
    best = ordered[0][1]
    return tuple(Ranked(m, j, None if j is best else gain(impacts, j, best, rng)) for m, j in ordered)


def values_of(fitted: Fitted) -> list[tuple[str, float, float, str]]:
    """Name, value, standard deviation and unit of each free parameter."""
    return [(p.name, float(v), float(s), p.unit) for p, v, s in zip(fitted.model.parameters, fitted.values, fitted.sigmas, strict=True)]
