"""What an instrument reports of a quantity, with derivatives: the quantity's own, passed on, and those by the instrument's parameters.

A gyroscope fixed to the body reads ``B Rᵀ omega``, B the nominal body's axes in the tracked frame, and what effects make of it. A left turn
dθ of R takes ``Rᵀ (dθ x omega)`` off the reading, so with the derivatives Sω of the spin and Sθ of the attitude, world frame, those of the
reading are ``B Rᵀ (Sω + omega x Sθ)``. Valid for a gyroscope along the tracked frame's axes, read at the row's time.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.prediction import Prediction
from estimator.effects.model import Model, slope_of
from estimator.motion.flight import N_PARAMETERS, Flight

Array = NDArray[np.float64]
STEP_RADS = 1e-3
"""For derivatives of readings by the angular velocity; they are smooth, mostly linear."""


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


def gyroscope_channel(measured: Array, flight: Flight, at: tuple[Model, Array], prediction: Prediction, times_s: Array) -> Channel:
    """The residuals of readings ``measured`` (n, 3) rad/s, body axes; the prediction has derivatives of the spin.

    ``at``: model and its parameters (q,). ``times_s`` (n,).
    """
    model, _ = at
    if prediction.spin_sensitivity is None:
        raise ValueError("expected a prediction with derivatives of the spin, got one without")
    axes = flight.body.R_particle_body @ np.swapaxes(prediction.poses.R[:, 0], 1, 2)
    omega = np.einsum("nij,nj->ni", axes, prediction.omega)
    J = axes @ (prediction.spin_sensitivity + np.cross(prediction.omega[:, :, None], prediction.sensitivity[:, 3:], axis=1))
    read = Instrument("reading", model.reading, STEP_RADS).of(at, omega, np.gradient(omega, times_s, axis=0), J)
    return replace(read, e=read.e - measured)
