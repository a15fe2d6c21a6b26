"""How large physics that was not added would have to be, to have been found in these very impacts.

What an addition would change of v and omega, beyond what the constants that are in the model take up, is put on noise as large as the
impacts' own; the size that the judgement of the ladder would then have accepted in 95% of cases is the limit [Currie 1968]. Of what the
held-out impacts decide only the loss for one more fitted constant is counted, a unit of the cost per fold that it is fitted to.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.stats import norm

from estimator.contact_validation.fitting import SCATTERS, Impacts, costs_of, fit, whitened
from estimator.contact_validation.held_out import CHANCE, FOLDS, LEAST_AGREEMENT, Judged
from estimator.contact_validation.models import ADDITIONS, ContactModel, FreeParameter, Physics, impulse_model

Array = NDArray[np.float64]
NOISES = 200
SMALLEST = 1e-3
"""Of a parameter's range, below which no limit is looked for."""
HALVINGS = 7
HALF, NEARLY_ALL = 0.5, 0.95
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
    noise = (
        rng.normal(size=(NOISES, len(impacts), 6)) + last.fitted.scatter * rng.normal(size=(NOISES, len(impacts), 1)) * impacts.scattering
    )
    found = []
    for physics in (p for p in ADDITIONS if p.key not in added):
        model = impulse_model((*added, physics.key))
        for parameter in physics.parameters:
            trial = _Trial(impacts, last, model, parameter, noise)
            found.append(_limits(physics, parameter, trial))
    return tuple(found)


@dataclass(frozen=True)
class _Trial:
    """One parameter on trial: the ``last`` model against ``model``, which has the parameter, under ``noise`` [draw, impact] (6,)."""

    impacts: Impacts
    last: Judged
    model: ContactModel
    parameter: FreeParameter
    noise: Float[NDArray[np.float64], "draw impact 6"]

    @property
    def runs(self) -> list[list[int]]:
        """Rows of the impacts of each run."""
        rows: dict[str, list[int]] = {}
        for k, impact in enumerate(self.impacts.measured):
            rows.setdefault(impact.run, []).append(k)
        return list(rows.values())

    def power(self, size: float) -> float:
        """Share of draws in which a parameter of this ``size`` would have been accepted."""
        gains = self._costs(self.noise + self._left(size)) - self._costs(self.noise)
        per_run = np.stack([gains[:, rows].sum(axis=1) for rows in self.runs], axis=1)
        total = per_run.sum(axis=1) - REFITTED
        spread = np.sqrt(per_run.shape[1]) * per_run.std(axis=1)
        return float(np.mean((total > CHANCE * self.last.dispersion) & (total > norm.ppf(LEAST_AGREEMENT) * spread)))

    def _left(self, size: float) -> Float[NDArray[np.float64], "impact 6"]:
        """What the last model, fitted anew, leaves of impacts as the parameter makes them; whitened."""
        known = dict(zip(self.last.fitted.model.names, self.last.fitted.values.tolist(), strict=True)) | {self.parameter.name: size}
        after = self.model.predict(self.impacts.measured, np.array([known.get(p.name, 0.0) for p in self.model.parameters]))
        made = tuple(replace(impact, after=row) for impact, row in zip(self.impacts.measured, after, strict=True))
        there = replace(self.impacts, measured=made)
        fitted = fit(there, self.last.fitted.model, known=(self.last.fitted.values,), scatter=self.last.fitted.scatter)
        return whitened(there, fitted.model, fitted.values)

    def _costs(self, z: Array) -> Float[NDArray[np.float64], "draw impact"]:
        """Costs of residuals, in each draw under the scatter that makes them least."""
        every = self.impacts.take(np.tile(np.arange(len(self.impacts)), len(z)).tolist())
        costs = np.stack([costs_of(every, z.reshape(-1, 6), s).reshape(len(z), -1) for s in SCATTERS])
        return np.asarray(costs[np.argmin(costs.sum(axis=2), axis=0), np.arange(len(z))])


def _limits(physics: Physics, parameter: FreeParameter, trial: _Trial) -> Detectable:
    most = parameter.bounds[1]
    low, high = np.log(SMALLEST * most), np.log(most)
    half, nearly_all = (_reached(trial, low, high, share) for share in (HALF, NEARLY_ALL))
    return Detectable(physics.key, physics.title, parameter.name, parameter.unit, half, nearly_all)


def _reached(trial: _Trial, low: float, high: float, share: float) -> float | None:
    """The size, between logarithms, at which the power passes ``share``; it grows with the size but for chance."""
    if trial.power(float(np.exp(high))) < share:
        return None
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if trial.power(float(np.exp(middle))) < share:
            low = middle
        else:
            high = middle
    return float(np.exp(high))
