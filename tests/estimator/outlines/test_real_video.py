"""A real high-speed recording: a back-lit falling ball, overexposed panel, glare inside, a plate below.

Photron, 30,000 fps, 384 x 384, packed 12 bit; github ladisk/pyMRAW.
"""

import numpy as np
import pytest
import shapely

from estimator.outlines import extract_outlines


def unpacked(path):
    """Two 12-bit numbers in three bytes, most significant bits first."""
    raw = np.fromfile(path, np.uint8).reshape(-1, 3).astype(np.uint16)
    pairs = np.stack([(raw[:, 0] << 4) | (raw[:, 1] >> 4), ((raw[:, 1] & 15) << 8) | raw[:, 2]], axis=1)
    return list(pairs.reshape(-1, 384, 384))


@pytest.fixture(scope="module")
def ball(shared_data, darkroom):
    return extract_outlines(darkroom.frames(unpacked(shared_data / "video" / "ball_12bit.mraw")))


def test_the_ball_is_seen_in_every_frame(ball):
    assert len(ball) == 15
    assert ball.used.all()


def test_its_centre_moves_on_a_line(ball):
    centres = np.array([shapely.centroid(shapely.Polygon(o.points_px)).coords[0] for o in ball.outlines])
    frame = np.arange(len(centres))
    for coordinate in centres.T:
        residual = coordinate - np.polyval(np.polyfit(frame, coordinate, 1), frame)
        assert residual.std(ddof=2) < 0.02


def test_it_is_round_and_keeps_its_size(ball):
    for outline in ball.outlines:
        area = shapely.Polygon(outline.points_px).area
        assert area / (np.pi * 63.4**2) == pytest.approx(1, abs=0.004)
        radius = np.hypot(*(outline.points_px - outline.points_px.mean(axis=0)).T)
        assert radius.std() < 0.25
