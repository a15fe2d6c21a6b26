"""The ladder: frictionless, Coulomb friction, then whatever physics explains most, each rung accepted on held-out impacts alone."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.contact_validation.fitting import Fitted, Impacts, fit, log_volumes
from estimator.contact_validation.held_out import Gain, Judged, gain, judge
from estimator.contact_validation.laws.models import ADDITIONS, FRICTIONLESS, RIGID, ContactModel, Physics, impulse_model
from estimator.contact_validation.spread import carried

Array = NDArray[np.float64]
MOST_ADDED = 3
"""Additions of one ladder: ten runs tell no more. By judgement."""
JUDGED = 3
"""Candidates of a rung that are judged on held-out impacts, those that fit best."""
NEARLY_NONE = 0.01
"""Part of a parameter's range at which the search for an addition starts besides its own starts, and besides nothing of it."""
LEAST_GAIN = 6.63
"""Fall of the cost of the impacts fitted to, below which held-out ones are not asked: one more parameter gives it in 1% of cases."""


@dataclass(frozen=True)
class Candidate:
    """Physics on trial on a rung: the fit with it, how it was judged on held-out impacts, and its gain over the rung before."""

    physics: Physics
    fitted: Fitted
    judged: Judged | None
    gained: Gain | None


@dataclass(frozen=True)
class Rung:
    """A model of the ladder; ``added``: title of what is new in it. ``gained``: over the rung before; ``candidates`` tried after it.

    An addition that was accepted is judged under the uncertainty that it carries itself, whose volume counts in its costs; what it gained,
    under that of the rung before.
    """

    added: str
    key: str
    judged: Judged
    gained: Gain | None
    accepted: bool
    candidates: tuple[Candidate, ...] = ()


@dataclass(frozen=True)
class Ladder:
    """All rungs, the last of which may be one that was tried and refused; ``alike``: per accepted addition others that did as well.

    ``impacts``: with the uncertainty that the last accepted rung carries, ``volumes`` (n,) larger in logarithm than the rigid impulse's.
    """

    rungs: tuple[Rung, ...]
    alike: dict[str, tuple[str, ...]]
    impacts: Impacts
    volumes: Float[NDArray[np.float64], " impact"]

    @property
    def accepted(self) -> tuple[Rung, ...]:
        """The rungs that stand."""
        return tuple(r for r in self.rungs if r.accepted)

    @property
    def missing(self) -> tuple[str, ...]:
        """Keys of the physics that the rigid impulse with friction misses."""
        return tuple(r.key for r in self.accepted if r.key in {p.key for p in ADDITIONS})

    def judged(self, model: ContactModel) -> Judged:
        """Another ``model`` fitted and judged as the last accepted rung is: on the same impacts under the same uncertainty."""
        return _with_volumes(judge(self.impacts, fit(self.impacts, model)), self.volumes)


def climb(impacts: Impacts, seed: int, told: Callable[[str], None]) -> Ladder:
    """Climb as long as held-out impacts agree; ``seed`` of the draws."""
    rng = np.random.default_rng(seed)
    smooth = judge(impacts, fit(impacts, FRICTIONLESS))
    rigid = judge(impacts, fit(impacts, RIGID))
    told("frictionless and Coulomb friction")
    first = Rung("frictionless impulse", FRICTIONLESS.key, smooth, None, True)
    rubbing = gain(impacts, smooth, rigid, rng)
    rungs = [first, Rung("Coulomb friction", RIGID.key, rigid, rubbing, rubbing.beyond_chance)]
    alike: dict[str, tuple[str, ...]] = {}
    added: list[str] = []
    rigid_volumes = log_volumes(impacts)
    while len(added) < MOST_ADDED:
        candidates = tried(impacts, rungs[-1].judged, added, rng)
        told(f"{len(added) + 1}. addition")
        best = candidates[0]
        if best.judged is None or best.gained is None:
            break
        judged = _with_volumes(best.judged, log_volumes(impacts) - rigid_volumes)
        rungs.append(Rung(best.physics.title, best.physics.key, judged, best.gained, best.gained.beyond_chance, candidates))
        if not best.gained.beyond_chance:
            break
        added.append(best.physics.key)
        alike[best.physics.key] = _alike(impacts, candidates, rng)
        impacts, fitted = carried(impacts, best.fitted, seed)
        rungs[-1] = replace(rungs[-1], judged=_with_volumes(judge(impacts, fitted), log_volumes(impacts) - rigid_volumes))
    return Ladder(tuple(rungs), alike, impacts, log_volumes(impacts) - rigid_volumes)


def _with_volumes(judged: Judged, volumes: Array) -> Judged:
    """With the ``volumes`` (n,) of an uncertainty over that of the rigid impulse, as part of the costs."""
    return replace(judged, costs=judged.costs + volumes, volumes=judged.volumes + volumes)


def tried(impacts: Impacts, before: Judged, added: list[str], rng: np.random.Generator) -> tuple[Candidate, ...]:
    """Every addition that is not yet in the model, the best on held-out impacts first, those not judged last."""
    rest = [p for p in ADDITIONS if p.key not in added]
    fits = sorted(((p, _fitted_with(impacts, before.fitted, [*added, p.key])) for p in rest), key=lambda pair: pair[1].cost)
    found = []
    worth = [fitted for _, fitted in fits[:JUDGED] if before.fitted.cost - fitted.cost > LEAST_GAIN]
    before = judge(impacts, before.fitted, [fitted.for_model(before.fitted.model) for fitted in worth]) if worth else before
    for physics, fitted in fits:
        judged = judge(impacts, fitted, [before.fitted.for_model(fitted.model)]) if any(fitted is each for each in worth) else None
        found.append(Candidate(physics, fitted, judged, None if judged is None else gain(impacts, before, judged, rng)))
    return tuple(sorted(found, key=lambda c: -c.gained.total if c.gained is not None else np.inf))


def _fitted_with(impacts: Impacts, before: Fitted, added: list[str]) -> Fitted:
    """The fit with ``added``, from the values of the fit before it and several of what is new."""
    model = impulse_model(added)
    known = before.by_name
    choices = []
    for p in model.parameters:
        if p.name in known:
            choices.append((known[p.name],))
        else:
            little = (NEARLY_NONE * p.bounds[1],) if p.bounds[0] == 0.0 else ()
            choices.append(tuple(dict.fromkeys((*p.starts, *little, 0.0))))
    return fit(impacts, model, known=[np.array(start) for start in product(*choices)], scatter=before.scatter)


def _alike(impacts: Impacts, candidates: tuple[Candidate, ...], rng: np.random.Generator) -> tuple[str, ...]:
    """Keys of candidates that the best one does not beat beyond chance."""
    best = candidates[0].judged
    assert best is not None
    rivals = [(c.physics.key, c.judged) for c in candidates[1:] if c.judged is not None and c.gained is not None and c.gained.beyond_chance]
    return tuple(key for key, judged in rivals if not gain(impacts, judged, best, rng).beyond_chance)
