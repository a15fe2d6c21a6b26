"""What the smooth light of one picture leaves out as objects."""

import numpy as np

from estimator.outlines.pictures.illumination import illumination_of

LIGHT, NOISE = 3000.0, 10.0


def with_tip(rng, x, y, towards):
    """A dark square, 100 px wide, with a tip 30 px long and 4 px wide on one of its sides."""
    picture = rng.normal(LIGHT, NOISE, (1024, 1024))
    picture[y : y + 100, x : x + 100] = 200.0
    dx, dy = towards
    columns = slice(x - 30, x) if dx < 0 else slice(x + 100, x + 130) if dx > 0 else slice(x + 48, x + 52)
    rows = slice(y - 30, y) if dy < 0 else slice(y + 100, y + 130) if dy > 0 else slice(y + 48, y + 52)
    picture[rows, columns] = 200.0
    return picture.astype(np.uint16)


def test_objects_are_left_out_with_their_tips_on_whichever_side(rng):
    for towards in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        for k in range(10):  # the picture's coarse pixels are 10 px wide
            picture = with_tip(rng, 400 + k, 400 + k, towards).astype(np.float32)
            assert not np.any((picture < 0.8 * LIGHT) & ~illumination_of(picture).objects), towards


def test_single_coarse_pixels_are_noise(rng):
    picture = rng.normal(LIGHT, NOISE, (1024, 1024)).astype(np.float32)
    picture[502:508, 502:508] = 200.0
    assert not illumination_of(picture).objects.any()
