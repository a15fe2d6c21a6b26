"""Noise of the rows of trajectories, read off what a fit leaves where nobody states it.

What one effect of the catalogue makes of all sequences is no noise where that is far more probable than noise alone; nor is what the
effects of a fit have explained. So noise is read about free flight first, and again about the effects that are found.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import groupby, product

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from estimator.diagnosis.selection.evidence import BEYOND
from estimator.diagnosis.selection.groups import FACTOR
from estimator.effects.catalogue.clock.dropped_frames import DroppedFrames
from estimator.effects.instrument.slow_errors import CURVES, SlowErrors, curves
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, sequence_equations
from estimator.fitting.stable_inverse import stable_inverse
from estimator.likelihood.alike_noise import (
    AxisRows,
    ChannelNoise,
    axis_rows,
    channel_noise,
    freedom_in,
    less_explained,
    noise_of,
    polynomials,
    surprise,
)
from estimator.likelihood.noise_freedom import noise_freedom
from estimator.likelihood.rows import weighed
from estimator.likelihood.slow_errors import Told, size_of
from estimator.likelihood.spoiled_rows import Path, kept_rows
from estimator.measurements.trajectories.task import TrajectoryTask
from estimator.motion.flight import LAYOUT

Array = NDArray[np.float64]
TOLD = {"x": "positions along", "theta": "turns about", "omega": "spins about", "gyro": "readings of"}
"""Channels in words, before an axis."""
ROUNDING = float(np.finfo(np.float64).eps)
"""Noise (m, rad, rad/s) that is none: rounding of numbers near one."""
WORTH = 2.0 * float(np.log(FACTOR * len(MODELS)))
"""By how much minus twice the log likelihood has to fall for the best of the catalogue's effects to be more than chance (decision 47)."""


@dataclass(frozen=True)
class _Axis:
    """One axis of a channel: ``columns`` of the sequences that have it, by number, and their ``residuals`` in ``rows`` at ``times`` (s).

    ``known``: whether its noise is stated.
    """

    channel: str
    axis: int
    known: bool
    columns: Mapping[int, int]
    residuals: list[Array]
    rows: list[Array]
    times: list[Array]

    @cached_property
    def told(self) -> AxisRows | None:
        """By the residuals, beside polynomials in the number of a row: stamps may be rounded, rows of a tracker are evenly spaced."""
        return axis_rows(self.residuals, self.rows)

    @property
    def noise(self) -> ChannelNoise | None:
        """Of this axis alone."""
        return None if self.told is None else noise_of([self.told], stated=self.known)[0]

    @property
    def surprise(self) -> float:
        """Minus twice the log likelihood of the residuals beside polynomials in time, which effects of the clock are, too."""
        noise = channel_noise(self.residuals, self.times, stated=self.known)
        return 0.0 if noise is None else surprise(self.residuals, self.times, noise)


def without_spoiled(campaign: Campaign, fit: CampaignFit) -> Campaign:
    """The campaign without rows that are far more probably spoiled than noise: of a channel whose noise is stated, than noise so large."""
    tasks: list[TrajectoryTask] = list(campaign.sequences)
    for channel, known in product(TOLD, (False, True)):
        those = [i for i, task in enumerate(tasks) if (channel in task.stated) is known and task.seen(channel).any()]
        paths = [_path(fit, tasks[i], (i, channel), stated=known) for i in those]
        for i, kept in zip(those, kept_rows(paths, FACTOR, 1.0 if known else ROUNDING), strict=True):
            tasks[i] = tasks[i].without(channel, ~kept)
    return replace(campaign, sequences=tuple(tasks))


def _path(fit: CampaignFit, task: TrajectoryTask, at: tuple[int, str], *, stated: bool) -> list[Path]:
    """Residuals of a channel, in standard deviations or, not stated, in their own unit."""
    number, channel = at
    columns, seen = task.columns(channel), task.seen(channel)
    e = fit.equations[number].errors.e[:, columns]
    return Path.of(e if stated else e * np.where(seen, task.sigma[:, columns], 0.0), seen, task.times_s)


def with_noise(campaign: Campaign, fit: CampaignFit) -> Campaign:
    """The campaign with noise estimated from the fit's residuals; where it is stated, only the likeness of neighbouring rows.

    Raises
    ------
    InputError
        Where values whose noise is not stated never differ from a smooth curve.
    """
    tasks: list[TrajectoryTask] = [task.with_noise(1.0) for task in campaign.sequences]
    axes = _less_an_effect(campaign, fit, list(_axes(campaign, fit)))
    noises: list[ChannelNoise | None] = []
    for _, group in groupby(axes, key=lambda each: (each.channel, each.known)):
        noises += _of_one_channel(list(group))
    sure = noise_freedom(_freedom(axes, len(tasks)), np.array([each.known for each in axes], dtype=np.bool_))
    for each, noise, freedom in zip(axes, noises, sure.T, strict=True):
        told = f"{TOLD[each.channel]} {'xyz'[each.axis]}"
        _refuse_without_scatter(None if each.known else noise, [tasks[i].name for i in each.columns], told)
        for (i, k), rows in zip(each.columns.items(), each.rows, strict=True):
            if noise is not None:
                tasks[i] = _replaced(tasks[i], k, None if each.known else noise.sigma, (noise.repeats_in(len(rows)), float(freedom[i])))
    return replace(campaign, sequences=tuple(tasks))


