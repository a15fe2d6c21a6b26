"""Noise of outlines from frame to frame: over how many it is alike, and which outlines are off as a whole.

What a flight leaves of each sector in the order of time is a channel of rows (:mod:`estimator.likelihood.alike_noise`): an instrument's
noise that does not change within a frame, and what the surface misses, come back in the next one. An outline that is shifted as a whole is
no noise of samples: its sectors are all off together, each by little. Tangents tell the worst of them before there is a surface. About one,
samples say where every outline is to a small part of a sample's noise: one that is far from where those beside it have it, by what outlines
of its camera usually are, is not used. A jitter moves all of them, so that none of its pictures is far off; one picture alone that comes at
another time is not known from one that is shifted along the motion.
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
from estimator.likelihood.time_shifts import FAR_OFF, NEIGHBOURS, from_neighbours, without_outliers
from estimator.measurements.outlines.task import OutlineResiduals, OutlineTask, outline_residuals
from estimator.motion.flight import Flight

Array = NDArray[np.float64]


def with_frame_noise(sequences: Sequence[OutlineTask], at: Sequence[tuple[Flight, Model, Array]]) -> list[OutlineTask]:
    """Sequences without outlines that are off as a whole, their noise as alike as it is.

    ``at``: flight, model and its parameters (q,) of each sequence.
    """
    every = [replace(each, kept=np.ones_like(each.kept)) for each in sequences]
    left = [outline_residuals(each, *here) for each, here in zip(every, at, strict=True)]
    kept = [replace(each, kept=unshifted(each, seen)) for each, seen in zip(every, left, strict=True)]
    return with_alike_noise(kept, [replace(seen, seen=seen.seen & each.kept[:, None]) for each, seen in zip(kept, left, strict=True)])


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


def with_alike_noise(sequences: Sequence[OutlineTask], residuals: Sequence[OutlineResiduals]) -> list[OutlineTask]:
    """Sequences whose noise is as alike from frame to frame as ``residuals`` show, in all of them together."""
    noise = channel_noise([part for each in zip(sequences, residuals, strict=True) for part in _in_time(*each)])
    return [replace(each, alike=1.0 if noise is None else noise.repeats) for each in sequences]


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


def _in_time(sequence: OutlineTask, residuals: OutlineResiduals) -> Iterator[Array]:
    """What is left of each sector of each camera's outlines, in the order of time, where it was seen."""
    for rows in sequence.task.sightings.in_time:
        for e, seen in zip(residuals.e[rows].T, residuals.seen[rows].T, strict=True):
            yield e[seen]
