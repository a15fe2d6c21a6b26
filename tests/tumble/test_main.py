"""Help and plain sentences of the command line."""

import importlib
import json
from pathlib import Path

import pytest

from tumble.cli import main as command_line


@pytest.mark.parametrize("verb", [name for name, _ in command_line.VERBS])
def test_every_help_ends_in_an_example(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        command_line.main([verb, "--help"])
    assert ended.value.code == 0
    lines = capsys.readouterr().out.strip().splitlines()
    assert lines[-2].strip() == "example:"
    assert lines[-1].strip().startswith(f"tumble {verb}")


def test_the_example_of_every_help_parses() -> None:
    for verb, _ in command_line.VERBS:
        parser = importlib.import_module(f"tumble.cli.{verb.replace('-', '_')}").parser()
        words = (parser.epilog or "").splitlines()[-1].split()
        parser.parse_args(words[2:])


def test_help_lists_every_verb(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["--help"]) == 0
    out = capsys.readouterr().out
    assert all(f"  {name} " in out for name, _ in command_line.VERBS)
    assert out.strip().splitlines()[-2] == "example:"


def test_an_unknown_verb_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["juggle"]) == 2
    assert "'juggle'" in capsys.readouterr().err


def test_doctor_reports_as_json(capsys: pytest.CaptureFixture[str]) -> None:
    code = command_line.main(["doctor", "--json"])
    findings = {finding["name"]: finding for finding in json.loads(capsys.readouterr().out)}
    assert findings["datasets package"]["good"]
    assert findings["renderer scalar_rgb"]["needed"]
    assert code == int(any(finding["needed"] and not finding["good"] for finding in findings.values()))
    assert all(finding["what_to_type"] for finding in findings.values() if not finding["good"])


def test_a_missing_input_is_exit_code_2(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert command_line.main(["score", str(tmp_path / "no"), "--truth", str(tmp_path / "nothing"), "--out", str(tmp_path / "s")]) == 2
    assert "expected the truth folder" in capsys.readouterr().err
