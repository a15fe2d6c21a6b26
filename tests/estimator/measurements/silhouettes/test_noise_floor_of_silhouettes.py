"""The noise floor tells noise, smooth errors and jumping frames apart."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.noise_floor import NoiseFloor, noise_floor
from estimator.fitting.campaigns.campaign import CampaignFit
from tests.estimator.small_campaign import fitted, registered
from tumble.reports.noise_floor_words import floor_sentence

Array = NDArray[np.float64]


def with_errors(change: Callable[[Array, Array], Array]) -> CampaignFit:
    """The fit with errors ``e`` changed; ``change`` gets them and the frames' numbers (n, 1, 1)."""
    fit = fitted()
    equations = []
    for sequence, each in zip(registered().campaign.sequences, fit.equations, strict=True):
        frame = sequence.task.sightings.frame[:, None, None].astype(np.float64)
        seen = each.errors.tangency.valid[:, :, None]
        equations.append(replace(each, errors=replace(each.errors, e=np.where(seen, change(each.errors.e, frame), 0.0))))
    return replace(fit, equations=tuple(equations))


def judged(fit: CampaignFit) -> NoiseFloor:
    return noise_floor(registered().campaign, fit, np.random.default_rng(1))


def test_noise_alone_leaves_nothing_to_explain() -> None:
    floor = judged(fitted())
    assert not floor.explainable(1.0, 0.01)
    assert floor.interval[0] < floor.reduced < floor.interval[1]
    assert floor.excess_px < 0.05
    assert "nothing to explain" in floor_sentence(floor, "px", (1.0, 0.01))


def test_white_errors_have_a_reduced_chi_square_of_one() -> None:
    rng = np.random.default_rng(2)
    floor = judged(with_errors(lambda e, frame: rng.normal(0.0, 0.1, e.shape)))
    assert floor.interval[0] < 1.0 < floor.interval[1]
    assert abs(floor.repeated_px - 0.1) < 0.005
    assert np.all(np.abs(floor.autocorrelation) < 0.1)


def test_a_smooth_error_is_found_with_its_size() -> None:
    floor = judged(with_errors(lambda e, frame: e + 0.3 * np.sin(frame / 8.0)))
    assert floor.explainable(1.0, 0.01)
    assert abs(floor.excess_px - 0.3 * np.sqrt(0.5)) < 0.08
    assert floor.autocorrelation[0] > 0.5
    assert "alike in neighbouring frames" in floor_sentence(floor, "px", (1.0, 0.01))


def test_frames_that_jump_are_told_from_smooth_errors() -> None:
    jumps = np.random.default_rng(3).normal(0.0, 0.3, 1000)
    floor = judged(with_errors(lambda e, frame: e + jumps[frame.astype(int)]))
    assert floor.jumps
    assert floor.floor_px < floor.repeated_px
    assert "trigger that jitters" in floor_sentence(floor, "px", (1.0, 0.01))


def test_a_pattern_that_an_effect_fits_counts_however_small() -> None:
    floor = judged(fitted())
    assert floor.explainable(1e-9, 0.01)
    assert "pattern is not that of noise" in floor_sentence(floor, "px", (1e-9, 0.01))
