"""``tumble calibrate check``: a right calibration passes, a wrong one is named, with pictures that it has not seen."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.calibration_files import FILE, read_calibration, write_calibration
from estimator.calibration.checking import agreement
from estimator.calibration.fitting import fit_rig
from tests.calibrations import BOARD, LENS, placements, ring, seen, write_pictures
from tumble.cli.main import main


def test_honest_covariance_passes_and_an_overconfident_one_does_not() -> None:
    passed, caught = [], []
    for seed in range(5):
        rng = np.random.default_rng(100 + seed)
        cameras = ring(2, rng)
        size = ((LENS.width_px, LENS.height_px),) * 2
        fit = fit_rig(seen(cameras, placements(10, rng), 0.05, rng), BOARD, size)
        lenses = zip(cameras, fit.rig.lenses, fit.rig.R_cam, fit.rig.t_cam, strict=True)
        made = tuple(replace(c, intrinsics=lens, R_cam_world=R, t_cam_world=t) for c, lens, R, t in lenses)
        further = seen(cameras, placements(25, rng), 0.05, rng)
        passed.append(agreement(further, BOARD, made, fit.covariance)[0].test.honest)
        caught.append(not agreement(further, BOARD, made, fit.covariance / 25)[0].test.honest)
    assert sum(passed) >= 4
    assert sum(caught) >= 4


def test_a_wrong_camera_is_caught_by_pictures(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(11)
    camera = ring(1, rng)[0]
    boards = write_pictures(tmp_path / "boards", camera, placements(9, rng), rng)
    further = write_pictures(tmp_path / "further", camera, placements(5, rng), rng)
    out = tmp_path / "camera"
    assert main(["calibrate", "camera", str(boards), "--board", BOARD.words, "--out", str(out), "-q"]) == 0
    assert main(["calibrate", "check", str(out), str(further), "--json", "--out", str(tmp_path / "check")]) == 0
    figures = json.loads(capsys.readouterr().out)["pictures"]
    assert figures["free_px"] <= figures["held_px"] < 0.1
    made = read_calibration(out)
    wrong = replace(made.cameras[0], intrinsics=replace(made.cameras[0].intrinsics, fx_px=1.02 * made.cameras[0].intrinsics.fx_px))
    (tmp_path / "wrong").mkdir()
    write_calibration(replace(made, cameras=(wrong,)), tmp_path / "wrong" / FILE)
    assert main(["calibrate", "check", str(tmp_path / "wrong"), str(further), "--out", str(tmp_path / "check2")]) == 1
    assert "the pictures contradict it" in capsys.readouterr().out
    assert "the pictures contradict it" in (tmp_path / "check2" / "calibration.html").read_text(encoding="utf-8")
    assert main(["calibrate", "check", str(out), "--out", str(tmp_path / "check3"), "-q"]) == 0
