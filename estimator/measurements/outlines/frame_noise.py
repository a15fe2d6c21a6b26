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
from estimator.likelihood.time_shifts import without_outliers
from estimator.measurements.outlines.task import OutlineResiduals, OutlineTask

Array = NDArray[np.float64]


def with_alike_noise(sequences: Sequence[OutlineTask], residuals: Sequence[OutlineResiduals]) -> list[OutlineTask]:
    """Sequences whose noise is as alike from frame to frame as ``residuals`` show, in all of them together."""
    noise = channel_noise([part for each in zip(sequences, residuals, strict=True) for part in _in_time(*each)])
    return [replace(each, alike=1.0 if noise is None else noise.repeats) for each in sequences]


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


def _in_time(sequence: OutlineTask, residuals: OutlineResiduals) -> Iterator[Array]:
    """What is left of each sector of each camera's outlines, in the order of time, where it was seen."""
    for rows in sequence.task.sightings.in_time:
        for e, seen in zip(residuals.e[rows].T, residuals.seen[rows].T, strict=True):
            yield e[seen]
