"""Of frames of which a plate hides a part the rest is used, and others are used whole."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.estimate import Status
from datasets.observation import Observation
from datasets.scoring.impacts import score_impacts
from datasets.truth import Truth
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.plate import Plate
from estimator.data.configuration import Configuration
from estimator.measure import measure
from estimator.outlines.behind_plate import along, moved_px
from estimator.outlines.result import FrameStatus
from estimator.outlines.sightings import tracks_of
from synth.sequence import build_silhouette_sequence
from tests.estimator.test_measure import RECIPE

SQUARE = np.array([[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0]])
BELOW = replace(RECIPE, plate=replace(RECIPE.plate, elevation_deg=-3.0))


def fine(points: np.ndarray) -> Outline:
    steps = np.linspace(0.0, 1.0, 20, endpoint=False)[:, None]
    return Outline(np.concatenate([a + steps * (b - a) for a, b in zip(points, np.roll(points, -1, axis=0), strict=True)]))


@pytest.fixture(scope="module")
def seen_from_below() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(BELOW, 0)


def test_the_points_beside_a_plate_are_found() -> None:
    plate = np.array([[-50.0, 20.5], [70.0, 20.5], [70.0, 60.0], [-50.0, 60.0]])
    assert along(fine(SQUARE), plate).sum() == pytest.approx(20.0, abs=2.0)
    assert not along(fine(SQUARE - [0.0, 5.0]), plate).any()
    corner = fine((SQUARE - 10.0) @ (np.array([[1.0, 1.0], [-1.0, 1.0]]) / np.sqrt(2.0)) + [10.0, 20.5 - 10.0 * np.sqrt(2.0)])
    assert along(corner, plate).sum() < 4.0


def test_frames_are_used_as_far_as_the_plate_does_not_hide_them(seen_from_below: tuple[Observation, Truth]) -> None:
    observation, truth = seen_from_below
    (track,) = tracks_of(observation)
    hidden = np.array([reason == FrameStatus.IN_PART for reason in track.reasons])
    assert all(track.seen)
    away = np.abs(observation.clock.times_s - truth.impacts[0].time_s) * 4000.0
    assert hidden[away < 1.0].any()
    assert 1 <= hidden.sum() <= 8
    assert not hidden[away > 6.0].any()
    plain = build_silhouette_sequence(RECIPE, 0)[0]
    assert sum(reason == FrameStatus.IN_PART for reason in tracks_of(plain)[0].reasons) <= 2
    whole = replace(observation, plate_outlines=())
    assert all(tracks_of(whole)[0].used)


def test_an_impact_is_measured_with_what_the_plate_leaves_of_the_outlines(seen_from_below: tuple[Observation, Truth]) -> None:
    observation, truth = seen_from_below
    found = measure(observation, Configuration())
    assert found.status is Status.CONVERGED
    reasons = {frame.reason for frame in found.frames if frame.used}
    assert reasons == {"", str(FrameStatus.IN_PART)}
    assert all(frame.rms_ete_px < 0.5 for frame in found.frames)
    (row,) = score_impacts(found, truth)
    assert row["found"]
    assert row["time_error_frames"] < 0.2
    assert row["after_in_plane_percent"] < 1.0


def test_a_plate_that_moves_is_followed_in_the_picture() -> None:
    observation = build_silhouette_sequence(RECIPE, 0)[0]
    assert observation.plate is not None
    camera = observation.cameras[0]
    moving = Plate(np.array([0.0, 0.0, 0.6]), observation.plate.normal_world, np.array([0.3, 0.0, 0.0]))
    expected = camera.intrinsics.fx_px * 0.3 * 0.01 / 0.6
    np.testing.assert_allclose(moved_px(moving, camera, 0.01), [expected, 0.0], atol=1e-9)
    np.testing.assert_array_equal(moved_px(observation.plate, camera, 0.01), np.zeros(2))
