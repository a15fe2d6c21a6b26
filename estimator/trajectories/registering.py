"""From measured trajectories to a campaign: tasks, the flights that fits start from, and the noise where nobody states it."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.trajectory import Trajectory
from estimator.diagnosis.base import base_fit
from estimator.effects.link import Setting
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState
from estimator.measurements.trajectories import TRAJECTORIES
from estimator.motion.rigid_body import rotation_matrices
from estimator.registration import Registered
from estimator.trajectories.noise import channel_noise
from estimator.trajectories.starting import first_flight
from estimator.trajectories.task import TrajectoryTask

Array = NDArray[np.float64]
FIRST_GUESS = {"x": 1e-3, "theta": 1e-2, "omega": 1.0}
"""Standard deviations of the first fit (m, rad, rad/s), whose residuals tell the noise."""
ROUNDS = 2


def register_trajectories(trajectories: Sequence[Trajectory], *, told: Callable[[str], None] = lambda _: None) -> Registered:
    """A campaign of trajectories; ``told`` is called with the name of each sequence that is done.

    Raises
    ------
    InputError
        Where trajectories of one particle contradict one another.
    """
    tasks, flights = [], []
    for trajectory in trajectories:
        task = task_of(trajectory)
        tasks.append(task)
        flights.append(first_flight(task, trajectory.surroundings.body))
        told(trajectory.name)
    campaign = Campaign(tuple(tasks), particles_of(trajectories), (0,) * len(tasks), floor_px=0.0, body_noise_px=0.0, kind=TRAJECTORIES)
    state = CampaignState(tuple(flights), tuple(np.zeros(0) for _ in flights))
    stated = [_stated(t) for t in trajectories]
    if tasks and not all(all(s.values()) for s in stated):
        for _ in range(ROUNDS):
            fit = base_fit(campaign, state)
            campaign, state = replace(campaign, sequences=_with_noise(campaign, fit, stated)), CampaignState(fit.state.flights, state.theta)
    return Registered(campaign, state, (), ())


def particles_of(trajectories: Sequence[Trajectory]) -> tuple[int, ...]:
    """The number of the particle of every trajectory: that of its name, or of its inertia ratios where it has none.

    The place of the centre of mass and of the axes may differ: a tag that is tracked can sit elsewhere on the same body.

    Raises
    ------
    InputError
        Where trajectories of one name state different inertia ratios.
    """
    first: dict[str, Trajectory] = {}
    numbers: dict[tuple[float | str, ...], int] = {}
    found = []
    for each in trajectories:
        name, ratios = each.surroundings.particle, _ratios(each)
        other = first.setdefault(name, each)
        if name and ratios != _ratios(other):
            raise InputError(
                f"{each.name}: expected the inertia ratios of particle {name!r} as {other.name} has them, {_ratios(other)}, came {ratios}."
            )
        found.append(numbers.setdefault((name,) if name else ratios, len(numbers)))
    return tuple(found)


def _ratios(trajectory: Trajectory) -> tuple[float, ...]:
    """Inertia ratios to six digits."""
    return tuple(round(float(ratio), 6) for ratio in trajectory.surroundings.body.inertia_ratios)


def _stated(trajectory: Trajectory) -> dict[str, bool]:
    """Of which channels the noise is known."""
    sigma = {"x": trajectory.sigma_x, "theta": trajectory.sigma_theta, "omega": trajectory.sigma_omega}
    there = {"x": True, "theta": trajectory.q_world_tracked is not None, "omega": trajectory.omega_world is not None}
    return {channel: sigma[channel] is not None for channel, present in there.items() if present}


def task_of(trajectory: Trajectory) -> TrajectoryTask:
    """The task of one trajectory; noise that is not known is a first guess."""
    body = trajectory.surroundings.body
    R, x = None, trajectory.x_world
    if trajectory.q_world_tracked is not None:
        tracked = rotation_matrices(trajectory.q_world_tracked)
        R, x = tracked @ body.R_particle_body, x + tracked @ body.com_particle
    sigma = {"x": trajectory.sigma_x, "theta": trajectory.sigma_theta, "omega": trajectory.sigma_omega}
    present = _stated(trajectory)
    columns = [np.full(x.shape, FIRST_GUESS[c]) if sigma[c] is None else sigma[c] for c in present]
    setting = Setting(trajectory.times_s, 0.0, trajectory.surroundings.gravity_world, body.inertia_ratios)
    n, c = len(x), 3 * len(present)
    known = np.concatenate([np.asarray(each, dtype=np.float64) for each in columns], axis=1)
    return TrajectoryTask(trajectory.name, setting, x, R, trajectory.omega_world, known, np.ones(c), np.ones(n, dtype=np.bool_))


def _with_noise(campaign: Campaign, fit: CampaignFit, stated: Sequence[dict[str, bool]]) -> tuple[TrajectoryTask, ...]:
    """The sequences with noise estimated from the fit's residuals wherever it is not stated."""
    tasks: list[TrajectoryTask] = list(campaign.sequences)
    for channel in ("x", "theta", "omega"):
        rows = [i for i, s in enumerate(stated) if s.get(channel) is False]
        for axis in range(3):
            columns = {i: 3 * tasks[i].channels.index(channel) + axis for i in rows}
            residuals = [fit.equations[i].errors.e[:, k] * tasks[i].sigma[:, k] for i, k in columns.items()]
            noise = channel_noise(residuals) if rows else None
            for i, k in columns.items():
                if noise is not None:
                    tasks[i] = _replaced(tasks[i], k, noise.sigma, noise.repeats)
    return tuple(tasks)


def _replaced(task: TrajectoryTask, column: int, sigma: float, repeats: float) -> TrajectoryTask:
    new_sigma, new_repeats = task.sigma.copy(), task.repeats.copy()
    new_sigma[:, column], new_repeats[column] = sigma, repeats
    return replace(task, sigma=new_sigma, repeats=new_repeats)
