"""What a gyroscope fixed to the body reads: ``B Rᵀ omega``, B the nominal body's axes in the tracked frame, and what effects make of it.

A left turn dθ of R takes ``Rᵀ (dθ x omega)`` off the reading, so with the derivatives Sω of the spin and Sθ of the attitude, world frame,
those of the reading are ``B Rᵀ (Sω + omega x Sθ)``. Valid for a gyroscope along the tracked frame's axes, read at the row's time.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.prediction import Prediction
from estimator.effects.model import Model
from estimator.measurements.trajectories.reported import Channel, Instrument
from estimator.motion.flight import Flight

Array = NDArray[np.float64]
STEP_RADS = 1e-3
"""For derivatives of readings by the angular velocity; they are smooth, mostly linear."""


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
