"""One measured trajectory as part of a campaign: residuals against a model with effects, and their derivatives.

Residuals are predicted minus measured: positions (m) of the tracked point, rotation vectors (rad, world frame) of the tracked frame where
it was measured, angular velocities (rad/s) where they were. Each is divided by its standard deviation, so their unit is that. The
prediction is that of :mod:`estimator.fitting.prediction`: the chain that silhouettes use, ended before the pictures.

What a trajectory does not measure is not varied: without a measured orientation nothing of the body, without orientation and spin nothing
that turns.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.link import Setting
from estimator.effects.model import Model, overrides
from estimator.fitting.forced_velocities import forced_states
from estimator.fitting.prediction import Prediction, predict
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, OMEGA, STEPS, THETA, Flight
from estimator.motion.rotation import rotation_vector

Array = NDArray[np.float64]


@dataclass(frozen=True)
class TrajectoryTask:
    """One sequence of a campaign of trajectories.

    ``x_world`` (n, 3) m of the centre of mass of the nominal body; ``R_world_body`` (n, 3, 3) and ``omega_world`` (n, 3) rad/s or ``None``;
    ``sigma`` (n, c) standard deviations of the c residuals of each row in the order positions, rotations, spins; ``repeats`` (c,) over
    how many rows the noise of each is alike; ``kept`` (n,) rows in use.
    """

    name: str
    setting: Setting
    x_world: Array
    R_world_body: Array | None
    omega_world: Array | None
    sigma: Array
    repeats: Array
    kept: NDArray[np.bool_]
    noise: float = 1.0

    def with_noise(self, noise: float) -> "TrajectoryTask":
        """The same with standard deviations ``noise`` times those that were stated or estimated."""
        return replace(self, sigma=self.sigma * (noise / self.noise), noise=noise)

    @property
    def times_s(self) -> Array:
        """Times (n,) of the rows."""
        return self.setting.times_s

    @property
    def channels(self) -> tuple[str, ...]:
        """What was measured: each stands for three residuals."""
        present = (("x", True), ("theta", self.R_world_body is not None), ("omega", self.omega_world is not None))
        return tuple(name for name, there in present if there)

    @property
    def still(self) -> NDArray[np.bool_]:
        """Which of a flight's parameters (21,) are not varied: the body is what is stated, unless an effect says otherwise."""
        mask = np.zeros(N_PARAMETERS, dtype=np.bool_)
        mask[COM] = mask[INERTIA] = mask[OFFSET] = True
        mask[THETA] = self.R_world_body is None
        mask[OMEGA] = self.R_world_body is None and self.omega_world is None
        return mask


@dataclass(frozen=True)
class TrajectoryErrors:
    """Residuals ``e`` (n, c) in standard deviations, zero where a row is not in use; ``J`` (n, c, 21 + q), ``seen`` (n, c), and more.

    ``rate`` (n, c) is the derivative of the residuals by the time of their row, 1/s; ``variance`` (n, c) m², rad² or (rad/s)².
    """

    e: Array
    J: Array
    seen: NDArray[np.bool_]
    rate: Array
    variance: Array
    prediction: Prediction


def trajectory_errors(task: TrajectoryTask, flight: Flight, model: Model, theta: Array) -> TrajectoryErrors:
    """Residuals and derivatives at a flight and effect parameters ``theta`` (q,)."""
    prediction = predict(flight, model, theta, task.setting, task.times_s)
    scale = model.scale(theta)
    parts = [prediction.poses.centre[:, 0] / scale - task.x_world]
    rates = [prediction.velocity / scale]
    columns = [_scaled(prediction, model, theta, scale)]
    if task.R_world_body is not None:
        turned = rotation_vector(prediction.poses.R[:, 0] @ np.swapaxes(task.R_world_body, 1, 2))
        parts.append(turned)
        rates.append(prediction.omega)
        columns.append(_inverse_left_jacobian(turned) @ prediction.sensitivity[:, 3:])
    if task.omega_world is not None:
        parts.append(prediction.omega - task.omega_world)
        rates.append(np.gradient(prediction.omega, task.times_s, axis=0))
        columns.append(_spin_sensitivity(task, flight, model, theta))
    J = np.concatenate(columns, axis=1)
    J[..., np.flatnonzero(task.still)] = 0.0
    J[..., N_PARAMETERS + np.flatnonzero(model.frozen)] = 0.0
    seen = np.repeat(task.kept[:, None], task.sigma.shape[1], axis=1)
    e, rate = np.concatenate(parts, axis=1) / task.sigma, np.concatenate(rates, axis=1) / task.sigma
    J = np.where(seen[..., None], J / task.sigma[..., None], 0.0)
    return TrajectoryErrors(np.where(seen, e, 0.0), J, seen, np.where(seen, rate, 0.0), task.sigma**2, prediction)


def _scaled(prediction: Prediction, model: Model, theta: Array, scale: float) -> Array:
    """Derivatives (n, 3, 21 + q) of measured positions: lengths that are wrong by a factor divide them."""
    S = prediction.sensitivity[:, :3] / scale
    for column, step in enumerate(model.steps):
        up, down = theta.copy(), theta.copy()
        up[column], down[column] = up[column] + step, down[column] - step
        growth = (model.scale(up) - model.scale(down)) / (2.0 * step)
        S[:, :, N_PARAMETERS + column] -= prediction.poses.centre[:, 0] * growth / scale**2
    return np.asarray(S)


def _inverse_left_jacobian(vectors: Array) -> Array:
    """How rotation vectors (n, 3) change with small turns applied from the left (n, 3, 3), to third order [Barfoot 2017, ch. 7]."""
    cross = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -z, y, -x
    cross[:, 1, 0], cross[:, 2, 0], cross[:, 2, 1] = z, -y, x
    return np.asarray(np.eye(3) - 0.5 * cross + cross @ cross / 12.0)


def _spin_sensitivity(task: TrajectoryTask, flight: Flight, model: Model, theta: Array) -> Array:
    """Derivatives (n, 3, 21 + q) of the angular velocity, by central differences."""
    varied = np.flatnonzero((STEPS > 0) & ~task.still)
    steps = np.zeros((2 * len(varied), N_PARAMETERS))
    rows = np.arange(len(varied))
    steps[2 * rows, varied], steps[2 * rows + 1, varied] = STEPS[varied], -STEPS[varied]
    _, omega = forced_states(flight, steps, (model, theta, task.setting), task.times_s)
    J = np.zeros((len(task.times_s), 3, N_PARAMETERS + model.size))
    J[:, :, varied] = np.swapaxes((omega[:, 0::2] - omega[:, 1::2]) / (2.0 * STEPS[varied])[:, None], 1, 2)
    for effect, part in zip(model.effects, model.slices, strict=True):
        if not overrides(effect, "times", "body", "torque"):
            continue
        for number, parameter in enumerate(effect.entry.parameters):
            change = np.zeros(model.size)
            change[part.start + number] = parameter.step
            high, low = (_spin(task, flight, model, theta + sign * change) for sign in (1.0, -1.0))
            J[:, :, N_PARAMETERS + part.start + number] = (high - low) / (2.0 * parameter.step)
    return J


def _spin(task: TrajectoryTask, flight: Flight, model: Model, theta: Array) -> Array:
    return forced_states(flight, np.zeros((1, N_PARAMETERS)), (model, theta, task.setting), task.times_s)[1][:, 0]
