"""Cases of a committed result that are made again by changed code: the same rows keep the result, other ones refuse it."""

import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from datasets.errors import InputError
from studies.frame import again, command, conduct, digests
from studies.frame.again import made_again
from studies.frame.conduct import Conduct
from studies.frame.pages import text_of
from studies.frame.results import Result, read_result, write_result
from studies.frame.study import Case, Plan, Settings, Study
from tumble.engine import Serial

TIMES = itertools.count(1.5)
"""No case takes as long as before."""
RARE = 14
"""From this case on each has a column that no other has: a draw of five always lacks one."""


@dataclass(frozen=True)
class Squares(Settings):
    power: tuple[int, ...] = (2,)


def cases(settings: Squares, particles: Path | None) -> list[Case]:
    return [Case(f"{k:02d}", {"k": k}, {"k": k, "power": settings.power[0]}) for k in range(settings.count)]


def square(payload: dict[str, Any]) -> list[dict[str, Any]]:
    told = {"value": payload["k"] ** payload["power"] / 3.0, "even": payload["k"] % 2 == 0, "word": "x" * payload["k"]}
    rare = {f"rare_{payload['k']}": 1.5} if payload["k"] >= RARE else {}
    return [{**told, **rare, "fit_cpu_s": next(TIMES)} for _ in range(2)]


def page(result: Result) -> list[str]:
    return ["# Squares", f"{len(result.rows)} rows."]


PLAN = Plan(Squares(seed=3, count=4), Squares(seed=3, count=20), cases, square, ("studies.frame.study",))
STUDY = Study("squares", "What are squares?", PLAN, page, lambda result: Figure((1, 1)), "studies.frame.pages")


def how(folder: Path, particles: Path | None = None) -> Conduct:
    return Conduct(Serial(), folder, particles=particles, quiet=True)


@pytest.fixture
def before(tmp_path: Path) -> Result:
    return write_result(conduct.conduct(STUDY, PLAN.full, how(tmp_path / "before")), tmp_path / "results")


def changed_code(monkeypatch: pytest.MonkeyPatch) -> None:
    changed = {**digests.of_libraries(PLAN.modules), "estimator": "changed"}
    for module in (conduct, command):
        monkeypatch.setattr(module, "of_libraries", lambda modules: changed)


def wrong_from(first: int, by: float) -> Study:
    def wrong(payload: dict[str, Any]) -> list[dict[str, Any]]:
        rows = square(payload)
        return [{**row, "value": row["value"] * (1.0 + by * (payload["k"] >= first))} for row in rows]

    return replace(STUDY, plan=replace(PLAN, task=wrong))


def test_the_same_rows_keep_a_result_and_are_told(before: Result, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    changed_code(monkeypatch)
    assert command.state(STUDY, tmp_path / "results").endswith("made with other code of estimator")
    result, different = made_again(STUDY, before, 5, how(tmp_path / "again"))
    assert (different, result.again and (result.again.cases, result.again.of)) == ([], (5, 20))
    written = write_result(result, tmp_path / "results")
    assert written.rows_digest == before.rows_digest
    assert written.code == before.code
    assert command.state(STUDY, tmp_path / "results").endswith("of 20 cases 5, drawn at random, come out the same with this code")
    assert "Of 20 cases 5, drawn at random, are the same with code of" in " ".join(text_of(STUDY, written).split())


@pytest.mark.parametrize(("by", "others"), [(1e-3, 8), (1e-7, 0)])
def test_rows_that_are_others_are_named(before: Result, tmp_path: Path, by: float, others: int) -> None:
    result, different = made_again(wrong_from(12, by), before, 20, how(tmp_path / "again"))
    assert different == [f"{k:02d}" for k in range(12, 12 + others)]
    assert (result.again is None) == bool(different)


def test_rows_that_are_missing_are_others(before: Result, tmp_path: Path) -> None:
    fewer = replace(STUDY, plan=replace(PLAN, task=lambda payload: square(payload)[:1]))
    assert len(made_again(fewer, before, 3, how(tmp_path / "again"))[1]) == 3


def test_other_bodies_are_refused(before: Result, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected procedural bodies as in its result, got scanned ones"):
        made_again(STUDY, before, 3, how(tmp_path / "again", particles=tmp_path))


def test_settings_are_those_of_the_result(before: Result, tmp_path: Path) -> None:
    assert again.settings_of(STUDY, read_result("squares", tmp_path / "results")) == PLAN.full


def test_the_command_tells_and_refuses(before: Result, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "studies").mkdir()
    words = ["squares", "--again", "4", "--docs", str(tmp_path), "--out", str(tmp_path / "out"), "--jobs", "1", "-q"]
    assert command.main([STUDY], lambda results: [], words) == 0
    assert read_result("squares", tmp_path / "results").again is not None
    assert command.main([wrong_from(0, 0.1)], lambda results: [], [*words[:-4], str(tmp_path / "other"), *words[-3:]]) == 1
    assert "it has to be measured anew" in capsys.readouterr().out
