"""What is not there, not stated, or may not be read, is said to be so by ``tumble import`` and by what begins with a file."""

import errno
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from datasets.video.writing import Recorded, write_cine
from tumble.cli.main import main

SIZE = 16
PICTURES = [np.full((SIZE, SIZE), 1000, dtype=np.uint16)] * 2
HOW = Recorded(rate_hz=4000.0, exposure_s=5e-5, depth=12)


def missing(folder: Path) -> dict[str, tuple[list[str], str]]:
    """Words of an import of a recording that is there, and what must be said of what is not."""
    gone = f"{folder / 'gone'}: there is no such file or folder"
    return {
        "particle": (["--particle", str(folder / "gone")], gone),
        "background": (["--background", str(folder / "gone")], gone),
        "gravity": (["--gravity", str(folder / "gone.toml")], "there is no such file"),
        "camera": (["--camera", str(folder / "gone.toml")], f"{folder / 'gone.toml'}: there is no such file"),
    }


@pytest.mark.parametrize("what", ["particle", "background", "gravity", "camera"])
def test_what_is_not_there_is_said_to_be_missing(what: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    write_cine(tmp_path / "drop.cine", PICTURES, HOW, bits=12)
    words, said = missing(tmp_path)[what]
    assert main(["import", str(tmp_path / "drop.cine"), *words, "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize("verb", ["import", "check", "calibrate rig"])
def test_a_source_that_is_not_there_is_said_to_be_missing(verb: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main([*verb.split(), str(tmp_path / "gone"), "--out", str(tmp_path / "out")]) == 2
    assert f"{tmp_path / 'gone'}: there is no such file or folder" in capsys.readouterr().err


@pytest.mark.parametrize(("name", "opener"), [("a.png", "PIL.Image.open"), ("a.tif", "tifffile.TiffFile")])
def test_a_picture_that_may_not_be_read_is_not_called_damaged(
    name: str, opener: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied")

    folder = tmp_path / "drop"
    folder.mkdir()
    Image.fromarray(PICTURES[0]).save(folder / name)
    monkeypatch.setattr(opener, refuse)
    assert main(["import", str(folder), "--dry-run", "--out", str(tmp_path / "out")]) == 2
    assert f"{folder / name}: cannot be read (Permission denied)" in capsys.readouterr().err


@pytest.mark.parametrize("stated", [True, False])
def test_a_principal_point_that_nobody_stated_is_said_to_be_assumed(
    stated: bool, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_cine(tmp_path / "drop.cine", PICTURES, HOW, bits=12)
    point = "cx_px = 9.0\ncy_px = 7.5\n" if stated else ""
    (tmp_path / "camera.toml").write_text(f"width_px = {SIZE}\nheight_px = {SIZE}\nfx_px = 3333.0\nfy_px = 3333.0\n{point}")
    words = ["import", str(tmp_path / "drop.cine"), "--camera", str(tmp_path / "camera.toml"), "--dry-run", "--json"]
    assert main([*words, "--out", str(tmp_path / "out")]) == 0
    (told,) = json.loads(capsys.readouterr().out)
    (value,) = [value for value in told["values"] if value["name"] == "principal_point"]
    assert (value["value"], value["origin"]) == (([9.0, 7.5], "given") if stated else ([7.5, 7.5], "assumed"))
    assert ("cx_px, cy_px" in value["note"]) is not stated
