"""Both tiers and the calibrated views."""

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.outlines import FrameStatus, outlines_of, view_outlines_of

INTRINSICS = Intrinsics(200, 150, 6000.0, 6000.0, 99.5, 74.5)
VIEW = CalibratedView(INTRINSICS, np.eye(3), np.array([0, 0, 1.0]))


def test_outlines_pass_through_checked(darkroom):
    good, cut, none = darkroom.ellipse(30, 20, (100, 70), 60), darkroom.ellipse(30, 20, (20, 70), 60), np.zeros((0, 2))
    track = outlines_of((Outline(good), Outline(cut), Outline(none)), INTRINSICS)
    assert track.reasons == (FrameStatus.USED, FrameStatus.CUT_OFF, FrameStatus.ABSENT)
    np.testing.assert_array_equal(track.outlines[0].points_px, good)


def test_outlines_turned_the_wrong_way_are_turned_round(darkroom):
    good = darkroom.ellipse(30, 20, (100, 70), 60)
    track = outlines_of((Outline(good[::-1]),), INTRINSICS)
    np.testing.assert_array_equal(track.outlines[0].points_px, good)


def test_frames_are_measured(darkroom, rng):
    body = darkroom.stone(28, (99.3, 74.1), rng)
    frames = darkroom.frames([darkroom.back_lit(body, (150, 200), rng)] * 2)
    track = outlines_of(frames, INTRINSICS)
    assert track.used.all()
    assert abs(darkroom.signed_distances(track.outlines[0].points_px, body).mean()) < 0.03


@pytest.mark.parametrize("taken", [True, False])
def test_views_stand_alone(darkroom, rng, taken):
    bodies = [darkroom.stone(r, c, rng) for r, c in ((28, (99, 74)), (40, (80, 70)), (25, (12, 70)))]
    background = darkroom.expose(darkroom.panel((150, 200)), rng) if taken else None
    frames = darkroom.frames([darkroom.back_lit(b, (150, 200), rng) for b in bodies], background)
    track = view_outlines_of(frames, [VIEW] * 3)
    assert track.reasons == (FrameStatus.USED, FrameStatus.USED, FrameStatus.CUT_OFF)
    for outline, body in zip(track.outlines[:2], bodies, strict=False):
        assert abs(darkroom.signed_distances(outline.points_px, body).mean()) < 0.03


def test_numbers_of_views_and_pictures_must_agree(darkroom):
    frames = darkroom.frames([np.zeros((150, 200), np.uint16)])
    with pytest.raises(InputError, match="2 calibrated views, got 1 pictures"):
        view_outlines_of(frames, [VIEW] * 2)
    with pytest.raises(InputError, match="2 calibrated views, got 0"):
        view_outlines_of((), [VIEW] * 2)
    with pytest.raises(InputError, match="views: frame 0: expected 200 x 150"):
        view_outlines_of(darkroom.frames([np.zeros((10, 20), np.uint16)]), [VIEW])
