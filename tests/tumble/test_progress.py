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


def test_the_time_left_does_not_grow_while_nothing_is_learned() -> None:
    pace = shown.Pace(0.0)
    assert pace.left_s(5.0, 0.0, 3) is None
    assert pace.left_s(10.0, 1.0, 3) == 20.0
    told = [pace.left_s(now, 1.0, 3) for now in (15.0, 25.0, 30.0)]
    assert told == [15.0, 5.0, 0.0]
    assert pace.left_s(31.0, 1.0, 3) is None
    assert pace.left_s(40.0, 2.0, 3) == 20.0
    assert pace.left_s(41.0, 1.9, 3) == 19.0  # a part that is not counted twice for a moment
    assert pace.left_s(60.0, 3.0, 3) == 0.0


def test_an_item_that_takes_longer_is_said_to(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    now = [0.0]
    monkeypatch.setattr(shown.time, "monotonic", lambda: now[0])
    with shown._lines("estimate", 2) as update:
        for at, done in ((20.0, 1.0), (35.0, 1.0), (60.0, 1.0)):
            now[0] = at
            update(done, "a")
    assert capsys.readouterr().err.splitlines() == [
        "estimate: 50% of 2, about 20 s left",
        "estimate: 50% of 2, about 5 s left",
        "estimate: 50% of 2, this one takes longer than those before",
    ]


def test_the_bar_of_a_terminal_has_the_time_left_and_names_are_text(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(shown.sys.stderr, "isatty", lambda: True)
    monkeypatch.setattr(shown, "RESUMED_S", 0.0)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setenv("TERM", "xterm")
    with progress("estimate", 2, quiet=False) as advance:
        advance("[bold]a[/nothing]")
        shown.time.sleep(0.3)
    err = capsys.readouterr().err
    assert "[bold]a[/nothing]" in err
    assert " left" in err


def test_pulses_add_up_and_a_broken_one_counts_nothing(tmp_path: Path) -> None:
    write_pulse(tmp_path / "a.pulse", 1, 4)
    write_pulse(tmp_path / "b.pulse", 2, 4)
    (tmp_path / "c.pulse").write_text("", encoding="ascii")
    assert pulse_sum(tmp_path) == pytest.approx(0.75)
    assert pulse_sum(None) == 0.0
