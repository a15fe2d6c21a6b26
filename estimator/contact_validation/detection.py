"""How large physics that was not added would have to be, to have been found in these very impacts.

What an addition would change of v and omega, beyond what the constants that are in the model take up, is put on noise as large as the
impacts' own; the size that the judgement of the ladder would then have accepted in 95% of cases is the limit [Currie 1968]. Of what the
held-out impacts decide only the loss for one more fitted constant is counted, a unit of the cost per fold that it is fitted to.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.stats import norm

from estimator.contact_validation.fitting import SCATTERS, Fitted, Impacts, costs_of, fit, whitened
from estimator.contact_validation.held_out import CHANCE, FOLDS, LEAST_AGREEMENT, Judged, by_run
from estimator.contact_validation.laws.models import ADDITIONS, ContactModel, FreeParameter, Physics, impulse_model

Array = NDArray[np.float64]
NOISES = 200
"""Drawn errors of a whole set of impacts; a share of 95% is known to 1.5% by them."""
SMALLEST = 1e-3
"""Of a parameter's range, below which no limit is looked for."""
HALVINGS = 7
"""Of the interval of a limit's logarithm, a factor of a thousand at first: 5% of a size are left."""
HALF, NEARLY_ALL = 0.5, 0.95
"""Shares of sets like this one in which a size that is called a limit is found."""
REFITTED = FOLDS / (FOLDS - 1.0)
"""What a fitted constant that is not needed costs held-out impacts, in units of the cost."""


@dataclass(frozen=True)
class Detectable:
    """Sizes of ``parameter`` found in half and in 95% of sets like this one; ``None``: not even at the end of its range."""

    physics: str
    title: str
    parameter: str
    unit: str
    half: float | None
    nearly_all: float | None


def detectable(impacts: Impacts, last: Judged, added: tuple[str, ...], rng: np.random.Generator) -> tuple[Detectable, ...]:
    """The limits of all physics that is not ``added`` to the ``last`` model."""
    trial = _Trial(impacts, last, _noise(impacts, last.fitted.scatter, rng))
    found = []
    for physics in (p for p in ADDITIONS if p.key not in added):
        model = impulse_model((*added, physics.key))
        found += [_limits(trial, physics, parameter, model) for parameter in physics.parameters]
    return tuple(found)


def power(impacts: Impacts, before: Judged, law: Fitted, rng: np.random.Generator) -> float:
    """Share of sets like this one in which ``law``, were it nature's with its values and scatter, would be accepted after ``before``."""
    return _Trial(impacts, before, _noise(impacts, law.scatter, rng)).power(law.model, law.values)


def _noise(impacts: Impacts, scatter: float, rng: np.random.Generator) -> Float[NDArray[np.float64], "draw impact 6"]:
    """Whitened errors of impacts whose restitution scatters."""
    scattered = scatter * rng.normal(size=(NOISES, len(impacts), 1)) * impacts.scattering
    return np.asarray(rng.normal(size=(NOISES, len(impacts), 6)) + scattered)


@dataclass(frozen=True)
class _Trial:
    """The ``last`` model of ``impacts`` against others that are nature's under ``noise`` [draw, impact] (6,)."""

    impacts: Impacts
    last: Judged
    noise: Float[NDArray[np.float64], "draw impact 6"]

    def power(self, model: ContactModel, values: Array) -> float:
        """Share of draws in which ``model``, nature's at ``values``, would have been accepted."""
        gains = self._costs(self.noise + self._left(model, values)) - self._costs(self.noise)
        per_run = by_run(self.impacts, gains)
        total = per_run.sum(axis=1) - REFITTED
        spread = np.sqrt(per_run.shape[1]) * per_run.std(axis=1)
        return float(np.mean((total > CHANCE * self.last.dispersion) & (total > norm.ppf(LEAST_AGREEMENT) * spread)))

    def _left(self, model: ContactModel, values: Array) -> Float[NDArray[np.float64], "impact 6"]:
        """What the last model, fitted anew, leaves of impacts as ``model`` makes them; whitened."""
        after = model.predict(self.impacts.measured, values)
        made = tuple(replace(impact, after=row) for impact, row in zip(self.impacts.measured, after, strict=True))
        there = replace(self.impacts, measured=made)
        fitted = fit(there, self.last.fitted.model, known=(self.last.fitted.values,), scatter=self.last.fitted.scatter)
        return whitened(there, fitted.model, fitted.values)

    def _costs(self, z: Array) -> Float[NDArray[np.float64], "draw impact"]:
        """Costs of residuals, in each draw under the scatter that makes them least."""
        every = self.impacts.take(np.tile(np.arange(len(self.impacts)), len(z)).tolist())
        costs = np.stack([costs_of(every, z.reshape(-1, 6), s).reshape(len(z), -1) for s in SCATTERS])
        return np.asarray(costs[np.argmin(costs.sum(axis=2), axis=0), np.arange(len(z))])


def _limits(trial: _Trial, physics: Physics, parameter: FreeParameter, model: ContactModel) -> Detectable:
    """Limits of one parameter of ``model``, beside the last model's values."""
    known = trial.last.fitted.by_name

    @cache
    def found(logarithm: float) -> float:
        values = known | {parameter.name: float(np.exp(logarithm))}
        return trial.power(model, np.array([values.get(p.name, 0.0) for p in model.parameters]))

    most = float(np.log(parameter.bounds[1]))
    half, nearly_all = (_reached(found, (most + np.log(SMALLEST), most), share) for share in (HALF, NEARLY_ALL))
    return Detectable(physics.key, physics.title, parameter.name, parameter.unit, half, nearly_all)


def _reached(found: Callable[[float], float], span: tuple[float, float], share: float) -> float | None:
    """The size, between logarithms, at which the power passes ``share``; it grows with the size but for chance."""
    low, high = span
    if found(high) < share:
        return None
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if found(middle) < share:
            low = middle
        else:
            high = middle
    return float(np.exp(high))
