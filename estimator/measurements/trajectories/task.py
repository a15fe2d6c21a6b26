"""One measured trajectory as part of a campaign: residuals against a model with effects, and their derivatives.

Residuals are predicted minus measured: positions (m) of the tracked point, rotation vectors (rad, world frame) of the tracked frame,
angular velocities (rad/s) in the world frame, and those of a gyroscope along the tracked frame's axes, where they were measured. Each is
divided by its standard deviation, so their unit is that; what was not measured has an infinite one, and neither residual nor derivative.
The prediction is that of :mod:`estimator.appearance.prediction`: the chain that silhouettes use, ended before the pictures.

What a trajectory does not measure is not varied: without a measured orientation nothing of the body, without orientation and spin nothing
that turns, without positions nothing that moves. A gyroscope alone does not know how the world lies: the world's axes are then those of the
tracked frame at the flight's reference time.
"""

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.prediction import VARIED, Prediction, predict
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.likelihood.rows import Rows
from estimator.measurements.trajectories.reported import Channel, Instrument, gyroscope_channel
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, OMEGA, THETA, Flight, V, X
from estimator.motion.rotation import rotation_vector

Array = NDArray[np.float64]
STEP_SHARE = 1e-4
"""Of the measured volume's size: steps for derivatives of what a tracker reports."""


@dataclass(frozen=True)
class TrajectoryTask:
    """One sequence of a campaign of trajectories.

    ``x_world`` (n, 3) m of the centre of mass of the nominal body; ``R_world_body`` (n, 3, 3), ``omega_world`` (n, 3) rad/s and ``gyro``
    (n, 3) rad/s, tracked frame, or ``None``; ``sigma`` (n, c) standard deviations of the c residuals of each row in the order positions,
    rotations, spins, gyroscope, infinite where nothing was measured; ``repeats`` (c,) over how many rows the noise of each is alike, and
    ``freedom`` (c,) by how many degrees of freedom it is known; ``kept`` (n,) rows in use; ``stated``: channels whose noise is;
    ``spoiled``: rows of which something is set aside.
    """

    name: str
    setting: Setting
    x_world: Array
    R_world_body: Array | None
    omega_world: Array | None
    sigma: Array
    repeats: Array
    kept: NDArray[np.bool_]
    freedom: Array
    gyro: Array | None = None
    noise: float = 1.0
    stated: frozenset[str] = frozenset()
    spoiled: frozenset[int] = frozenset()

    def with_noise(self, noise: float) -> "TrajectoryTask":
        """The same with standard deviations ``noise`` times those that were stated or estimated."""
        return replace(self, sigma=self.sigma * (noise / self.noise), noise=noise)

    def without(self, channel: str, rows: NDArray[np.bool_]) -> "TrajectoryTask":
        """The same with a channel not measured in some ``rows`` (n,)."""
        sigma = self.sigma.copy()
        sigma[rows, self.columns(channel)] = np.inf
        return replace(self, sigma=sigma, spoiled=self.spoiled | set(np.flatnonzero(rows).tolist()))

    def with_misread_spin(self) -> "TrajectoryTask":
        """The same as if nobody had read the spin."""
        sigma = self.sigma.copy()
        sigma[:, self.columns("omega")] = np.inf
        return replace(self, sigma=sigma, setting=replace(self.setting, misread=True))

    @property
    def misread(self) -> bool:
        """Whether the spin that was read once is set aside."""
        return self.setting.misread

    @property
    def times_s(self) -> Array:
        """Times (n,) of the rows."""
        return self.setting.times_s

    @property
    def channels(self) -> tuple[str, ...]:
        """What has three columns of residuals each, in their order; positions always have, though none may be measured."""
        present = (("x", True), ("theta", self.R_world_body), ("omega", self.omega_world), ("gyro", self.gyro))
        return tuple(name for name, values in present if values is not None)

    def columns(self, channel: str) -> slice:
        """The columns of a channel."""
        first = 3 * self.channels.index(channel)
        return slice(first, first + 3)

    def seen(self, channel: str) -> NDArray[np.bool_]:
        """Where (n, 3) a channel was measured."""
        if channel not in self.channels:
            return np.zeros((len(self.times_s), 3), dtype=np.bool_)
        return np.isfinite(self.sigma[:, self.columns(channel)])

    @property
    def measured(self) -> frozenset[str]:
        """The channels that were measured at all."""
        return frozenset(channel for channel in self.channels if self.seen(channel).any())

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Which of a flight's parameters (21,) are not varied: the body is what is stated, unless an effect says otherwise."""
        mask = np.zeros(N_PARAMETERS, dtype=np.bool_)
        mask[COM] = mask[INERTIA] = mask[OFFSET] = True
        mask[X] = mask[V] = ~self.seen("x").any(axis=0)
        mask[THETA] = "theta" not in self.measured
        mask[OMEGA] = not self.measured & {"theta", "omega", "gyro"}
        return mask


