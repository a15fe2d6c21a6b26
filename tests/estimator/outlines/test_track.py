"""The particle through a sequence: what is used, what is left out and why."""

import numpy as np
import pytest

from datasets.errors import InputError
from estimator.outlines import FrameStatus, OutlineSettings, extract_outlines

SHAPE = (180, 320)


def passing(rng, darkroom, centres, **kwargs):
    body = darkroom.stone(24, (0.0, 0.0), rng)
    return [body + c for c in centres], [darkroom.back_lit(body + c, SHAPE, rng, **kwargs) for c in centres]


def open_panel(darkroom, rng):
    return darkroom.expose(darkroom.panel(SHAPE), rng)


def line(count, start=(60, 70), step=(9.3, 2.1)):
    return np.array(start) + np.arange(count)[:, None] * np.array(step)


@pytest.mark.parametrize("taken", [True, False])
def test_a_passing_particle_is_followed(darkroom, rng, taken):
    polygons, pictures = passing(rng, darkroom, line(20))
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng) if taken else None))
    assert track.used.all()
    bias = [darkroom.signed_distances(o.points_px, p).mean() for o, p in zip(track.outlines, polygons, strict=True)]
    assert np.abs(bias).max() < 0.03


def test_a_slow_particle_without_a_background_picture(darkroom, rng):
    polygons, pictures = passing(rng, darkroom, line(12, (150, 90), (0.4, 0.2)))
    track = extract_outlines(darkroom.frames(pictures))
    assert track.used.all()
    bias = [darkroom.signed_distances(o.points_px, p).mean() for o, p in zip(track.outlines, polygons, strict=True)]
    assert np.abs(bias).max() < 0.03


@pytest.mark.parametrize("level", [0, 60, 4095], ids=["black", "dark", "saturated"])
def test_a_picture_without_light_says_nothing_of_what_is_behind_a_slow_particle(darkroom, rng, level):
    polygons, pictures = passing(rng, darkroom, line(12, (150, 90), (0.4, 0.2)))
    pictures[5] = np.full(SHAPE, level, np.uint16)
    track = extract_outlines(darkroom.frames(pictures))
    assert track.used.tolist() == [k != 5 for k in range(12)]
    bias = [darkroom.signed_distances(track.outlines[k].points_px, polygons[k]).mean() for k in range(12) if k != 5]
    assert np.abs(bias).max() < 0.03


def test_a_flickering_lamp_does_not_move_the_outline(darkroom, rng):
    body = darkroom.stone(24, (150.3, 90.2), rng)
    lamps = (1.0, 0.8, 1.1, 0.6)
    pictures = [darkroom.back_lit(body, SHAPE, rng, lamp=lamp) for lamp in lamps]
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng)))
    bias = [darkroom.signed_distances(o.points_px, body).mean() for o in track.outlines]
    assert np.abs(bias).max() < 0.02


def test_a_bright_particle_before_a_dark_background(darkroom, rng):
    body = darkroom.stone(24, (150.3, 90.2), rng)
    y, x = np.mgrid[: SHAPE[0], : SHAPE[1]]
    shading = 9000 + 80 * (x - 150) - 60 * (y - 90)
    dark = np.full(SHAPE, 300.0)
    pictures = [darkroom.expose(dark + darkroom.draw(body, SHAPE, 0.7) * shading, rng) for _ in range(3)]
    for taken in (darkroom.expose(dark, rng), None):
        track = extract_outlines(darkroom.frames(pictures, taken))
        assert track.used.all()
        bias = [darkroom.signed_distances(o.points_px, body).mean() for o in track.outlines]
        assert np.abs(bias).max() < 0.04


def test_leaving_and_entering_the_picture(darkroom, rng):
    _, pictures = passing(rng, darkroom, line(12, (-31, 80), (35, 1)))
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng)))
    reasons = track.reasons
    assert reasons[0] == FrameStatus.ABSENT
    assert reasons[1] == reasons[10] == FrameStatus.CUT_OFF
    assert set(reasons[2:9]) == {FrameStatus.USED}
    assert all(o.empty != u for o, u in zip(track.outlines, track.used, strict=True))


