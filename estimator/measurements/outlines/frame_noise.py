"""Noise of outlines from frame to frame: over how many it is alike, and which outlines are off as a whole.

Both as of other measurements. What a free flight leaves of each sector in the order of time is a channel of rows
(:mod:`estimator.likelihood.alike_noise`): an instrument's noise that does not change within a frame, and what the surface misses, come back
in the next one. An outline that is shifted as a whole is no noise of samples: its sectors are all off together, each by little.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import sequence_equations
from estimator.fitting.campaigns.registered import Registered
from estimator.likelihood.alike_noise import channel_noise
from estimator.likelihood.rows import HUBER, noise_scales
from estimator.likelihood.time_shifts import without_outliers
from estimator.measurements.outlines.task import OutlineResiduals, OutlineTask

Array = NDArray[np.float64]
POSE, SEEN = 6, 1e-6
"""Numbers of a pose, and singular value, of directions of length one, from which on outlines show one."""


def with_frame_noise(sequences: Sequence[OutlineTask], residuals: Sequence[OutlineResiduals]) -> list[OutlineTask]:
    """Sequences with the noise that ``residuals`` show beside a pose of its own in every frame: how large, and how alike over frames.

    Its size is each sequence's, its likeness that of all of them together.
    """
    left = [each.noise * beside_poses(e) for each, e in zip(sequences, residuals, strict=True)]
    noise = channel_noise([part for each in zip(sequences, left, residuals, strict=True) for part in _in_time(*each)])
    alike = 1.0 if noise is None else noise.repeats
    scales = [_scale(e, of.seen, alike) for e, of in zip(left, residuals, strict=True)]
    return [replace(each, alike=alike, noise=scale) for each, scale in zip(sequences, scales, strict=True)]


def beside_poses(residuals: OutlineResiduals) -> Array:
    """What is left (n, k) of residuals, in standard deviations, beside the pose that fits each outline best.

    Whatever moves bodies, or reads their times wrong, is in the poses: what is left is noise of outlines, and of their surface.
    """
    weight = residuals.seen / np.sqrt(residuals.variance)
    by_pose = residuals.met.by_pose * weight[..., None]
    by_pose /= np.maximum(np.linalg.norm(by_pose, axis=1, keepdims=True), 1e-300)
    U, size, _ = np.linalg.svd(by_pose, full_matrices=False)
    U = U * (size > SEEN)[:, None, :]
    return np.asarray(residuals.e - np.einsum("nkj,nlj,nl->nk", U, U, residuals.e))


def _scale(left: Array, seen: NDArray[np.bool_], alike: float) -> float:
    """Noise over what outlines show by themselves, from what poses leave (n, k) of the sectors that were ``seen`` (n, k)."""
    far = np.abs(left) / HUBER
    squares = float(np.sum(left**2 / np.maximum(far, 1.0)))
    freedom = float(np.sum(np.maximum(seen.sum(axis=1) - POSE, 0)))
    return float(noise_scales(np.asarray(squares / alike), np.asarray(freedom / alike)))


def whole(registered: Registered) -> list[NDArray[np.bool_]]:
    """Which sightings (n,) of every sequence of a campaign of tangents are not off as a whole from where those of their camera are."""
    return [_whole(registered, number) for number in range(len(registered.campaign.sequences))]


def _whole(registered: Registered, number: int) -> NDArray[np.bool_]:
    campaign = registered.campaign
    shifts = campaign.kind.time_shifts(campaign, number, sequence_equations(campaign, number, registered.start, Model()))
    sightings = campaign.sequences[number].task.sightings
    kept = np.ones(len(sightings), dtype=np.bool_)
    for rows, mine in zip(sightings.in_time, shifts, strict=True):
        kept[rows] = (mine.noise <= 0.0) | (without_outliers(mine).noise > 0.0)
    return kept


def _in_time(sequence: OutlineTask, left: Array, residuals: OutlineResiduals) -> Iterator[Array]:
    """What is ``left`` (n, k) of each sector of each camera's outlines, in the order of time, where it was seen."""
    for rows in sequence.task.sightings.in_time:
        for e, seen in zip(left[rows].T, residuals.seen[rows].T, strict=True):
            yield e[seen]
