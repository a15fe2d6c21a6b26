"""What an import says of its values."""

import pytest

from tumble.cli.check_words import say_values


def test_long_paths_are_not_cut_off(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    path = "/".join(["a_folder"] * 12)
    say_values("drop", [{"name": "camera", "value": "focal length 6001.1 x 6001.3 px", "origin": "given", "note": f"--camera {path}"}])
    printed = capsys.readouterr().out
    assert "…" not in printed
    assert path in "".join(line[len("camera  focal length 6001.1 x 6001.3 px  given  ") :].strip() for line in printed.splitlines())
