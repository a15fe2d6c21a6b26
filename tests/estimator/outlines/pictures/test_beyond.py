"""A particle that goes on outside of its half level is left out; a sharp, blurred, smeared or shining one is not."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from estimator.outlines import extract_outlines
from estimator.outlines.result import FrameStatus
from estimator.outlines.settings import OutlineSettings

SHAPE = (180, 240)
CENTRE = (120.3, 90.2)
ROOM = 320.0
"""Electrons that a dark room gives a pixel."""
BRIGHT = 9000.0

Picture = NDArray[np.float64]


def front_lit(darkroom, rng, facet: float, share: float):
    """A stone before a dark room whose left ``share`` sends ``facet`` electrons and whose rest is bright."""
    body = darkroom.stone(30, CENTRE, rng)
    occupancy = darkroom.draw(body, SHAPE, 0.7)
    left = np.arange(SHAPE[1]) < CENTRE[0] + 30 * (2 * share - 1)
    return [darkroom.expose(ROOM * (1 - occupancy) + occupancy * np.where(left, facet, BRIGHT), rng) for _ in range(3)]


@pytest.mark.parametrize("facet", [100.0, 700.0], ids=["darker than the room", "little brighter"])
def test_a_body_with_facets_like_the_room_is_left_out_with_the_reason(darkroom, rng, facet):
    pictures = front_lit(darkroom, rng, facet, share=0.4)
    track = extract_outlines(darkroom.frames(pictures, darkroom.expose(np.full(SHAPE, ROOM), rng)))
    assert track.reasons == (str(FrameStatus.UNEVENLY_LIT),) * 3
    assert all(o.empty for o in track.outlines)
    assert all(len(f.outline.points_px) > 20 for f in track.frames)


def test_an_evenly_lit_body_before_a_dark_room_is_used(darkroom, rng):
    pictures = front_lit(darkroom, rng, BRIGHT, share=0.4)
    assert extract_outlines(darkroom.frames(pictures, darkroom.expose(np.full(SHAPE, ROOM), rng))).used.all()


def test_the_share_that_is_allowed_can_be_set(darkroom, rng):
    pictures = front_lit(darkroom, rng, 700.0, share=0.4)
    taken = darkroom.expose(np.full(SHAPE, ROOM), rng)
    lenient = replace(OutlineSettings(), beyond_share=1.0)
    assert extract_outlines(darkroom.frames(pictures, taken), settings=lenient).used.all()


@pytest.mark.parametrize(
    "spoiled",
    [lambda o: o, lambda o: uniform_filter1d(o, 7, axis=1), lambda o: uniform_filter1d(uniform_filter1d(o, 5, axis=1), 5, axis=0)],
    ids=["sharp", "smeared over 7 px", "blurred"],
)
def test_blur_and_smear_are_no_more_of_the_particle(darkroom, rng, spoiled: Callable[[Picture], Picture]):
    occupancy = spoiled(darkroom.draw(darkroom.stone(30, CENTRE, rng), SHAPE, 0.7))
    pictures = [darkroom.expose(darkroom.panel(SHAPE) * (1 - 0.98 * occupancy), rng) for _ in range(3)]
    assert extract_outlines(darkroom.frames(pictures, darkroom.expose(darkroom.panel(SHAPE), rng))).used.all()


def test_light_through_a_clear_body_is_no_reason(darkroom, rng):
    body = darkroom.draw(darkroom.stone(30, CENTRE, rng), SHAPE, 0.7)
    window = darkroom.draw(darkroom.ellipse(8, 6, CENTRE), SHAPE, 0.7)
    pictures = [darkroom.expose(darkroom.panel(SHAPE) * (1 - body + 0.9 * window), rng) for _ in range(3)]
    assert extract_outlines(darkroom.frames(pictures, darkroom.expose(darkroom.panel(SHAPE), rng))).used.all()


def before_a_plate(darkroom, rng, gap_px: float):
    """An ellipse over a dark plate whose edge is blurred; the background without it."""
    body = darkroom.draw(darkroom.ellipse(24, 20, CENTRE), SHAPE, 0.7)
    top = CENTRE[1] + 20 + gap_px
    open_share = 0.02 + 0.98 / (1.0 + np.exp((np.arange(SHAPE[0]) - top) / 0.8))[:, None]
    light = darkroom.panel(SHAPE) * open_share
    return [darkroom.expose(light * (1 - body), rng) for _ in range(3)], darkroom.expose(light, rng)


@pytest.mark.parametrize(
    ("gap_px", "reason"),
    [(-25.0, FrameStatus.BEFORE_SCENERY), (-1.0, FrameStatus.IN_PART), (1.5, FrameStatus.IN_PART), (10.0, FrameStatus.USED)],
)
def test_a_particle_about_to_touch_a_plate_is_used_where_it_is_clear_of_it(darkroom, rng, gap_px, reason):
    track = extract_outlines(darkroom.frames(*before_a_plate(darkroom, rng, gap_px)))
    assert track.reasons == (str(reason),) * 3
    if reason is FrameStatus.IN_PART:
        for frame in track.frames:
            below = frame.outline.points_px[:, 1] - CENTRE[1]
            assert below[frame.unsure].min() > 10.0
            assert frame.unsure[below > 18.0].all()
            sure = frame.outline.points_px[~frame.unsure] - CENTRE
            np.testing.assert_allclose(np.hypot(sure[:, 0] / 24.0, sure[:, 1] / 20.0), 1.0, atol=0.02)


def test_a_shadow_on_the_plate_is_no_more_of_the_particle(darkroom, rng):
    (first, *_), background = before_a_plate(darkroom, rng, 5.0)
    below = 1.0 / (1.0 + np.exp(-(np.arange(SHAPE[0]) - CENTRE[1] - 24.0) / 0.8))[:, None]
    beneath = np.exp(-(((np.arange(SHAPE[1]) - CENTRE[0]) / 9.0) ** 2))
    track = extract_outlines(darkroom.frames([first * (1.0 - 0.3 * below * beneath)] * 3, background))
    assert track.reasons == (str(FrameStatus.USED),) * 3
