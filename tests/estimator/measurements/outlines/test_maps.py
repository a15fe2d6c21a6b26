"""Maps of sample residuals show planted misfits where they are and nothing in noise; their floor is noise that is new in every frame."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.diagnosis.noise_floor import NoiseFloor, noise_floor
from estimator.diagnosis.residual_maps import ResidualMap, residual_maps
from estimator.fitting.campaigns.campaign import CampaignFit, SequenceEquations
from estimator.measurements.silhouettes.map_axes import outline_axes
from tests.estimator.measurements.outlines.sampled_campaign import fitted, registered
from tumble.reports.map_words import sentence_of, title_of
from tumble.reports.noise_floor_words import floor_sentence

Array = NDArray[np.float64]
Change = Callable[[SequenceEquations], Array]
"""Errors in pixels, or what broadcasts to (n, k), of one sequence."""


def planted(change: Change, seed: int = 4) -> CampaignFit:
    """White noise of the size that is stated, and a planted error."""
    rng, equations = np.random.default_rng(seed), []
    for each in fitted().equations:
        errors = each.errors
        e = rng.standard_normal(errors.e.shape) + change(each) / np.sqrt(errors.variance)
        equations.append(replace(each, errors=replace(errors, e=np.where(errors.seen, e, 0.0))))
    return replace(fitted(), equations=tuple(equations))


def nothing(each: SequenceEquations) -> Array:
    return np.zeros(each.errors.e.shape)


def maps_of(change: Change, seed: int = 4) -> dict[tuple[str, str], ResidualMap]:
    return {(m.axis.name, m.kind): m for m in residual_maps(registered().campaign, planted(change, seed))}


def floor_of(fit: CampaignFit) -> NoiseFloor:
    return noise_floor(registered().campaign, fit, np.random.default_rng(1))


def test_noise_shows_nothing() -> None:
    """Also where bins hold few frames: of forty campaigns of noise none has a map that shows something."""
    found = [residual_maps(registered().campaign, planted(nothing, seed)) for seed in range(40)]
    assert [title_of(m) for maps in found for m in maps if m.significant] == []
    assert {m.axis.name for m in found[0]} == {"time", "place", "radius", "outline_direction", "body_direction", "speed", "spin_phase"}
    assert {m.unit for m in found[0]} == {"px"}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("place", "px of the picture"),
        ("radius", "px from the principal point"),
        ("outline_direction", "where they face"),
        ("body_direction", "on the particle's side at longitude"),
        ("speed", "at speeds of"),
    ],
)
def test_outlines_that_are_too_large_somewhere(name: str, words: str) -> None:
    fit, size_px = fitted(), 0.4
    axis = next(each for each in outline_axes(registered().campaign, fit).axes if each.name == name)
    wanted = int(np.argmax(np.bincount(axis.bin)))
    counts = [int(each.errors.seen.sum()) for each in fit.equations]
    larger = iter(np.split(np.where(axis.bin == wanted, size_px, 0.0), np.cumsum(counts)[:-1]))

    def somewhere(each: SequenceEquations) -> Array:
        e = np.zeros(each.errors.e.shape)
        e[each.errors.seen] = next(larger)
        return e

    best = maps_of(somewhere)[name, "offset"]
    assert best.significant
    top = int(np.argmax(best.mean_px))
    assert best.bins[top] == wanted
    assert abs(best.mean_px[top] - size_px) < 4.0 * best.sigma_px[top]
    assert "larger than the model's" in sentence_of(best)
    assert words in sentence_of(best)


def test_outlines_that_are_displaced_late() -> None:
    def late(each: SequenceEquations) -> Array:
        n = len(each.errors.e)
        return np.where(np.arange(n)[:, None] >= n // 2, 0.2 * each.errors.places.normal[:, :, 0, 1], 0.0)

    found = maps_of(late)
    time = found["time", "along_y"]
    assert time.significant
    assert np.allclose(time.mean_px[-4:], 0.2, atol=0.04)
    assert np.allclose(time.mean_px[:4], 0.0, atol=0.04)
    assert not found["time", "offset"].significant
    assert "downwards (+y)" in sentence_of(time)


def test_frames_that_jump_do_not_fool_maps() -> None:
    """Displacements of whole frames at random, three times what the noise of one moves its middle by."""

    def jumping(each: SequenceEquations) -> Array:
        u = each.errors.places.normal[:, :, 0]
        return np.asarray(np.einsum("nkc,nc->nk", u, np.random.default_rng(len(u)).normal(0.0, 0.1, (len(u), 2))))

    assert [title_of(m) for m in residual_maps(registered().campaign, planted(jumping)) if m.p < 1e-3] == []


def test_noise_has_a_reduced_chi_square_of_one() -> None:
    floor = floor_of(planted(nothing))
    assert floor.repeated_px == pytest.approx(1.0, abs=0.05)
    assert floor.interval[0] < 1.0 < floor.interval[1]
    said = floor_sentence(floor, registered().campaign.kind.unit, (1.0, 0.01))
    assert "nothing to explain" in said
    assert "px" not in said


def test_a_slow_error_stands_above_the_floor() -> None:
    floor = floor_of(planted(lambda each: 0.2 * np.sin(np.arange(len(each.errors.e)) / 5.0)[:, None] * np.ones(64)))
    assert floor.repeated_px == pytest.approx(1.0, abs=0.1)
    assert floor.explainable(1.0, 0.01)
    assert floor.autocorrelation[0] > 0.3


def test_the_floor_needs_no_order_of_sightings() -> None:
    """Neighbours are those of one camera that are a frame apart, wherever they stand."""
    fit, campaign = planted(lambda each: 0.2 * np.sin(np.arange(len(each.errors.e)) / 5.0)[:, None] * np.ones(64)), registered().campaign
    sequences, equations, rng = [], [], np.random.default_rng(3)
    for sequence, each in zip(campaign.sequences, fit.equations, strict=True):
        rows = rng.permutation(len(each.errors.e))
        sequences.append(replace(sequence, task=replace(sequence.task, sightings=sequence.task.sightings.take(rows))))
        equations.append(replace(each, errors=replace(each.errors, e=each.errors.e[rows], seen=each.errors.seen[rows])))
    mixed = noise_floor(replace(campaign, sequences=tuple(sequences)), replace(fit, equations=tuple(equations)), np.random.default_rng(1))
    assert mixed.repeated_px == pytest.approx(floor_of(fit).repeated_px, rel=1e-12)
    np.testing.assert_allclose(mixed.autocorrelation, floor_of(fit).autocorrelation, rtol=1e-9)
