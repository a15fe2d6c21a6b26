"""The frame of studies on a study of three numbers: cases kept, settings held to, code that changed, and what a result carries."""

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

from datasets.errors import InputError
from studies.frame import command, conduct, digests
from studies.frame.conduct import Conduct
from studies.frame.pages import drawn_from_digest, picture_path, text_of, write_pages
from studies.frame.results import Result, read_result, write_result
from studies.frame.study import Case, Plan, Settings, Study
from studies.reporting.figures import drawn_from
from tumble.engine import Serial


@dataclass(frozen=True)
class Powers(Settings):
    exponents: tuple[int, ...] = (1, 2)


def cases(settings: Powers, particles: Path | None) -> list[Case]:
    return [
        Case(f"{k}-{e}", {"k": k, "exponent": e}, {"base": settings.seed + k, "exponent": e})
        for k in range(settings.count)
        for e in settings.exponents
    ]


def power(payload: dict[str, Any]) -> list[dict[str, Any]]:
    if payload["base"] == 13:
        raise ValueError("thirteen")
    return [{"value": payload["base"] ** payload["exponent"]}]


def page(result: Result) -> list[str]:
    return ["# Powers", f"{len(result.rows)} rows."]


PLAN = Plan(Powers(seed=3, count=2), Powers(seed=3, count=50), cases, power, ("studies.frame.study",))
STUDY = Study("powers", "What are powers?", PLAN, page, lambda result: Figure((1, 1)), "studies.frame.pages")


def measured(out: Path, **changed: Any) -> Result:
    return conduct.conduct(STUDY, replace(PLAN.small, **changed), Conduct(Serial(), out, quiet=True))


def test_rows_with_labels_first_and_what_made_them(tmp_path: Path) -> None:
    result = measured(tmp_path)
    assert list(result.rows.columns) == ["k", "exponent", "value", "cpu_s"]
    assert result.rows["value"].tolist() == [3, 9, 4, 16]
    assert result.settings == {"size": "full", "seed": 3, "count": 2, "exponents": (1, 2), "bodies": "procedural"}
    assert set(result.code) == {"datasets", "synth", "estimator"}
    assert result.failed == ()


def test_cases_are_measured_once_and_more_can_be_asked_for(tmp_path: Path) -> None:
    measured(tmp_path)
    asked = []

    def counted(payload: dict[str, Any]) -> list[dict[str, Any]]:
        asked.append(payload["base"])
        return power(payload)

    again = Study("powers", "", replace(PLAN, task=counted), page, STUDY.picture, STUDY.module)
    result = conduct.conduct(again, replace(PLAN.small, count=3), Conduct(Serial(), tmp_path, quiet=True))
    assert asked == [5, 5]
    assert result.rows["value"].tolist() == [3, 9, 4, 16, 5, 25]


@pytest.mark.parametrize(("changed", "told"), [({"seed": 4}, "seed was 3 and is now 4"), ({"exponents": (1,)}, "exponents was [1, 2]")])
def test_other_settings_are_refused_with_the_difference(tmp_path: Path, changed: dict[str, Any], told: str) -> None:
    measured(tmp_path)
    with pytest.raises(InputError, match="expected the same settings") as refused:
        measured(tmp_path, **changed)
    assert told in str(refused.value)


def test_changed_code_never_shows_old_numbers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    measured(tmp_path)
    before = {path.name for path in tmp_path.iterdir()}
    monkeypatch.setattr(conduct, "of_libraries", lambda modules: {"estimator": "changed"})
    assert measured(tmp_path).code == {"estimator": "changed"}
    assert len({path.name for path in tmp_path.iterdir()} - before) == 1


def test_a_case_that_fails_is_told_and_loses_no_other(tmp_path: Path) -> None:
    result = measured(tmp_path, seed=12)
    assert result.rows["value"].tolist() == [12, 144]
    assert [message.split(":")[0] for message in result.failed] == ["1-1", "1-2"]
    assert "**Cases that could not be measured and are missing here: 2.**" in text_of(STUDY, write_result(result, tmp_path))


