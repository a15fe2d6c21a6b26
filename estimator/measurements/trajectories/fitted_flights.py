"""Free flights cut out of trajectories, each fitted by itself, with the noise that they all share.

Gravity is loose: each flight has an acceleration of its own besides, held near zero by a prior. Trackers whose lengths or clocks are a
per cent or two wrong bend flights in this way, and velocities at the end of a flight, where things strike, would inherit it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.trajectory import Trajectory
from estimator.effects.catalogue.dynamics.uniform_acceleration import UniformAcceleration
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import CampaignFit, CampaignState, fit_campaign
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.free_flights import Run
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import N_PARAMETERS, OMEGA, STEPS, Flight, FlightPoses, X, inertia_matrix, pose_differences, states
from estimator.motion.reached import Reached
from estimator.motion.rigid_body import States, angular_velocity, rotation_matrices

Array = NDArray[np.float64]
LOOSE_MS2 = 0.2
"""Standard deviation (m/s²) of a flight's own acceleration beside gravity: as lengths that are 2% or a clock that is 1% wrong make it.

By judgement."""


class LooseGravity(UniformAcceleration):
    """What is not known of the acceleration of a flight."""

    held: tuple[float, ...] | None = (LOOSE_MS2,) * 3


MODEL = Model((LooseGravity(),))
COLUMNS = N_PARAMETERS + MODEL.size
TIME_STEP_S = 1e-4
"""For a difference quotient of the acceleration."""
_VARIED = np.arange(X.start, OMEGA.stop)
_WIDTHS = 2.0 * STEPS[_VARIED]
_STEPS = np.zeros((1 + 2 * len(_VARIED), N_PARAMETERS))
"""Rows of steps to either side of a flight's varied parameters, for difference quotients."""
_STEPS[1 + 2 * np.arange(len(_VARIED)), _VARIED] = STEPS[_VARIED]
_STEPS[2 + 2 * np.arange(len(_VARIED)), _VARIED] = -STEPS[_VARIED]
"""No step, then each of a flight's state forth and back."""


@dataclass(frozen=True)
class FittedFlight:
    """The flight of ``run``: its parameters, ``covariance`` (24, 24) of all of them, zero where they are not varied, and its fit.

    ``mean_square``: of the residuals over their variance. ``sigma`` (c,): noise of the channels. ``row_misfit`` (n,): the same by row.
    ``theta`` (3,) m/s²: its acceleration beside gravity, world frame.
    """

    run: Run
    flight: Flight
    theta: Array
    setting: Setting
    covariance: Array
    mean_square: float
    sigma: Array
    row_misfit: Array

    @cached_property
    def falling(self) -> Flight:
        """The flight with its own acceleration in the place of gravity."""
        return replace(self.flight, gravity_world=self.flight.gravity_world + self.theta)

    @property
    def ends_s(self) -> tuple[float, float]:
        """Times of its first and its last row."""
        return float(self.setting.times_s[0]), float(self.setting.times_s[-1])

    def at(self, time_s: float) -> Reached:
        """The motion at a time, also beyond the flight's rows."""
        reached, omega = self._reached(_STEPS, time_s)
        every = FlightPoses(reached.x[:1], rotation_matrices(reached.q[:1]))
        velocity = np.hstack([reached.v[0], omega])
        pose_J, velocity_J = np.zeros((6, COLUMNS)), np.zeros((6, COLUMNS))
        pose_J[:, _VARIED] = pose_differences(every, _WIDTHS)[0]
        velocity_J[:, _VARIED] = ((velocity[1::2] - velocity[2::2]) / _WIDTHS[:, None]).T
        elapsed = time_s - self.flight.time_s
        pose_J[:3, N_PARAMETERS:], velocity_J[:3, N_PARAMETERS:] = 0.5 * elapsed**2 * np.eye(3), elapsed * np.eye(3)
        return Reached(every.centre[0, 0], every.R[0, 0], velocity[0], pose_J, velocity_J)

    def change_at(self, time_s: float) -> Array:
        """Rate (6,) of v and omega at a time."""
        later, sooner = (self._reached(_STEPS[:1], time_s + h)[1][0] for h in (TIME_STEP_S, -TIME_STEP_S))
        return np.concatenate([self.falling.gravity_world, (later - sooner) / (2.0 * TIME_STEP_S)])

    def _reached(self, steps: Array, time_s: float) -> tuple[States, Array]:
        reached = states(self.falling, steps, np.array([time_s]))
        inverse = np.linalg.inv(inertia_matrix(self.flight, self.flight.inertia[None]))
        return reached, angular_velocity(reached.q[0], reached.L[0], np.broadcast_to(inverse, (len(steps), 3, 3)))


def cut(trajectory: Trajectory, run: Run) -> Trajectory:
    """The rows of ``run`` alone, with their own times."""

    def rows(column: Array | None) -> Array | None:
        return None if column is None else column[run.first : run.last]

    return Trajectory(
        f"{trajectory.name} {run.first}",
        trajectory.times_s[run.first : run.last],
        trajectory.x_world[run.first : run.last],
        rows(trajectory.q_world_tracked),
        rows(trajectory.omega_world),
        rows(trajectory.sigma_x),
        rows(trajectory.sigma_theta),
        rows(trajectory.sigma_omega),
        trajectory.surroundings,
        rows(trajectory.gyro),
        rows(trajectory.sigma_gyro),
    )


def fitted_flights(pieces: Sequence[tuple[Trajectory, Run]]) -> list[FittedFlight]:
    """Every piece fitted, in the order given; noise that nobody states is estimated from all of them."""
    if not pieces:
        return []
    registered = register_trajectories([cut(trajectory, run) for trajectory, run in pieces])
    fit = _fit(registered)
    return [_fitted(registered, fit, number, run) for number, (_, run) in enumerate(pieces)]


def _fit(registered: Registered) -> CampaignFit:
    start = CampaignState(registered.start.flights, tuple(np.zeros(MODEL.size) for _ in registered.start.flights))
    return fit_campaign(registered.campaign, start, MODEL)


def _fitted(registered: Registered, fit: CampaignFit, number: int, run: Run) -> FittedFlight:
    task, frames = registered.campaign.sequences[number], fit.equations[number].frames
    varied = np.flatnonzero(np.diag(frames.H) > 0.0)
    scale = np.sqrt(np.diag(frames.H)[varied])
    inverse = np.linalg.inv(frames.H[np.ix_(varied, varied)] / np.outer(scale, scale)) / np.outer(scale, scale)
    inverse = inverse @ frames.meat[np.ix_(varied, varied)] @ inverse * max(frames.mean_square, 1.0)
    covariance = np.zeros(frames.H.shape)
    covariance[np.ix_(varied, varied)] = 0.5 * (inverse + inverse.T)
    return FittedFlight(
        run,
        fit.state.flights[number],
        fit.state.theta[number],
        task.setting,
        covariance,
        frames.mean_square,
        task.sigma.mean(axis=0),
        frames.chi2 / np.maximum(frames.count, 1),
    )
