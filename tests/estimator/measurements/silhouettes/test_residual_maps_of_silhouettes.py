"""Maps show planted errors where they are, with their size and direction, and nothing in noise."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.appearance.model_errors import SequenceTask
from estimator.diagnosis.residual_maps import ResidualMap, residual_maps, shown
from estimator.fitting.campaigns.campaign import CampaignFit, SequenceEquations
from estimator.measurements.silhouettes.map_axes import axes_of
from tests.estimator.small_campaign import fitted, registered
from tumble.reports.map_words import sentence_of, title_of

Array = NDArray[np.float64]
Change = Callable[[SequenceTask, SequenceEquations], Array]


def planted(change: Change) -> CampaignFit:
    """White errors of 0.1 px and a planted one."""
    rng = np.random.default_rng(4)
    fit = fitted()
    equations = []
    for sequence, each in zip(registered().campaign.sequences, fit.equations, strict=True):
        seen = each.errors.tangency.valid[:, :, None]
        e = rng.normal(0.0, 0.1, each.errors.e.shape) + change(sequence, each)
        equations.append(replace(each, errors=replace(each.errors, e=np.where(seen, e, 0.0))))
    return replace(fit, equations=tuple(equations))


def maps_of(change: Change) -> dict[tuple[str, str], ResidualMap]:
    return {(m.axis.name, m.kind): m for m in residual_maps(registered().campaign, planted(change))}


def frame(sequence: SequenceTask) -> Array:
    return sequence.task.sightings.frame[:, None, None].astype(np.float64)


def test_noise_shows_nothing() -> None:
    maps = residual_maps(registered().campaign, fitted())
    assert [title_of(m) for m in maps if m.significant] == []
    assert all("nothing that noise would not do" in sentence_of(m) for m in maps)
    assert {m.axis.name for m in maps} == {"time", "place", "radius", "outline_direction", "body_direction", "speed", "spin_phase", "view"}


def test_a_displacement_against_the_flight_late_in_time() -> None:
    campaign, fit = registered().campaign, fitted()
    flying = axes_of(campaign, fit).velocity_direction
    first = int(sum(2 * fit.equations[0].errors.tangency.valid.sum() for _ in range(1)))

    def late(sequence: SequenceTask, each: SequenceEquations) -> Array:
        v = flying[0] if sequence is campaign.sequences[0] else flying[first]
        along = each.errors.places.normal @ v
        return np.where(frame(sequence) >= 15, -0.25 * along, 0.0)

    found = maps_of(late)
    time = found["time", "along_v"]
    assert time.significant
    assert np.allclose(time.mean_px[-4:], -0.25, atol=0.06)
    assert np.allclose(time.mean_px[:4], 0.0, atol=0.06)
    assert not found["time", "offset"].significant
    said = sentence_of(time)
    assert "along −v" in said
    assert "in frames 15 to 29" in said


def test_outlines_that_grow_with_time() -> None:
    found = maps_of(lambda sequence, each: np.broadcast_to(0.01 * frame(sequence), each.errors.e.shape))
    best = found["time", "offset"]
    assert best.significant
    assert "larger than the model's" in sentence_of(best)
    assert "growing with time" in sentence_of(best)


@pytest.mark.parametrize(("wanted", "words"), [(0, "right"), (3, "down"), (9, "up")])
def test_one_side_of_the_outline(wanted: int, words: str) -> None:
    def side(sequence: SequenceTask, each: SequenceEquations) -> Array:
        u = each.errors.places.normal
        degrees = np.degrees(np.arctan2(u[..., 1], u[..., 0])) % 360.0
        return np.where(np.round(degrees / 30.0) % 12 == wanted, 0.3, 0.0)

    best = maps_of(side)["outline_direction", "offset"]
    assert best.significant
    top = int(np.argmax(best.mean_px))
    assert best.bins[top] == wanted
    assert abs(best.mean_px[top] - 0.3) < 3.0 * best.sigma_px[top]
    assert f"where they face {words} " in sentence_of(best)


def test_one_bad_view_is_named() -> None:
    def bad(sequence: SequenceTask, each: SequenceEquations) -> Array:
        e = np.zeros(each.errors.e.shape)
        e[:, 5] = 0.8
        return e

    best = maps_of(bad)["view", "offset"]
    assert best.significant
    assert "in pairs with calibrated view 5 " in sentence_of(best)


def test_frames_that_jump_do_not_fool_maps() -> None:
    """Errors that a whole frame shares count once: with independent errors these would be far beyond chance."""
    shifts = np.random.default_rng(5).normal(0.0, 0.2, 100)
    maps = residual_maps(
        registered().campaign,
        planted(lambda s, each: np.broadcast_to(shifts[frame(s).astype(int) + 40 * (s.name[-1] == "1")], each.errors.e.shape)),
    )
    assert [title_of(m) for m in maps if m.p < 1e-4] == []


def test_one_map_of_each_axis_is_shown() -> None:
    maps = residual_maps(registered().campaign, fitted())
    names = [m.axis.name for m in shown(maps)]
    assert sorted(names) == sorted(set(names))
    assert len(names) == 8


@pytest.mark.parametrize(
    ("name", "size_px", "words"),
    [
        ("place", 0.4, "px of the picture"),
        ("radius", 0.4, "px from the principal point"),
        ("body_direction", 1.0, "on the particle's side at longitude"),
        ("speed", 0.4, "at speeds of"),
        ("spin_phase", 0.4, "after the first frame's orientation"),
    ],
)
def test_outlines_that_are_too_large_somewhere(name: str, size_px: float, words: str) -> None:
    """Whatever they are mapped over, the map of that axis shows it where it is, with its size and in words.

    On the body it has to be larger than the body-fixed error that every hull has.
    """
    campaign, fit = registered().campaign, fitted()
    axis = next(each for each in axes_of(campaign, fit).axes if each.name == name)
    wanted = int(np.argmax(np.bincount(axis.bin)))
    counts = [int(each.errors.seen.sum()) for each in fit.equations]
    larger = np.split(np.where(axis.bin == wanted, size_px, 0.0), np.cumsum(counts)[:-1])
    names = [each.name for each in campaign.sequences]

    def somewhere(sequence: SequenceTask, each: SequenceEquations) -> Array:
        e = np.zeros(each.errors.e.shape)
        e[each.errors.seen] = larger[names.index(sequence.name)]
        return e

    best = maps_of(somewhere)[name, "offset"]
    assert best.significant
    top = int(np.argmax(best.mean_px))
    assert best.bins[top] == wanted
    assert abs(best.mean_px[top] - size_px) < 4.0 * best.sigma_px[top]
    assert "larger than the model's" in sentence_of(best)
    assert words in sentence_of(best)