def test_a_result_is_read_as_written_and_not_where_rows_were_changed(tmp_path: Path) -> None:
    written = write_result(measured(tmp_path / "out"), tmp_path)
    assert read_result("powers", tmp_path).rows.equals(written.rows)
    document = json.loads((tmp_path / "powers.json").read_text())
    assert document["sources"] == digests.of_modules(PLAN.modules)
    rows = tmp_path / "powers.csv"
    rows.write_text(rows.read_text().replace("16", "17"))
    with pytest.raises(InputError, match="expected rows with the digest"):
        read_result("powers", tmp_path)


def test_a_picture_says_what_it_was_drawn_from(tmp_path: Path) -> None:
    result = write_result(measured(tmp_path / "out"), tmp_path)
    write_pages(STUDY, result, tmp_path)
    assert drawn_from(picture_path("powers", tmp_path)) == drawn_from_digest(STUDY, result)
    assert (tmp_path / "powers.md").read_text() == text_of(STUDY, result)


def test_the_command_runs_lists_and_refuses(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        command.main([STUDY], lambda results: ["# Together", *results], ["powers", "--small", "--out", str(tmp_path), "--jobs", "1", "-q"])
        == 0
    )
    assert (tmp_path / "powers" / "powers.md").is_file()
    assert command.main([STUDY], lambda results: ["# Together", *results], ["powers", "--page", "--out", str(tmp_path)]) == 0
    assert (
        command.main([STUDY], lambda results: ["# Together", *results], ["powers", "--small", "--seed", "9", "--out", str(tmp_path), "-q"])
        == 2
    )
    assert "seed was 3 and is now 9" in capsys.readouterr().err
    assert command.main([STUDY], lambda results: ["# Together", *results], ["powder"]) == 2
    assert "expected names among powers, got powder" in capsys.readouterr().err
    assert command.main([STUDY], lambda results: ["# Together", *results], ["--list", "--docs", str(tmp_path)]) == 0
    assert "no committed result" in capsys.readouterr().out


def test_the_page_over_all_has_what_is_committed(tmp_path: Path) -> None:
    write_result(measured(tmp_path / "out"), tmp_path / "results")
    assert command.main([STUDY], lambda results: ["# Together", *results], ["--together", "--docs", str(tmp_path)]) == 0
    assert (tmp_path / "studies" / "uncertainty.md").read_text() == "# Together\npowers\n"


def test_other_bodies_under_the_same_names_are_refused(tmp_path: Path) -> None:
    bodies, out = tmp_path / "bodies", tmp_path / "out"
    bodies.mkdir()
    how = Conduct(Serial(), out, particles=bodies, quiet=True)
    (bodies / "stone.ply").write_bytes(b"ply")
    conduct.conduct(STUDY, PLAN.small, how)
    (bodies / "stone.ply").write_bytes(b"another")
    with pytest.raises(InputError, match=r"bodies\.stone\.ply|stone\.ply"):
        conduct.conduct(STUDY, PLAN.small, how)


def test_settings_that_are_damaged_are_named(tmp_path: Path) -> None:
    measured(tmp_path)
    (tmp_path / "study.json").write_text("{")
    with pytest.raises(InputError, match=r"study\.json: expected the settings of a study, got no JSON"):
        measured(tmp_path)


def test_other_versions_measure_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    measured(tmp_path)
    before = {path.name for path in tmp_path.iterdir()}
    monkeypatch.setattr(conduct, "versions", lambda: dict.fromkeys(conduct.SOFTWARE, "0"))
    measured(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} - before


def test_cases_that_cannot_be_made_leave_no_settings_behind(tmp_path: Path) -> None:
    def none(settings: Powers, particles: Path | None) -> list[Case]:
        raise InputError("no bodies")

    broken = Study("powers", "", replace(PLAN, cases=none), page, STUDY.picture, STUDY.module)
    with pytest.raises(InputError, match="no bodies"):
        conduct.conduct(broken, PLAN.small, Conduct(Serial(), tmp_path / "out", quiet=True))
    assert not (tmp_path / "out").exists()


def test_a_seed_below_nothing_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        command.main([STUDY], lambda _: [], ["--seed", "-1"])
    assert "expected a whole number of at least 0, got -1" in capsys.readouterr().err
