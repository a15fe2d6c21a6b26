"""Progress is said on standard error, and only where somebody wants to know."""

from pathlib import Path

import pytest

from tumble import progress as shown
from tumble.progress import progress, pulse_sum, write_pulse


def test_quiet_says_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with progress("render", 3, quiet=True) as advance:
        advance("a")
    assert capsys.readouterr() == ("", "")


def test_lines_say_the_time_left(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(shown, "LINE_EVERY_S", 0.0)
    monkeypatch.setattr(shown, "RESUMED_S", 0.0)
    with progress("render", 4, quiet=False) as advance:
        advance("a")
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("render: 25% of 4, about ")


def test_what_an_earlier_run_did_says_nothing_of_the_time_left(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    monkeypatch.setattr(shown.time, "monotonic", lambda: now[0])
    with shown._lines("solve", 10) as update:
        update(6, "f")
        now[0] = 20.0
        update(8, "h")
    assert capsys.readouterr().err == "solve: 80% of 10, about 20 s left\n"


def test_pulses_add_up_and_a_broken_one_counts_nothing(tmp_path: Path) -> None:
    write_pulse(tmp_path / "a.pulse", 1, 4)
    write_pulse(tmp_path / "b.pulse", 2, 4)
    (tmp_path / "c.pulse").write_text("", encoding="ascii")
    assert pulse_sum(tmp_path) == pytest.approx(0.75)
    assert pulse_sum(None) == 0.0
