"""The slowest campaigns are those that are explained again."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from datasets.errors import InputError
from scripts.benchmarks import time_explain


def challenge(root: Path, name: str, cpu_s: dict[str, float]) -> tuple[Path, Path]:
    made, answers = root / name, root / f"{name}_answers"
    answers.mkdir(parents=True)
    for campaign, cpu in cpu_s.items():
        (made / "campaigns" / campaign / "observations").mkdir(parents=True)
        (answers / f"{campaign}.answer.json").write_text(json.dumps({"found": ["gravity"], "cpu_s": {"whole": cpu}}))
    return made, answers


def test_the_slowest_of_all_are_timed_with_every_number_of_processes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (first, answers), (second, others) = challenge(tmp_path, "A", {"c001": 10.0, "c002": 99.0}), challenge(tmp_path, "B", {"c001": 50.0})
    asked = []

    def run(words: list[str], *, check: bool) -> None:
        assert not check
        out, jobs = Path(words[words.index("--out") + 1]), words[words.index("--jobs") + 1]
        asked.append((words[3:5], jobs))
        out.mkdir(parents=True)
        found = "gravity" if jobs == "1" else "linear_drag"
        (out / "diagnosis.json").write_text(json.dumps({"model": [], "steps": [{"added": found}]}))

    monkeypatch.setattr(time_explain, "subprocess", SimpleNamespace(run=run))
    result = tmp_path / "times.json"
    options = ["--slowest", "2", "--jobs", "1", "2", "--result", str(result)]
    assert time_explain.main([str(first), str(second), "--answers", str(answers), str(others), *options]) == 0
    slowest = [["explain", str(first / "campaigns" / "c002")], ["explain", str(second / "campaigns" / "c001")]]
    assert asked == [(words, jobs) for words in slowest for jobs in ("1", "2")]
    written = json.loads(result.read_text())
    assert written["of"] == 3
    assert [(run["campaign"], run["jobs"], run["same"]) for run in written["runs"]] == [
        ("A/c002", 1, True),
        ("A/c002", 2, False),
        ("B/c001", 1, True),
        ("B/c001", 2, False),
    ]
    told = capsys.readouterr().out.splitlines()
    assert told[0].endswith("(99 s of CPU before; gravity): HELD")
    assert "NOT what was found before" in told[1]


def test_answers_of_another_challenge_are_refused(tmp_path: Path) -> None:
    made, answers = challenge(tmp_path, "A", {"c001": 1.0})
    with pytest.raises(InputError, match="expected a folder for each of 1 challenges, got 2"):
        time_explain.main([str(made), "--answers", str(answers), str(answers)])
    empty = tmp_path / "empty"
    empty.mkdir()
    with pytest.raises(InputError, match="expected answers to campaigns of"):
        time_explain.main([str(made), "--answers", str(empty)])
