"""Noise of outlines from frame to frame: how alike it is, and outlines that are off as a whole."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.measurements.outlines.frame_noise import whole, with_alike_noise
from estimator.measurements.outlines.task import OutlineResiduals, OutlineTask, outline_errors
from tests.estimator import small_campaign
from tests.estimator.measurements.outlines import sampled_campaign

Array = NDArray[np.float64]
OFF_PX = 1.5


def residuals(number: int) -> OutlineResiduals:
    return sampled_campaign.fitted().equations[number].errors


@pytest.mark.parametrize("frames", [1, 2])
def test_noise_is_as_alike_as_it_was_drawn(frames: int) -> None:
    rng, tasks = np.random.default_rng(4), sampled_campaign.registered().campaign.sequences
    drawn = [
        np.sum([wide[k : k + len(task.task.sightings)] for k in range(frames)], axis=0) / np.sqrt(frames)
        for task, wide in _noise(tasks, rng)
    ]
    left = [replace(residuals(i), e=e) for i, e in enumerate(drawn)]
    made = with_alike_noise(tasks, left)
    assert [each.alike for each in made] == pytest.approx([frames] * len(tasks), rel=0.2)
    assert made[0].repeats == pytest.approx(np.full(len(made[0].repeats), made[0].alike))


def _noise(tasks: tuple[OutlineTask, ...], rng: np.random.Generator) -> list[tuple[OutlineTask, Array]]:
    return [(task, rng.normal(size=(len(task.task.sightings) + 3, len(task.repeats)))) for task in tasks]


def test_noise_that_is_alike_says_less() -> None:
    """The variance of a flight is as many times as large as noise is alike over frames."""
    campaign, fit = sampled_campaign.registered().campaign, sampled_campaign.fitted()
    task, flight, theta = campaign.sequences[0], fit.state.flights[0], fit.state.theta[0]
    errors = outline_errors(task, flight, fit.model, theta)
    said = [campaign.kind.equations(replace(campaign, sequences=(each,)), 0, errors, fit.model, theta).frames.H for each in _alike(task)]
    assert said[0] == pytest.approx(3.0 * said[1])


def _alike(task: OutlineTask) -> tuple[OutlineTask, OutlineTask]:
    return replace(task, alike=1.0), replace(task, alike=3.0)


def test_an_outline_off_as_a_whole_is_not_used() -> None:
    registered, number = small_campaign.registered(), 11
    first = registered.campaign.sequences[0]
    silhouettes = first.task.sightings.silhouettes
    xy = silhouettes.xy.copy()
    xy[silhouettes.slice_of(number)] += [OFF_PX, -OFF_PX] / silhouettes.focal_px[number]
    sightings = replace(first.task.sightings, silhouettes=replace(silhouettes, xy=xy))
    shifted = replace(first, task=replace(first.task, sightings=sightings))
    campaign = replace(registered.campaign, sequences=(shifted, *registered.campaign.sequences[1:]))
    kept = [np.flatnonzero(~each).tolist() for each in whole(replace(registered, campaign=campaign))]
    assert kept == [[number], []]
    assert [each.all() for each in whole(registered)] == [True, True]
