"""The tutorial's page is that of its result, its commands are ones that the program takes, and its files and pictures are there."""

import importlib
import json
import re
import shlex
from pathlib import Path

import pytest

from datasets.recipes.toml_files import load_recipe
from estimator.effects.plug_ins import load_plug_in
from scripts.pages import tutorial
from scripts.pages.tutorial import PACKAGES, PICTURES, STEPS, program_digest, without_progress
from scripts.pages.tutorial_page import page_text
from tumble.cli.main import VERBS

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "tutorial.md").read_text(encoding="utf-8")
RESULT = json.loads((DOCS / "results" / "tutorial.json").read_text(encoding="utf-8"))
COMMANDS = sorted(set(re.findall(r"^(?:\$ | *)(tumble [a-z].*)$", PAGE, re.MULTILINE)))
MOST_BYTES = 1_500_000


def test_the_page_is_that_of_its_result() -> None:
    assert page_text(RESULT, DOCS / "tutorial_files") == PAGE
    assert [step["command"] for step in RESULT["steps"].values()] == [step.command for step in STEPS]
    assert len(COMMANDS) >= len(STEPS)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_is_one_that_the_program_takes(command: str) -> None:
    verb, *words = shlex.split(command)[1:]
    assert verb in dict(VERBS)
    parsed = importlib.import_module(f"tumble.cli.{verb.replace('-', '_')}").parser().parse_args(words)
    assert parsed is not None


def test_pictures_and_links_lead_somewhere() -> None:
    targets = [target.split("#")[0] for target in re.findall(r"\]\(([^)]+)\)", PAGE)]
    for target in filter(None, targets):
        assert (DOCS / target).exists(), target
    pictures = sorted((DOCS / "images" / "tutorial").iterdir())
    assert {path.stem for path in pictures} == {name for name, *_ in PICTURES}
    assert all(f"images/tutorial/{path.name}" in PAGE for path in pictures)
    assert sum(path.stat().st_size for path in pictures) < MOST_BYTES


def test_no_path_of_the_machine_it_was_written_on_is_in_it() -> None:
    assert re.findall(r"(?<![\w.\]])/(?:home|root|tmp|work|usr|Users)/", PAGE) == []


def test_the_files_that_the_user_begins_with_are_good() -> None:
    files = DOCS / "tutorial_files"
    assert {step.brings for step in STEPS if step.brings} <= {path.name for path in files.iterdir() if path.is_file()}
    assert [load_recipe(files / name).effects[0].key for name in ("drag.toml", "vent.toml")] == ["quadratic_drag", "outgassing_thrust"]
    assert load_plug_in(f"{files / 'my_vent.py'}:Vent").entry.key == "vent"


def test_lines_of_progress_are_shortened_visibly() -> None:
    printed = "register: 33% of 3, about 5 s left\nregister: 67% of 3, about 2 s left\nDone.  \nladder: 50% of 2, about 1 s left\n"
    assert without_progress(printed) == "…\nDone.\n…"


def test_a_run_is_of_the_program_it_was_made_with(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tutorial, "ROOT", tmp_path)
    code, compiled = tmp_path / PACKAGES[0] / "code.py", tmp_path / PACKAGES[0] / "__pycache__" / "code.nbi"
    compiled.parent.mkdir(parents=True)
    code.write_text("one = 1")
    before = program_digest()
    compiled.write_text("made on the way")
    assert program_digest() == before
    code.write_text("one = 2")
    assert program_digest() != before


def test_steps_run_again_where_the_program_has_changed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run: list[str] = []
    digests = iter(("one", "one", "another"))
    monkeypatch.setattr(tutorial, "program_digest", lambda: next(digests))
    monkeypatch.setattr(tutorial, "facts_of", lambda _work: {})
    monkeypatch.setattr(tutorial, "run_step", lambda step, _work: run.append(step.key) or {"printed": "", "written": ""})
    for times in (1, 1, 2):
        tutorial.run_steps(tmp_path)
        assert len(run) == times * len(STEPS)
