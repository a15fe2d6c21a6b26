"""From measured trajectories to a campaign: tasks, the flights that fits start from, and the noise where nobody states it."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.trajectory import Trajectory
from estimator.diagnosis.selection.evidence import BEYOND
from estimator.diagnosis.selection.groups import FACTOR
from estimator.effects.link import EffectModel, Setting
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, sequence_equations
from estimator.fitting.campaigns.facts import Fact, length_fact
from estimator.fitting.campaigns.registered import Registered
from estimator.likelihood.alike_noise import ChannelNoise, channel_noise, less_explained, surprise
from estimator.measurements.trajectories.kind import Trajectories
from estimator.measurements.trajectories.starting import first_flight
from estimator.measurements.trajectories.task import TrajectoryTask, read_once
from estimator.motion.rigid_body import rotation_matrices

Array = NDArray[np.float64]
NO_TURN = np.array([0.0, 0.0, 0.0, 1.0])
"""The attitude (quaternion) that stands where none was measured."""
FIRST_GUESS = {"x": 1e-3, "theta": 1e-2, "omega": 1.0, "gyro": 1.0}
"""Standard deviations of the first fit (m, rad, rad/s twice), whose residuals tell the noise."""
TOLD = {"x": "positions along", "theta": "turns about", "omega": "spins about", "gyro": "readings of"}
"""Channels in words, before an axis."""
ROUNDING = float(np.finfo(np.float64).eps)
"""Noise (m, rad, rad/s) that is none: rounding of numbers near one."""
WORTH = 2.0 * float(np.log(FACTOR * len(MODELS)))
"""By how much minus twice the log likelihood has to fall for the best of the catalogue's effects to be more than chance (decision 47)."""
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
    tasks = _in_one_volume(tasks)
    kind = Trajectories(read_once=bool(tasks) and all(read_once(task) for task in tasks))
    campaign = Campaign(tuple(tasks), particles_of(trajectories), (0,) * len(tasks), floor_px=0.0, body_noise_px=0.0, kind=kind)
    campaign = replace(campaign, facts=_stated_lengths(trajectories))
    state = CampaignState(tuple(flights), tuple(np.zeros(0) for _ in flights))
    stated = [_stated(t) for t in trajectories]
    if tasks:
        for _ in range(ROUNDS):
            fit = base_fit(campaign, state)
            campaign, state = replace(campaign, sequences=_with_noise(campaign, fit, stated)), CampaignState(fit.state.flights, state.theta)
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
    """The sequences with the middle and the size of all their positions in their settings."""
    places = np.concatenate([np.zeros((0, 3)), *(task.x_world[task.seen("x").all(axis=1)] for task in tasks)])
    middle = places.mean(axis=0) if len(places) else np.zeros(3)
    reach = float(np.sqrt(np.mean(np.sum((places - middle) ** 2, axis=1)))) if len(places) > 1 else 0.0
    return [replace(task, setting=replace(task.setting, middle_world=middle, reach_m=reach or 1.0)) for task in tasks]


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


def _stated(trajectory: Trajectory) -> dict[str, bool]:
    """Of which channels the noise is known, or nothing was measured."""
    return {name: sigma is not None or not np.isfinite(values).any() for name, (values, sigma) in _channels(trajectory).items()}


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
    return TrajectoryTask(trajectory.name, setting, np.nan_to_num(x), R, omega, columns, repeats, kept, gyro)


@dataclass(frozen=True)
class _Axis:
    """One axis of a channel: ``columns`` of the sequences that have it, by number, and their ``residuals`` at ``times`` (s).

    ``known``: whether its noise is stated.
    """

    channel: str
    axis: int
    known: bool
    columns: Mapping[int, int]
    residuals: list[Array]
    times: list[Array]

    @cached_property
    def noise(self) -> ChannelNoise | None:
        """Of the residuals, beside polynomials in the number of a row: stamps may be rounded, rows of a tracker are evenly spaced."""
        return channel_noise(self.residuals, stated=self.known)

    @property
    def surprise(self) -> float:
        """Minus twice the log likelihood of the residuals beside polynomials in time, which effects of the clock are, too."""
        noise = channel_noise(self.residuals, self.times, stated=self.known)
        return 0.0 if noise is None else surprise(self.residuals, self.times, noise)


def _with_noise(campaign: Campaign, fit: CampaignFit, stated: Sequence[dict[str, bool]]) -> tuple[TrajectoryTask, ...]:
    """The sequences with noise estimated from the fit's residuals; where it is stated, only the likeness of neighbouring rows.

    What one effect of the catalogue makes of all sequences is no noise where that is far more probable than noise alone.
    """
    tasks: list[TrajectoryTask] = list(campaign.sequences)
    axes = _less_an_effect(campaign, fit, list(_axes(fit, tasks, stated)))
    for each in axes:
        noise = each.noise
        told = f"{TOLD[each.channel]} {'xyz'[each.axis]}"
        _refuse_without_scatter(None if each.known else noise, [tasks[i].name for i in each.columns], told)
        for i, k in each.columns.items():
            if noise is not None:
                tasks[i] = _replaced(tasks[i], k, None if each.known else noise.sigma, noise.repeats)
    return tuple(tasks)


