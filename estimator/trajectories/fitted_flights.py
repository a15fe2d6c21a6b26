"""Free flights cut out of trajectories, each fitted by itself, with the noise that they all share.

Gravity is loose: each flight has an acceleration of its own besides, held near zero by a prior. Trackers whose lengths or clocks are a
per cent or two wrong bend flights in this way, and velocities at the end of a flight, where things strike, would inherit it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from datasets.trajectory import Trajectory
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.effects.uniform_acceleration import UniformAcceleration
from estimator.fitting.campaign import CampaignFit, CampaignState, fit_campaign
from estimator.fitting.forced_velocities import velocities_under
from estimator.fitting.prediction import predict
from estimator.motion.flight import Flight
from estimator.registration import Registered
from estimator.trajectories.free_flights import Run
from estimator.trajectories.registering import register_trajectories

Array = NDArray[np.float64]
LOOSE_MS2 = 0.2


class LooseGravity(UniformAcceleration):
    """What is not known of the acceleration of a flight."""

    held: ClassVar[tuple[float, ...] | None] = (LOOSE_MS2,) * 3


MODEL = Model((LooseGravity(),))


@dataclass(frozen=True)
class FittedFlight:
    """The flight of ``run``: its parameters, ``covariance`` (24, 24) of all of them, zero where they are not varied, and its fit.

    ``mean_square``: of the residuals over their variance. ``sigma`` (c,): noise of the channels. ``row_misfit`` (n,): the same by row.
    """

    run: Run
    flight: Flight
    theta: Array
    setting: Setting
    covariance: Array
    mean_square: float
    sigma: Array
    row_misfit: Array

    def at(self, time_s: float) -> "Reached":
        """The motion at a time, also beyond the flight's rows."""
        there = predict(self.flight, MODEL, self.theta, self.setting, np.array([time_s]))
        velocity, J = velocities_under(self.flight, MODEL, self.theta, self.setting, time_s)
        return Reached(there.poses.centre[0, 0], there.poses.R[0, 0], velocity, there.sensitivity[0], J)


@dataclass(frozen=True)
class Reached:
    """A flight at one time, world frame: ``x`` (3,) m, ``R`` (3, 3) world from body, ``velocity`` (6,) of v (m/s) and omega (rad/s).

    ``pose_J`` and ``velocity_J`` (6, 24) by the flight's parameters, a turn as its left rotation vector.
    """

    x: Array
    R: Array
    velocity: Array
    pose_J: Array
    velocity_J: Array


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
