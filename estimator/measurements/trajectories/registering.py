"""From measured trajectories to a campaign: tasks, the flights that fits start from, and the noise where nobody states it."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.trajectory import Trajectory
from estimator.effects.catalogue.clock.stamp_scatter import to_even_times
from estimator.effects.link import Setting
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignState
from estimator.fitting.campaigns.facts import Fact, length_fact
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.kind import Trajectories
from estimator.measurements.trajectories.noise import with_noise, without_spoiled
from estimator.measurements.trajectories.starting import first_flight
from estimator.measurements.trajectories.task import TrajectoryTask, read_once
from estimator.motion.rigid_body import rotation_matrices

Array = NDArray[np.float64]
NO_TURN = np.array([0.0, 0.0, 0.0, 1.0])
"""The attitude (quaternion) that stands where none was measured."""
FIRST_GUESS = {"x": 1e-3, "theta": 1e-2, "omega": 1.0, "gyro": 1.0}
"""Standard deviations of the first fit (m, rad, rad/s twice), whose residuals tell the noise."""
ROUNDS = 2
"""Of fitting and reading the noise off the residuals in turn."""


def register_trajectories(trajectories: Sequence[Trajectory], *, told: Callable[[str], None] = lambda _: None) -> Registered:
    """A campaign of trajectories; ``told`` is called with the name of each sequence that is done.

    Raises
    ------
    InputError
        Where trajectories of one particle contradict one another, or nothing tells how a body spins that has a gyroscope.
    """
    tasks, flights = [], []
    for trajectory in trajectories:
        task = task_of(trajectory)
        _refuse_a_ball_whose_spin_is_not_read(task)
        tasks.append(task)
        flights.append(first_flight(task, trajectory.surroundings.body))
        told(trajectory.name)
    tasks = _by_one_clock(_in_one_volume(tasks))
    kind = Trajectories(read_once=bool(tasks) and all(read_once(task) for task in tasks))
    campaign = Campaign(tuple(tasks), particles_of(trajectories), (0,) * len(tasks), floor_px=0.0, body_noise_px=0.0, kind=kind)
    campaign = replace(campaign, facts=_stated_lengths(trajectories))
    state = CampaignState(tuple(flights), tuple(np.zeros(0) for _ in flights))
    for improved in (without_spoiled, *(with_noise,) * ROUNDS) if tasks else ():
        fit = base_fit(campaign, state)
        campaign, state = improved(campaign, fit), CampaignState(fit.state.flights, state.theta)
    return Registered(campaign, state, (), ())


def _refuse_a_ball_whose_spin_is_not_read(task: TrajectoryTask) -> None:
    """Refuse a gyroscope without one of its axes on a ball, whose other readings do not depend on that spin: it may be anything."""
    unread = ~np.asarray(task.seen("gyro").any(axis=0))
    if task.gyro is None or not unread.any() or task.measured & {"theta", "omega"} or np.ptp(task.setting.inertia_ratios) > 0.0:
        return
    axes = ", ".join(f"gyro_{axis}" for axis, missing in zip("xyz", unread, strict=True) if missing)
    raise InputError(
        f"{task.name}: expected inertia_ratios of a body whose {axes} is not read in any row, got those of a ball, whose spin about that "
        "axis nothing tells. State them (a thin disc has [0.5, 0.5, 1.0]), or leave out the gyroscope."
    )


def _stated_lengths(trajectories: Sequence[Trajectory]) -> tuple[Fact, ...]:
    """How sure a calibration is of all lengths, where it says so."""
    said = {t.surroundings.sigma_length_scale for t in trajectories}
    if len(said) > 1:
        known = ", ".join("nothing" if each is None else f"{each:g}" for each in sorted(said, key=lambda each: each or 0.0))
        raise InputError(f"{trajectories[0].name}: expected one sigma_length_scale for all trajectories of a campaign, got {known}.")
    return tuple(length_fact(s) for s in said if s is not None)


def _in_one_volume(tasks: Sequence[TrajectoryTask]) -> list[TrajectoryTask]:
    """The sequences with the middle and the size of all their positions in their settings, by the axes that were measured."""
    seen = np.concatenate([np.zeros((0, 3), dtype=np.bool_), *(task.seen("x") for task in tasks)])
    places = np.concatenate([np.zeros((0, 3)), *(task.x_world for task in tasks)])
    along = [places[there, axis] for axis, there in enumerate(seen.T)]
    middle = np.array([each.mean() if len(each) else 0.0 for each in along])
    reach = float(np.sqrt(sum(each.var() for each in along if len(each))))
    return [replace(task, setting=replace(task.setting, middle_world=middle, reach_m=reach or 1.0)) for task in tasks]


def _by_one_clock(tasks: Sequence[TrajectoryTask]) -> list[TrajectoryTask]:
    """The sequences with what their stamps would be off by, were all frames of the campaign taken at even times, in their settings."""
    off = to_even_times([task.times_s for task in tasks])
    return [replace(task, setting=replace(task.setting, scatter_s=each)) for task, each in zip(tasks, off, strict=True)]


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
                f"{each.name}: expected the inertia ratios of particle {name!r} as {other.name} has them, {_ratios(other)}, got {ratios}."
            )
        found.append(numbers.setdefault((name,) if name else ratios, len(numbers)))
    return tuple(found)


def _ratios(trajectory: Trajectory) -> tuple[float, ...]:
    """Inertia ratios to six digits."""
    return tuple(round(float(ratio), 6) for ratio in trajectory.surroundings.body.inertia_ratios)


def _channels(trajectory: Trajectory) -> dict[str, tuple[Array, Array | None]]:
    """What was measured, NaN where it was not, and its standard deviations where they are known; in the order of a task's columns."""
    q = trajectory.q_world_tracked
    every = {
        "x": (trajectory.x_world, trajectory.sigma_x),
        "theta": (None if q is None else q[:, :3], trajectory.sigma_theta),
        "omega": (trajectory.omega_world, trajectory.sigma_omega),
        "gyro": (trajectory.gyro, trajectory.sigma_gyro),
    }
    return {name: (values, sigma) for name, (values, sigma) in every.items() if values is not None}


def task_of(trajectory: Trajectory) -> TrajectoryTask:
    """The task of one trajectory; noise that is not known is a first guess."""
    body, q = trajectory.surroundings.body, trajectory.q_world_tracked
    R, x = None, trajectory.x_world
    if q is not None:
        tracked = rotation_matrices(np.where(np.isnan(q), NO_TURN, q))
        x = x + tracked @ body.com_particle
        x[np.isnan(q).any(axis=1) & body.com_particle.any()] = np.nan
        R = tracked @ body.R_particle_body
    channels = _channels(replace(trajectory, x_world=x))
    sigma = [
        np.where(np.isfinite(values), FIRST_GUESS[name] if known is None else known, np.inf) for name, (values, known) in channels.items()
    ]
    setting = Setting(trajectory.times_s, 0.0, trajectory.surroundings.gravity_world, body.inertia_ratios)
    columns = np.concatenate([np.asarray(each, dtype=np.float64) for each in sigma], axis=1)
    omega, gyro = (None if values is None else np.nan_to_num(values) for values in (trajectory.omega_world, trajectory.gyro))
    repeats, kept = np.ones(columns.shape[1]), np.ones(len(x), dtype=np.bool_)
    stated = frozenset(name for name, (_, known) in channels.items() if known is not None)
    sure = np.full(len(repeats), np.inf)
    return TrajectoryTask(trajectory.name, setting, np.nan_to_num(x), R, omega, columns, repeats, kept, sure, gyro, stated=stated)
