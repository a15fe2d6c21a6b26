"""Noise of outlines: how large, over how many frames it is alike, and which outlines are off as a whole.

Noise is what a pose of its own in every frame leaves: what pushes or turns bodies, or reads their times wrong, is in the poses, whether a
model has it or not. Of each sector in the order of time that is a channel of rows (:mod:`estimator.likelihood.alike_noise`): an
instrument's noise that does not change within a frame, and what the surface misses, come back in the next one.

An outline that is shifted as a whole is no noise of samples: its sectors are all off together, each by little. Tangents tell the worst of
them before there is a surface. About one, samples say where every outline is to a small part of a sample's noise: one that is far from
where those beside it have it, by what outlines of its camera usually are, is not used. A jitter moves all of them, so that none of its
pictures is far off; one picture alone that comes at another time is not known from one that is shifted along the motion.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import sequence_equations
from estimator.fitting.campaigns.registered import Registered
from estimator.geometry.robust_scale import robust_sigma
from estimator.likelihood.alike_noise import channel_noise
from estimator.likelihood.rows import HUBER, noise_scales
from estimator.likelihood.time_shifts import FAR_OFF, NEIGHBOURS, from_neighbours, without_outliers
from estimator.measurements.outlines.task import OutlineResiduals, OutlineTask, outline_residuals
from estimator.motion.flight import Flight

Array = NDArray[np.float64]


def with_frame_noise(sequences: Sequence[OutlineTask], at: Sequence[tuple[Flight, Model, Array]]) -> list[OutlineTask]:
    """Sequences without outlines that are off as a whole, with the noise that the others show.

    ``at``: flight, model and its parameters (q,) of each sequence.
    """
    every = [replace(each, kept=np.ones_like(each.kept)) for each in sequences]
    left = [outline_residuals(each, *here) for each, here in zip(every, at, strict=True)]
    kept = [replace(each, kept=unshifted(each, seen)) for each, seen in zip(every, left, strict=True)]
    return with_noise_beside_poses(kept, [_only(seen, each.kept) for each, seen in zip(kept, left, strict=True)])


def _only(residuals: OutlineResiduals, kept: NDArray[np.bool_]) -> OutlineResiduals:
    """The residuals of outlines that are kept (n,)."""
    return replace(residuals, e=np.where(kept[:, None], residuals.e, 0.0), seen=residuals.seen & kept[:, None])


def unshifted(sequence: OutlineTask, residuals: OutlineResiduals) -> NDArray[np.bool_]:
    """Which outlines (n,) are where those of their camera beside them have them, by how far they are from there along either axis."""
    moved = _shifts(residuals)
    kept = np.ones(len(moved), dtype=np.bool_)
    for rows in sequence.task.sightings.in_time:
        if len(rows) > len(NEIGHBOURS):
            off = from_neighbours(moved[rows])
            kept[rows] = (off <= FAR_OFF * robust_sigma(off)).all(axis=1)
    return kept


def _shifts(residuals: OutlineResiduals) -> Array:
    """By how much outlines are shifted along the axes of their pictures (n, 2), in standard deviations; zero where nothing is seen."""
    by_shift = residuals.met.sequence.contacts.mean_normal * (residuals.seen / np.sqrt(residuals.variance))[..., None]
    A, b = np.einsum("nka,nkb->nab", by_shift, by_shift), np.einsum("nka,nk->na", by_shift, residuals.e)
    inverse = np.linalg.pinv(A, hermitian=True)
    sigma = np.sqrt(np.einsum("naa->na", inverse))
    return np.asarray(np.einsum("nab,nb->na", inverse, b) / np.where(sigma > 0.0, sigma, 1.0))


def with_noise_beside_poses(sequences: Sequence[OutlineTask], residuals: Sequence[OutlineResiduals]) -> list[OutlineTask]:
    """Sequences with the noise that ``residuals`` show beside a pose of its own in every frame: how large, and how alike over frames.

    Its size is each sequence's, its likeness that of all of them together.
    """
    left = [each.noise * beside_poses(e) for each, e in zip(sequences, residuals, strict=True)]
    noise = channel_noise([part for each in zip(sequences, left, residuals, strict=True) for part in _in_time(*each)])
    alike = 1.0 if noise is None else noise.repeats
    scales = [_scale(e, of, alike) for e, of in zip(left, residuals, strict=True)]
    return [replace(each, alike=alike, noise=scale) for each, scale in zip(sequences, scales, strict=True)]


def beside_poses(residuals: OutlineResiduals) -> Array:
    """What is left (n, k) of residuals, in standard deviations, beside the pose that fits each outline best.

    Whatever moves bodies, or reads their times wrong, is in the poses: what is left is noise of outlines, and of their surface.
    """
    weight = residuals.seen / np.sqrt(residuals.variance)
    Q, _ = np.linalg.qr(residuals.met.by_pose * weight[..., None])
    return np.asarray(residuals.e - np.einsum("nkj,nlj,nl->nk", Q, Q, residuals.e))


def _scale(left: Array, residuals: OutlineResiduals, alike: float) -> float:
    """Noise over what outlines show by themselves, from what poses leave (n, k) of ``residuals``."""
    squares = float(np.sum(left**2 / np.maximum(np.abs(left) / HUBER, 1.0)))
    freedom = float(np.sum(np.maximum(residuals.seen.sum(axis=1) - residuals.met.by_pose.shape[2], 0)))
    return float(noise_scales(np.asarray(squares / alike), np.asarray(freedom / alike)))


def whole(registered: Registered) -> list[NDArray[np.bool_]]:
    """Which sightings (n,) of every sequence of a campaign are not off as a whole from where those of their camera are, by tangents."""
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