def test_black_and_overexposed_pictures_between_good_ones(darkroom, rng):
    polygons, pictures = passing(rng, darkroom, line(6))
    pictures[2] = np.full(SHAPE, 60, np.uint16)
    pictures[4] = np.full(SHAPE, 4095, np.uint16)
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng)))
    assert track.reasons[2] == FrameStatus.BLACK
    assert track.reasons[4] == FrameStatus.OVEREXPOSED
    assert track.used.tolist() == [True, True, False, True, False, True]
    assert np.isnan(track.sigmas_px[2])
    assert abs(darkroom.signed_distances(track.outlines[5].points_px, polygons[5]).mean()) < 0.03


@pytest.mark.parametrize("taken", [True, False])
def test_nothing_but_black_pictures(darkroom, rng, taken):
    pictures = [np.zeros(SHAPE, np.uint16)] * 3
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng) if taken else None))
    assert set(track.reasons) == {FrameStatus.BLACK}


def test_an_empty_sequence_of_an_open_panel(darkroom, rng):
    track = extract_outlines(darkroom.frames([open_panel(darkroom, rng) for _ in range(3)], open_panel(darkroom, rng)))
    assert set(track.reasons) == {FrameStatus.ABSENT}


def test_two_alike_objects_cannot_be_told_apart(darkroom, rng):
    a, b = darkroom.stone(20, (80, 90), rng), darkroom.stone(20, (220, 90), rng)
    o = darkroom.draw(a, SHAPE, 0.6) + darkroom.draw(b, SHAPE, 0.6)
    picture = darkroom.expose(darkroom.panel(SHAPE) * (1 - o), rng)
    assert extract_outlines(darkroom.frames([picture], open_panel(darkroom, rng))).reasons == (FrameStatus.SEVERAL,)


def test_a_second_object_later_does_not_confuse(darkroom, rng):
    polygons, pictures = passing(rng, darkroom, line(5))
    intruder = darkroom.draw(darkroom.stone(24, (260, 50), rng), SHAPE, 0.6)
    pictures[3] = np.round(pictures[3] * (1 - 0.95 * intruder)).astype(np.uint16)
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng)))
    assert track.used.all()
    assert abs(darkroom.signed_distances(track.outlines[3].points_px, polygons[3]).mean()) < 0.03


def test_blurred_frames_are_left_out(darkroom, rng):
    body = darkroom.stone(24, (150.3, 90.2), rng)
    blurs = (0.6, 0.6, 0.7, 2.5, 4.0)
    pictures = [darkroom.back_lit(body, SHAPE, rng, blur_px=b) for b in blurs]
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng)))
    assert track.reasons == ("used",) * 3 + (FrameStatus.OUT_OF_FOCUS,) * 2
    assert not track.frames[4].outline.empty
    assert track.outlines[4].empty


def test_a_jump_of_the_particle_is_found_in_the_whole_picture(darkroom, rng):
    polygons, pictures = passing(rng, darkroom, np.array([(60, 60), (63, 60), (250, 120), (253, 120)]))
    track = extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng)))
    assert track.used.all()
    assert abs(darkroom.signed_distances(track.outlines[2].points_px, polygons[2]).mean()) < 0.03


def test_frames_are_read_one_by_one(darkroom, rng):
    _, pictures = passing(rng, darkroom, line(8))
    frames = darkroom.frames(pictures, open_panel(darkroom, rng))
    extract_outlines(frames, settings=OutlineSettings(background_samples=4))
    assert len(frames.reads) <= 8 + 4 + 1


def test_wrong_size_is_named(darkroom, rng):
    _, pictures = passing(rng, darkroom, line(3))
    pictures[1] = pictures[1][:-1]
    with pytest.raises(InputError, match=r"run7: frame 1: expected 320 x 180 px.*\(179, 320\)"):
        extract_outlines(darkroom.frames(pictures, open_panel(darkroom, rng)), name="run7", settings=OutlineSettings(background_samples=1))
    with pytest.raises(InputError, match="expected 1024 x 1024 px"):
        extract_outlines(darkroom.frames(pictures), image_size=(1024, 1024))
    with pytest.raises(InputError, match="background: expected 320 x 180"):
        extract_outlines(darkroom.frames(pictures[:1], np.zeros((5, 5), np.uint16)))
    with pytest.raises(InputError, match="at least one frame"):
        extract_outlines(darkroom.frames([]))
