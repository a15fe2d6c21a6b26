"""What an instrument reports of a quantity, with derivatives: the quantity's own, passed on, and those by the instrument's parameters."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model, slope_of
from estimator.motion.flight import N_PARAMETERS

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """One channel: residuals ``e`` (n, 3) in the unit and axes of what is read, ``rate`` (n, 3) per second, ``J`` (n, 3, 21 + q)."""

    e: Array
    rate: Array
    J: Array


@dataclass(frozen=True)
class Instrument:
    """An instrument that ``report``s (n, 3) of true values (n, 3) at parameters (q,); ``link`` is what effects change of it.

    ``by``: derivatives (n, 3, q) of what it reports by the parameters; ``None``: by differences. ``step``: for derivatives by the true
    values; reports are smooth in them, mostly linear.
    """

    link: str
    report: Callable[[Array, Array], Array]
    step: float
    by: Callable[[Array, Array], Array] | None = None

    def changed(self, model: Model) -> bool:
        """Whether an effect makes it report anything but the true values."""
        return bool(model.touching(self.link))

    def of(self, at: tuple[Model, Array], true: Array, rate: Array, J: Array) -> Channel:
        """Reports of ``true`` (n, 3), units and axes as of :class:`Channel`, ``rate`` (n, 3) per second, ``J`` (n, 3, 21 + q)."""
        model, theta = at
        if not self.changed(model):
            return Channel(true, rate, J)
        slope = slope_of(partial(self.report, theta), true, self.step)
        J = slope @ J
        J[:, :, N_PARAMETERS:] += self._by_differences(model, theta, true) if self.by is None else self.by(theta, true)
        return Channel(self.report(theta, true), np.einsum("nij,nj->ni", slope, rate), J)

    def _by_differences(self, model: Model, theta: Array, true: Array) -> Array:
        """Derivatives (n, 3, q) of reports by the parameters."""
        found = np.zeros((*true.shape, len(theta)))
        for _, part in model.touching(self.link):
            for column in range(part.start, part.stop):
                change = np.zeros(len(theta))
                change[column] = model.steps[column]
                width = 2.0 * model.steps[column]
                found[:, :, column] = (self.report(theta + change, true) - self.report(theta - change, true)) / width
        return found
