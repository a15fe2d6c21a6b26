"""What a gyroscope fixed to the body reads: ``B Rᵀ omega``, B the nominal body's axes in the tracked frame, and what effects make of it.

A left turn dθ of R takes ``Rᵀ (dθ x omega)`` off the reading, so with the derivatives Sω of the spin and Sθ of the attitude, world frame,
those of the reading are ``B Rᵀ (Sω + omega x Sθ)``. Valid for a gyroscope along the tracked frame's axes, read at the row's time.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model, overrides
from estimator.fitting.prediction import Prediction
from estimator.motion.flight import N_PARAMETERS, Flight

Array = NDArray[np.float64]
STEP_RADS = 1e-3
"""For derivatives of readings by the angular velocity; they are smooth, mostly linear."""


@dataclass(frozen=True)
class Channel:
    """One channel: residuals ``e`` (n, 3), their ``rate`` (n, 3) by the time, derivatives ``J`` (n, 3, 21 + q)."""

    e: Array
    rate: Array
    J: Array


def gyroscope_channel(measured: Array, flight: Flight, at: tuple[Model, Array], prediction: Prediction, times_s: Array) -> Channel:
    """The residuals of readings ``measured`` (n, 3) rad/s; the prediction has derivatives of the spin."""
    model, theta = at
    if prediction.spin_sensitivity is None:
        raise ValueError("expected a prediction with derivatives of the spin, got one without")
    axes = flight.body.R_particle_body @ np.swapaxes(prediction.poses.R[:, 0], 1, 2)
    omega = np.einsum("nij,nj->ni", axes, prediction.omega)
    J = axes @ (prediction.spin_sensitivity + np.cross(prediction.omega[:, :, None], prediction.sensitivity[:, 3:], axis=1))
    read = model.reading(theta, omega)
    if any(overrides(effect, "reading") for effect in model.effects):
        J = _slope(model, theta, omega) @ J
        for column, step in enumerate(model.steps):
            change = np.zeros(len(theta))
            change[column] = step
            J[:, :, N_PARAMETERS + column] += (model.reading(theta + change, omega) - model.reading(theta - change, omega)) / (2.0 * step)
    return Channel(read - measured, np.gradient(read, times_s, axis=0), J)


def _slope(model: Model, theta: Array, omega: Array) -> Array:
    """Derivatives (n, 3, 3) of readings by the angular velocity along the tracked frame's axes."""
    steps = STEP_RADS * np.eye(3)
    return np.stack([(model.reading(theta, omega + d) - model.reading(theta, omega - d)) / (2.0 * STEP_RADS) for d in steps], axis=-1)