def slow_errors(campaign: Campaign, fit: CampaignFit, before: SlowErrors | None) -> SlowErrors | None:
    """Slow errors that positions have beside a fit; ``None``: they are not far more probable than none, or some positions' noise is stated.

    ``before``: those that the fit has, which are taken off it.
    """
    those = [i for i, task in enumerate(campaign.sequences) if task.seen("x").any()]
    if not those or any("x" in campaign.sequences[i].stated for i in those):
        return None
    slowest = max(float(np.abs(curves(campaign.sequences[i].times_s)).max()) for i in those)
    told = [_told_of_curves(campaign, fit, i, before) for i in those]
    sizes, gain = np.zeros(3), 0.0
    for axis in range(3):
        sigma = [s[np.isfinite(s)][0] for i in those if np.isfinite(s := campaign.sequences[i].sigma[:, axis]).any()]
        if sigma:
            sizes[axis], more = size_of([each[axis] for each in told], float(np.median(sigma)) / slowest)
            gain += more
    return SlowErrors(sizes) if gain > np.log(FACTOR) else None


def _told_of_curves(campaign: Campaign, fit: CampaignFit, number: int, before: SlowErrors | None) -> list[Told]:
    """What a sequence says of the amplitudes of curves along each axis, beside all else that it has for itself."""
    task, at, errors = campaign.sequences[number], fit.equations[number], fit.equations[number].errors
    p, inner = errors.J.shape[2], slice(0, 0) if before is None else fit.model.slices[fit.model.effects.index(before)]
    known = LAYOUT.size + np.arange(inner.start, inner.stop)
    local = np.setdiff1d(fit.layout.local, known)
    made, positions = np.zeros((*errors.e.shape, 3 * CURVES)), task.columns("x")
    weight = np.where(errors.seen, 1.0 / task.sigma, 0.0)[:, positions, None]
    made[:, positions] = weight * SlowErrors(np.ones(3)).tracked_by(np.zeros(3 * CURVES), task.x_world, task.setting)
    frames = weighed(replace(errors, J=np.concatenate([errors.J, made], axis=2)), task.repeats)
    back = frames.H[p:, local] @ stable_inverse(at.H[np.ix_(local, local)])
    information = frames.H[p:, p:] - back @ frames.H[local, p:]
    taken = fit.state.theta[number][inner]
    pull = back @ (at.g[local] - at.H[np.ix_(local, known)] @ taken) - (frames.g[p:] - frames.H[p:, known] @ taken)
    rows = np.arange(3 * CURVES).reshape(3, CURVES)
    return [Told.of(information[np.ix_(r, r)], pull[r], float(np.diag(frames.H)[p:][r].max())) for r in rows]


def _of_one_channel(axes: list[_Axis]) -> list[ChannelNoise | None]:
    """Noise of the axes of one channel, which is as alike in all of them; ``None`` where polynomials leave nothing."""
    each = iter(noise_of([axis.told for axis in axes if axis.told is not None], stated=axes[0].known))
    return [None if axis.told is None else next(each) for axis in axes]


def _freedom(axes: list[_Axis], sequences: int) -> Array:
    """Degrees of freedom (s, a) of what sequences have along axes."""
    freedom = np.zeros((sequences, len(axes)))
    for a, axis in enumerate(axes):
        for i, rows in zip(axis.columns, axis.rows, strict=True):
            freedom[i, a] = freedom_in(len(rows))
    return freedom


def _axes(campaign: Campaign, fit: CampaignFit) -> Iterator[_Axis]:
    """Every axis that was measured."""
    tasks = campaign.sequences
    for channel, known, axis in product(TOLD, (False, True), range(3)):
        rows = [i for i, task in enumerate(tasks) if (channel in task.stated) is known and task.seen(channel)[:, axis].any()]
        if rows:
            columns = {i: tasks[i].columns(channel).start + axis for i in rows}
            residuals = [_residuals(fit, tasks[i], (i, k), stated=known) for i, k in columns.items()]
            seen = [np.flatnonzero(np.isfinite(tasks[i].sigma[:, k])) for i, k in columns.items()]
            times = [tasks[i].times_s[each] for i, each in zip(columns, seen, strict=True)]
            yield _Axis(channel, axis, known, columns, residuals, [each.astype(np.float64) for each in seen], times)


def _less_an_effect(campaign: Campaign, fit: CampaignFit, axes: list[_Axis]) -> list[_Axis]:
    """The axes whose noise is not known, less what the one effect of the catalogue explains that is worth it most; as they are else."""
    free = [each for each in axes if not each.known]
    noise = [each.noise for each in free]
    if not free or any(each is None for each in noise):
        return axes
    scales = [max(each.sigma, ROUNDING) for each in noise if each is not None]
    model = Model((*fit.model.effects, *_shared_effects(campaign, fit.model.keys)))
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
    less, spent = _less_gaps(campaign, fit, free, scales)
    best = less if sum(each.surprise for each in less) + spent < least else best
    return [*(each for each in axes if each.known), *best]


