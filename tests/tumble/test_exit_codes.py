"""Exit codes mean the same for every verb, and are those of the table in the documentation."""

import errno
import importlib
import shlex
from pathlib import Path

import pytest

from datasets.errors import InputError
from tests.tumble import tasks
from tumble.cli import exit_codes
from tumble.cli.main import VERBS, main, usage
from tumble.cli.outcomes import NOTHING_TO_GO_ON_WITH, exit_code, report_failures
from tumble.engine import Item, Outcome, Processes, State, run
from tumble.output_directory import Run, output_directory
from tumble.written_files import read_run

PAGE = Path(__file__).resolve().parents[2] / "docs" / "command_line.md"
SHORT = ["--set", "sequences=1", "--set", "motion.frames=5", "--set", "rig.drops=2", "--set", 'tier="silhouette"', "--jobs", "1"]
FAULT = Outcome("b", State.FAILED, "ValueError: oh", fault=True, traceback="Traceback: in the worker")
DONE, REFUSED = Outcome("a", State.DONE), Outcome("c", State.FAILED, "expected one, got two")


def example(verb: str) -> list[str]:
    """A command line that parses."""
    parser = importlib.import_module(f"tumble.cli.{verb.replace('-', '_')}").parser()
    return shlex.split((parser.epilog or "").splitlines()[-1])[1:]


def test_the_page_has_the_table() -> None:
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    assert [f"| {code} | {meaning} |" for code, meaning in exit_codes.MEANING.items()] == [row for row in rows if row[2].isdigit()]
    assert exit_codes.IN_SHORT in usage()
    assert all(str(code) in exit_codes.IN_SHORT for code in exit_codes.MEANING)


@pytest.mark.parametrize("verb", [name for name, _ in VERBS])
@pytest.mark.parametrize(
    ("error", "code", "sentence"),
    [
        (InputError("x.json: expected a, got b."), 2, "tumble: x.json: expected a, got b."),
        (OSError(errno.ENOSPC, "No space left on device"), 2, "the disk is full"),
        (KeyboardInterrupt(), 130, "tumble: stopped. Finished items are whole."),
        (ZeroDivisionError("a mistake in the code"), 3, "tumble: ZeroDivisionError: a mistake in the code"),
    ],
)
def test_what_a_verb_raises_becomes_a_code_and_a_sentence(
    verb: str, error: BaseException, code: int, sentence: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fail(_arguments: object) -> int:
        raise error

    monkeypatch.setattr(importlib.import_module(f"tumble.cli.{verb.replace('-', '_')}"), "run", fail)
    assert main(example(verb)) == code
    quiet = capsys.readouterr().err
    assert sentence in quiet
    assert "Traceback" not in quiet
    assert main([*example(verb), "-v"]) == code
    loud = capsys.readouterr().err
    assert ("Traceback" in loud) == isinstance(error, Exception)
    if code == exit_codes.OWN_FAULT:
        assert f"a fault of tumble {verb} itself, not of the input. -v shows where" in quiet


@pytest.mark.parametrize("verb", [name for name, _ in VERBS])
def test_a_command_line_that_cannot_be_read_is_bad_input(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([verb, "--no-such-option"])
    assert ended.value.code == exit_codes.BAD_INPUT
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    assert exit_codes.IN_SHORT in capsys.readouterr().out


@pytest.mark.parametrize(
    ("outcomes", "code"),
    [
        ((), 0),
        ((DONE,), 0),
        ((DONE, REFUSED), 1),
        ((DONE, FAULT), 1),
        ((REFUSED,), 2),
        ((REFUSED, FAULT), 3),
    ],
)
def test_items_make_the_code_of_a_run(outcomes: tuple[Outcome, ...], code: int) -> None:
    assert exit_code(outcomes) == code


@pytest.mark.parametrize("jobs", [1, 2])
def test_the_traceback_of_an_item_is_kept_and_shown_where_asked_for(jobs: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    work = [Item(text, {"text": text, "product": str(tmp_path / f"{text}.txt")}, tmp_path / f"{text}.txt") for text in ("good", "bad")]
    outcomes = run(tasks.fail_on_bad, work, executor=Processes(jobs), advance=lambda _name: None)
    for verbose in (False, True):
        with output_directory(tmp_path / f"{verbose}", Run("estimate", {}, reads=()), resume=False, force=False) as out:
            report_failures(out, outcomes, verbose=verbose)
        said = capsys.readouterr().err
        assert "tumble: bad failed: ValueError: this one is bad" in said
        assert ("in fail_on_bad" in said) == verbose
        assert ("-v shows where" in said) != verbose
        kept = (read_run(tmp_path / f"{verbose}") or {})["failures"][0]
        assert "in fail_on_bad" in kept["traceback"]


def test_one_reason_of_many_is_said_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    names = [f"toss_{number:02d}" for number in range(46)]
    outcomes = [Outcome(name, State.FAILED, f"/data/{name}.csv: expected times in seconds, got none") for name in names]
    with output_directory(tmp_path, Run("estimate", {}, reads=()), resume=False, force=False) as out:
        report_failures(out, [*outcomes, REFUSED], verbose=False)
    said = capsys.readouterr().err.splitlines()
    assert said[0] == (
        "tumble: 46 of them (toss_00, toss_01, toss_02, toss_03, toss_04, toss_05, toss_06, toss_07 and 38 more) failed: "
        "/data/toss_00.csv: expected times in seconds, got none"
    )
    assert said[1] == "tumble: c failed: expected one, got two"
    assert len(said) == 3


def test_what_does_not_converge_is_no_measurement(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", *SHORT, "--out", str(tmp_path / "d"), "-q"]) == 0
    words = ["estimate", str(tmp_path / "d"), "--jobs", "1", "--out", str(tmp_path / "e")]
    assert main(words) == exit_codes.INCOMPLETE
    said = capsys.readouterr().out
    assert "cut_stone-0000: not enough frames: " in said
    assert said.splitlines()[-1] == NOTHING_TO_GO_ON_WITH
    assert main([*words, "--force", "-q"]) == exit_codes.INCOMPLETE
    assert "tumble: cut_stone-0000: not enough frames: " in capsys.readouterr().err


def test_where_no_item_is_there_nothing_comes_next(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "one" / "observation.json").write_text("{}", encoding="utf-8")
    words = ["estimate", str(tmp_path), "--jobs", "1", "--out", str(tmp_path / "out")]
    for _ in range(2):  # nothing is left behind that would hinder the second
        assert main(words) == exit_codes.BAD_INPUT
        assert capsys.readouterr().out.splitlines()[-1] == NOTHING_TO_GO_ON_WITH
