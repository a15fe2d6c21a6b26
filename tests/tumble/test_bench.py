"""The benchmarks' verb: figures, limits, and what is said of a benchmark that is not there."""

import json
from pathlib import Path

import pytest

from tumble.cli import bench
from tumble.cli.main import main

FIGURES = [
    {"name": "time", "value": 2.0, "unit": "s", "limit": 3.0, "direction": "lower"},
    {"name": "ratio", "value": 4.0, "unit": "1", "limit": 5.0, "direction": "higher"},
    {"name": "said only", "value": 9.0, "unit": "GB"},
]


def test_limits_have_a_direction() -> None:
    assert [bench.within(figure) for figure in FIGURES] == [True, False, True]


def test_a_missed_limit_is_exit_code_1_and_is_stored(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(bench, "benchmarks", lambda: ("kernel",))
    monkeypatch.setattr(bench, "measure", lambda name: FIGURES)
    assert main(["bench", "--out", str(tmp_path / "b")]) == 1
    out = capsys.readouterr().out
    assert "missed" in out
    assert json.loads((tmp_path / "b" / "figures.json").read_text(encoding="utf-8")) == {"kernel": FIGURES}


def test_an_unknown_benchmark_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--only", "juggling", "--out", str(tmp_path / "b")]) == 2
    assert "--only juggling: expected one of" in capsys.readouterr().err


def test_every_benchmark_is_found() -> None:
    there = {
        path.stem.removeprefix("bench_") for path in (Path(__file__).resolve().parents[2] / "scripts" / "benchmarks").glob("bench_*.py")
    }
    assert set(bench.benchmarks()) == there