def read_once(task: TrajectoryTask) -> bool:
    """Whether a spin was measured in one row alone, beside positions and nothing that turns; that it is set aside does not matter."""
    return task.misread or bool(task.measured == {"x", "omega"} and task.seen("omega").any(axis=1).sum() == 1)


def trajectory_errors(task: TrajectoryTask, flight: Flight, model: Model, theta: Array) -> Rows:
    """Residuals and derivatives at a flight and effect parameters ``theta`` (q,)."""
    spins = task.omega_world is not None or task.gyro is not None
    prediction = predict(flight, model, theta, task.setting, task.times_s, varied=VARIED & ~task.still, spins=spins)
    parts = [_positions(task, prediction, model, theta)]
    if task.R_world_body is not None:
        turned = rotation_vector(prediction.poses.R[:, 0] @ np.swapaxes(task.R_world_body, 1, 2))
        parts.append(Channel(turned, prediction.omega, _inverse_left_jacobian(turned) @ prediction.sensitivity[:, 3:]))
    if task.omega_world is not None and prediction.spin_sensitivity is not None:
        change = np.gradient(prediction.omega, task.times_s, axis=0)
        parts.append(Channel(prediction.omega - task.omega_world, change, prediction.spin_sensitivity))
    if task.gyro is not None and prediction.spin_sensitivity is not None:
        parts.append(gyroscope_channel(task.gyro, flight, (model, theta), prediction, task.times_s))
    J = np.concatenate([part.J for part in parts], axis=1)
    J[..., np.flatnonzero(task.still)] = 0.0
    J[..., N_PARAMETERS + np.flatnonzero(model.frozen)] = 0.0
    seen = task.kept[:, None] & np.isfinite(task.sigma)
    weight = np.where(seen, 1.0 / task.sigma, 0.0)
    e, rate = (np.concatenate(each, axis=1) * weight for each in ([p.e for p in parts], [p.rate for p in parts]))
    J *= weight[..., None]
    return Rows(e, seen, task.sigma**2, prediction, task.noise, model.random_sigma(theta), rate=rate, J=J)


def _positions(task: TrajectoryTask, prediction: Prediction, model: Model, theta: Array) -> Channel:
    """Residuals of positions: lengths may be wrong by a factor, and the tracker's volume distorted."""
    scale = model.scale(theta)
    setting, step_m = task.setting, STEP_SHARE * task.setting.reach_m
    by = partial(model.tracked_by, setting=setting, step_m=step_m)
    tracker = Instrument("tracked", partial(model.tracked, setting=setting), step_m, by)
    seen = tracker.of(
        (model, theta), prediction.poses.centre[:, 0] / scale, prediction.velocity / scale, _scaled(prediction, model, theta, scale)
    )
    return replace(seen, e=seen.e - task.x_world)


def _scaled(prediction: Prediction, model: Model, theta: Array, scale: float) -> Array:
    """Derivatives (n, 3, 21 + q) of measured positions: lengths that are wrong by a factor divide them."""
    S = prediction.sensitivity[:, :3] / scale
    for _, part in model.touching("scale"):
        for column in range(part.start, part.stop):
            up, down, step = theta.copy(), theta.copy(), model.steps[column]
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
