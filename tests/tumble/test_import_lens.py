"""How sure a lens is that was not calibrated: stated beside it, assumed where its centre is, or taken as exact, and said so."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.camera_files import read_camera
from datasets.errors import InputError
from datasets.video.writing import Recorded, write_cine
from tumble.cli.main import main
from tumble.importing.gathering import ASSUMED_CENTRE, gather
from tumble.importing.request import Request

SIZE, FOCAL_PX = 16, 3333.0
PICTURES = [np.full((SIZE, SIZE), 1000, dtype=np.uint16)] * 2
HOW = Recorded(rate_hz=4000.0, exposure_s=5e-5, depth=12)
CENTRE = "cx_px = 7.5\ncy_px = 7.5\n"


def written(folder: Path, more: str) -> tuple[Path, Path]:
    """A recording and its camera."""
    write_cine(folder / "drop.cine", PICTURES, HOW, bits=12)
    camera = folder / "camera.toml"
    camera.write_text(f"width_px = {SIZE}\nheight_px = {SIZE}\nfx_px = {FOCAL_PX}\nfy_px = {2 * FOCAL_PX}\n{more}")
    return folder / "drop.cine", camera


@pytest.mark.parametrize(("sigma", "more"), [(0.01, CENTRE), (0.01, ""), (None, ""), (None, CENTRE)])
def test_a_lens_is_as_sure_as_is_stated_or_assumed(sigma: float | None, more: str, tmp_path: Path) -> None:
    video, camera = written(tmp_path, more)
    (found,) = gather((video,), Request(cameras=(camera,), focal_sigma=sigma), decode=False).cameras
    if sigma is None and more:
        assert found.lens_covariance is None
        return
    assert found.lens_covariance is not None
    focal, centre = (sigma or 0.0) * np.array([FOCAL_PX, 2 * FOCAL_PX]), 0.0 if more else ASSUMED_CENTRE * SIZE
    assert np.allclose(found.lens_covariance[:2, :2], np.outer(focal, focal))
    assert np.allclose(np.sqrt(np.diag(found.lens_covariance)[2:]), [centre, centre, 0, 0, 0, 0, 0])


def test_what_counts_as_exact_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    video, camera = written(tmp_path, "")
    words = ["import", str(video), "--camera", str(camera), "--dry-run", "--out", str(tmp_path / "out")]
    for sigma, lens in ((None, "taken as exact: how sure it is not stated (--focal-sigma)"), (0.02, "± 2 %")):
        known = gather((video,), Request(cameras=(camera,), focal_sigma=sigma), decode=False).values
        (shown,) = [value.shown for value in known if value.name == "camera"]
        assert lens in shown
    monkeypatch.setenv("COLUMNS", "1000")
    assert main([*words, "--focal-sigma", "2%"]) == 0
    assert "± 2 %" in capsys.readouterr().out
    for wrong in ("1mm", "-1%", "nan"):
        assert main([*words, f"--focal-sigma={wrong}"]) == 2


def test_a_calibration_that_says_how_sure_it_is_is_not_overruled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    video, camera = written(tmp_path, CENTRE)
    sure = replace(read_camera(camera, 0), lens_covariance=np.eye(9))
    monkeypatch.setattr("tumble.importing.gathering.read_camera", lambda *_: sure)
    with pytest.raises(InputError, match="expected a camera that does not say how sure its lens is"):
        gather((video,), Request(cameras=(camera,), focal_sigma=0.01), decode=False)
