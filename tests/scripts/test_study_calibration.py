"""The study of calibration: a rig is drawn as described, and the committed page is that of the committed figures, within acceptance."""

import json

import numpy as np

from scripts.trials import study_calibration as study


def test_the_page_is_that_of_the_figures():
    document = json.loads(study.RESULT.read_text(encoding="utf-8"))
    assert study.figures(document["rigs"]) == document["figures"]
    assert study.PAGE.read_text(encoding="utf-8") == "\n".join(study.page(document)).rstrip("\n") + "\n"


def test_acceptance_holds():
    document = json.loads(study.RESULT.read_text(encoding="utf-8"))
    figures = document["figures"]
    assert len(document["rigs"]) >= 12
    assert figures["focal_share_within"] >= 0.99
    assert figures["centre_share_within"] >= 0.99
    assert figures["rotation_median_deg"] <= 0.02
    inside = [figures[f"inside_{what}"] for what in ("focal", "centre", "rotation_component", "place_component", "rotation_ellipsoid")]
    assert min(inside) >= 0.9


def test_every_placement_is_in_front_of_two_cameras():
    rng = np.random.default_rng(1)
    cameras = study.drawn_cameras(rng)
    np.testing.assert_allclose(cameras[0].R_cam_world, np.eye(3), atol=1e-12)
    for _ in range(5):
        R, t = study.drawn_placement(cameras, rng)
        middle = R @ np.array([*(0.5 * np.array(study.BOARD.size_m)), 0.0]) + t
        seen = [camera.intrinsics.project((camera.R_cam_world @ middle + camera.t_cam_world)[None])[0] for camera in cameras]
        assert sum(bool(((px > 0) & (px < study.SIZE)).all()) for px in seen) >= 5
        assert sum(float((camera.R_cam_world @ R)[2, 2]) > study.STEEPEST for camera in cameras) >= 2