def _less_gaps(campaign: Campaign, fit: CampaignFit, axes: list[_Axis], scales: list[float]) -> tuple[list[_Axis], float]:
    """The axes less whole numbers of frames that are missing once in a sequence, where they explain most, and what they cost.

    Frames that were lost and not counted are no smooth motion: as noise they would hide all else, and be told as drag.
    """
    gap, spent = DroppedFrames(), 0.0
    if gap.entry.key in fit.model.keys or campaign.kind.why_not(campaign, gap) is not None:
        return axes, np.inf
    model, residuals = Model((*fit.model.effects, gap)), [list(axis.residuals) for axis in axes]
    price = float(np.log(sum(len(r) for axis in axes for r in axis.residuals)))
    late = tuple(np.concatenate([theta, [0.0, -1.0]]) for theta in fit.state.theta)  # a gap before all rows
    for i, task in enumerate(campaign.sequences):
        frames = gap.starts(task.setting)[:, 1]
        here = [(a, list(axis.columns).index(i)) for a, axis in enumerate(axes) if i in axis.columns]
        if not len(frames) or not here:
            continue
        moves = sequence_equations(campaign, i, CampaignState(fit.state.flights, late), model).errors.J[:, :, -2]
        after = task.times_s[:, None] > task.setting.times_s[0] + (frames + 0.5) * task.setting.interval_s
        made = [_of_rows(task, axes[a].columns[i], moves, after) for a, _ in here]
        place, count = _likeliest_gap(
            [(axes[a].residuals[k] / scales[a], m / scales[a], axes[a].times[k]) for (a, k), m in zip(here, made, strict=True)]
        )
        if count:
            spent += price + 2.0 * float(np.log(len(frames)))
            for (a, k), m in zip(here, made, strict=True):
                residuals[a][k] = residuals[a][k] + count * m[:, place]
    return [replace(axis, residuals=each) for axis, each in zip(axes, residuals, strict=True)], spent


def _of_rows(task: TrajectoryTask, column: int, moves: Array, after: NDArray[np.bool_]) -> Array:
    """What a frame that is lost makes of the rows that were seen in a column, (n, k) for ``k`` places of it."""
    seen = np.isfinite(task.sigma[:, column])
    return np.asarray((moves[seen, column] * task.sigma[seen, column])[:, None] * after[seen])


def _likeliest_gap(axes: Sequence[tuple[Array, Array, Array]]) -> tuple[int, float]:
    """Where most is explained beside polynomials, and by how many frames: 0 where none of them is missing.

    Of each axis residuals (n,), what one lost frame adds to them at each place, (n, k), and times (n,) s.
    """
    slope, size = np.zeros((2, axes[0][1].shape[1]))
    for r, made, times_s in axes:
        span = max(float(np.ptp(times_s)), ROUNDING)
        Q, _ = np.linalg.qr(polynomials(2.0 * (times_s - times_s[0]) / span - 1.0))
        bent = made - Q @ (Q.T @ made)
        slope -= bent.T @ r
        size += np.sum(bent**2, axis=0)
    count = np.clip(np.rint(slope / np.maximum(size, ROUNDING)), 0.0, DroppedFrames.entry.parameters[0].plausible[1])
    place = int(np.argmax(2.0 * count * slope - count**2 * size))
    return place, float(count[place])


def _refuse_without_scatter(noise: ChannelNoise | None, names: Sequence[str], what: str) -> None:
    """Refuse values that never differ from a smooth curve: an axis that was written though nobody measured it, or made data."""
    if noise is not None and noise.sigma <= ROUNDING:
        raise InputError(
            f"{names[0]}: expected {what} to scatter from row to row, got values without noise in {len(names)} trajectories. Leave cells "
            "of what was not measured empty; of made data state the noise (sigma_x_m, sigma_theta_rad, ...)."
        )


def _shared_effects(campaign: Campaign, there: Sequence[str]) -> list[EffectModel]:
    """Effects with values that all sequences share, which are on trial beside those that are ``there`` and act from zero on."""
    told = [
        campaign.kind.adapted(effect)
        for key, effect in MODELS.items()
        if key not in there and campaign.kind.why_not(campaign, effect) is None
    ]
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
    """Residuals of the rows of a sequence that were measured in a column, in their standard deviations or, not stated, in their unit."""
    number, column = at
    seen = np.isfinite(task.sigma[:, column])
    e = fit.equations[number].errors.e[seen, column]
    return np.asarray(e * (task.noise if stated else task.sigma[seen, column]))


def _replaced(task: TrajectoryTask, column: int, sigma: float | None, like: tuple[float, float]) -> TrajectoryTask:
    new_sigma, new_repeats, new_freedom = task.sigma.copy(), task.repeats.copy(), task.freedom.copy()
    new_repeats[column], new_freedom[column] = like
    if sigma is not None:
        new_sigma[np.isfinite(task.sigma[:, column]), column] = sigma
    return replace(task, sigma=new_sigma, repeats=new_repeats, freedom=new_freedom)