def _axes(fit: CampaignFit, tasks: Sequence[TrajectoryTask], stated: Sequence[dict[str, bool]]) -> Iterator[_Axis]:
    """Every axis that was measured."""
    for channel, known, axis in product(FIRST_GUESS, (False, True), range(3)):
        rows = [i for i, s in enumerate(stated) if s.get(channel) is known]
        columns = {i: tasks[i].columns(channel).start + axis for i in rows if tasks[i].seen(channel)[:, axis].any()}
        if columns:
            residuals = [_residuals(fit, tasks[i], (i, k), stated=known) for i, k in columns.items()]
            times = [tasks[i].times_s[np.isfinite(tasks[i].sigma[:, k])] for i, k in columns.items()]
            yield _Axis(channel, axis, known, columns, residuals, times)


def _less_an_effect(campaign: Campaign, fit: CampaignFit, axes: list[_Axis]) -> list[_Axis]:
    """The axes whose noise is not known, less what the one effect of the catalogue explains that is worth it most; as they are else."""
    free = [each for each in axes if not each.known]
    noise = [each.noise for each in free]
    if not free or any(each is None for each in noise):
        return axes
    scales = [max(each.sigma, ROUNDING) for each in noise if each is not None]
    model = Model((*fit.model.effects, *_shared_effects(campaign)))
    theta = tuple(np.concatenate([values, np.zeros(model.size - fit.model.size)]) for values in fit.state.theta)
    at = CampaignState(fit.state.flights, theta)
    J = [sequence_equations(campaign, i, at, model).errors.J for i in range(len(campaign.sequences))]
    least, best = sum(each.surprise for each in free) - WORTH, free
    for effect in model.effects[len(fit.model.effects) :]:
        columns = model.layout.columns([effect.entry.key])
        less = _explained(campaign, free, scales, [j[:, :, columns] for j in J], effect)
        if less is None:
            continue
        spent = len(columns) * float(np.log(sum(len(r) for each in free for r in each.residuals)))
        value = sum(each.surprise for each in less) + spent
        if value < least:
            least, best = value, less
    return [*(each for each in axes if each.known), *best]


def _refuse_without_scatter(noise: ChannelNoise | None, names: Sequence[str], what: str) -> None:
    """Refuse values that never differ from a smooth curve: an axis that was written though nobody measured it, or made data."""
    if noise is not None and noise.sigma <= ROUNDING:
        raise InputError(
            f"{names[0]}: expected {what} to scatter from row to row, got values without noise in {len(names)} trajectories. Leave cells "
            "of what was not measured empty; of made data state the noise (sigma_x_m, sigma_theta_rad, ...)."
        )


def _shared_effects(campaign: Campaign) -> list[EffectModel]:
    """Effects with values that all sequences share, which are on trial in such a campaign and act from zero on."""
    told = [campaign.kind.adapted(effect) for effect in MODELS.values() if campaign.kind.why_not(campaign, effect) is None]
    shared = [each for each in told if not (each.random or each.noise or each.entry.scope.own)]
    starts = [each.starts(campaign.sequences[0].setting) for each in shared]
    return [each for each, start in zip(shared, starts, strict=True) if len(start) == 1 and not start.any()]


def _explained(campaign: Campaign, axes: list[_Axis], scales: list[float], J: Sequence[Array], effect: EffectModel) -> list[_Axis] | None:
    """Axes with noise of such ``scales`` less what an effect of derivatives ``J`` (n, c, k) explains; ``None``: nothing plausible."""
    residuals, signatures = [], []
    for axis, scale in zip(axes, scales, strict=True):
        for (i, k), r in zip(axis.columns.items(), axis.residuals, strict=True):
            sigma = campaign.sequences[i].sigma[:, k]
            seen = np.isfinite(sigma)
            residuals.append(r / scale)
            signatures.append(J[i][seen, k] * sigma[seen, None] / scale)
    left, amplitudes = less_explained(residuals, [t for axis in axes for t in axis.times], signatures)
    largest = np.array([BEYOND * max(map(abs, p.plausible)) for p in effect.entry.parameters])
    if not amplitudes.any() or (np.abs(amplitudes) > largest).any():
        return None
    each = iter(left)
    return [replace(axis, residuals=[next(each) * scale for _ in axis.residuals]) for axis, scale in zip(axes, scales, strict=True)]


def _residuals(fit: CampaignFit, task: TrajectoryTask, at: tuple[int, int], *, stated: bool) -> Array:
    """Residuals of the rows of a sequence that were measured in a column, in standard deviations or, not stated, in their own unit."""
    number, column = at
    seen = np.isfinite(task.sigma[:, column])
    e = fit.equations[number].errors.e[seen, column]
    return np.asarray(e if stated else e * task.sigma[seen, column])


def _replaced(task: TrajectoryTask, column: int, sigma: float | None, repeats: float) -> TrajectoryTask:
    new_sigma, new_repeats = task.sigma.copy(), task.repeats.copy()
    new_repeats[column] = repeats
    if sigma is not None:
        new_sigma[np.isfinite(task.sigma[:, column]), column] = sigma
    return replace(task, sigma=new_sigma, repeats=new_repeats)
