"""No verb removes what it reads, nor files that Tumble did not write, whatever is asked of it."""

import hashlib
import json
import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from datasets.errors import InputError
from tests.tumble.verb_inputs import COMMANDS, WRITES, make_inputs, options, parsers, paths_given
from tumble.cli import challenge
from tumble.cli.main import main
from tumble.output_directory import Run, output_directory

KILLED = '{"schema": "tumble-run", "verb": "render", "state": "unfinished", "failures": []}'
WITHOUT = ("cluster", "effect", "doctor", "benchmark list", "benchmark show", "benchmark verify")
WITH_OUT = {name: parser for name, parser in parsers() if name not in WITHOUT}
APART = {"challenge score": {"earlier"}}
"""Options that take several paths."""


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("inputs")
    make_inputs(folder)
    (folder / "plug_in").mkdir()
    assert main(["effect", "new", "MyWind", "--kind", "force", "--out", str(folder / "plug_in" / "my_wind.py"), "-q"]) == 0
    return folder


def content(folder: Path) -> dict[str, str]:
    """Digest of every file below a folder; what Python compiles does not count."""
    files = [path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def ways_to(path: Path, links: Path) -> Iterator[Path]:
    """The path, its folder, and both through a link and relative to where we are."""
    for number, place in enumerate((path, path.parent)):
        link = links / f"link{number}"
        link.symlink_to(place)
        yield from (place, link, Path(os.path.relpath(place)))


def test_every_verb_and_every_input_is_tried() -> None:
    assert set(COMMANDS) == set(WITH_OUT)
    for name, parser in WITH_OUT.items():
        assert "out" in options(parser)
        can_read = {key for key, action in options(parser).items() if action.type is Path and key not in WRITES | APART.get(name, set())}
        assert set(paths_given(parser, COMMANDS[name].split())) >= can_read, name


@pytest.mark.parametrize("verb", [name for name, command in COMMANDS.items() if command and name != "bench"])
@pytest.mark.parametrize("force", [(), ("--force",)])
def test_an_input_is_no_output_folder(
    verb: str,
    force: tuple[str, ...],
    inputs: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(inputs)
    before = content(inputs)
    words = COMMANDS[verb].split()
    for name, path in paths_given(WITH_OUT[verb], words).items():
        (tmp_path / name).mkdir()
        for out in ways_to(inputs / path, tmp_path / name):
            asked = [*verb.split(), *words, "--out", str(out), *(force if "force" in options(WITH_OUT[verb]) else ())]
            assert main(asked) == 2, asked
            said = capsys.readouterr().err
            assert "what is read" in said, asked
            assert content(inputs) == before, asked


def test_the_particles_that_a_recipe_names_are_read(
    inputs: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(inputs)
    assert main(["render", "--config", "config/recipe.toml", "--out", "particles", "--force"]) == 2
    assert "got one that holds particles/stone.ply" in capsys.readouterr().err


def test_force_does_not_empty_a_folder_inside_of_what_is_read(tmp_path: Path) -> None:
    inside = tmp_path / "observations" / "earlier"
    run = Run("estimate", {}, reads=())
    with output_directory(inside, run, resume=False, force=False):
        (inside / "one.estimate.json").write_text("{}", encoding="utf-8")
    with (
        pytest.raises(InputError, match="expected --force to replace a folder outside of what is read"),
        output_directory(inside, Run("estimate", {}, reads=(tmp_path / "observations",)), resume=False, force=True),
    ):
        pass
    assert (inside / "one.estimate.json").is_file()


@pytest.mark.parametrize("option", ["--out", "--result"])
def test_results_that_are_pooled_are_no_output(
    option: str, inputs: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(inputs)
    monkeypatch.setattr(challenge, "read_tables", lambda path, without: None)
    monkeypatch.setattr(challenge, "_seed_of", lambda path: 0)
    result = tmp_path / "one.json"
    result.write_text('{"acceptance": []}', encoding="utf-8")
    words = ["challenge", "score", "challenge", "answers", "--with", str(tmp_path / "two.json"), str(result)]
    assert main([*words, option, str(tmp_path if option == "--out" else result)]) == 2
    assert "read" in capsys.readouterr().err
    assert result.read_text(encoding="utf-8") == '{"acceptance": []}'


def test_challenge_make_does_not_remove_campaigns_of_others(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    mine = tmp_path / "campaigns" / "mine" / "observation.json"
    mine.parent.mkdir(parents=True)
    mine.write_text("{}", encoding="utf-8")
    for verb in (["challenge", "make", "--force", "--seed", "1"], ["challenge", "hidden", "--seed", "1"]):
        assert main([*verb, "--out", str(tmp_path)]) == 2
        assert "holds files that no run of tumble wrote (../campaigns/mine/observation.json)" in capsys.readouterr().err
    assert mine.is_file()
    assert not (tmp_path / "truth").exists()


def test_force_removes_what_a_run_wrote_and_refuses_what_it_did_not(tmp_path: Path) -> None:
    run = Run("challenge make", {}, reads=(), beside=("campaigns",))
    out, campaign = tmp_path / "truth", tmp_path / "campaigns" / "c001"

    def make(*, force: bool) -> None:
        with output_directory(out, run, resume=False, force=force):
            campaign.mkdir(parents=True)
            (campaign / "observation.json").write_text("{}", encoding="utf-8")
            (out / "anything.xyz").write_text("", encoding="utf-8")

    make(force=False)
    assert json.loads((out / "run.json").read_text(encoding="utf-8"))["files"] == ["../campaigns/c001/observation.json", "anything.xyz"]
    make(force=True)
    (campaign / "notes.txt").write_text("mine", encoding="utf-8")
    (out / "link").symlink_to(tmp_path)
    with pytest.raises(InputError, match=r"got \.\./campaigns/c001/notes\.txt and 1 more, which it did not write"):
        make(force=True)
    (campaign / "notes.txt").unlink()
    with pytest.raises(InputError, match="got link, which it did not write"):
        make(force=True)
    (out / "link").unlink()
    make(force=True)


def test_a_list_that_names_files_elsewhere_removes_none_of_them(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x", encoding="utf-8")
    out = tmp_path / "out"
    with output_directory(out, Run("score", {}, reads=()), resume=False, force=False):
        (out / "scores.csv").write_text("x", encoding="utf-8")
    document = json.loads((out / "run.json").read_text(encoding="utf-8"))
    (out / "run.json").write_text(json.dumps({**document, "files": [*document["files"], "../thesis.tex"]}), encoding="utf-8")
    with output_directory(out, Run("score", {}, reads=()), resume=False, force=True):
        pass
    assert (tmp_path / "thesis.tex").is_file()


def test_what_a_killed_run_left_is_known_by_its_names(tmp_path: Path) -> None:
    run = Run("render", {}, reads=())
    (tmp_path / "run.json").write_text(
        '{"schema": "tumble-run", "verb": "render", "state": "unfinished", "failures": []}', encoding="utf-8"
    )
    (tmp_path / "observations" / "one").mkdir(parents=True)
    (tmp_path / "observations" / "one" / ".outlines.npz.123.partial").write_text("x", encoding="utf-8")
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    with (
        pytest.raises(InputError, match=r"got notes\.txt, which it did not write"),
        output_directory(tmp_path, run, resume=False, force=True),
    ):
        pass
    (tmp_path / "notes.txt").unlink()
    with output_directory(tmp_path, run, resume=False, force=True):
        assert sorted(path.name for path in tmp_path.iterdir()) == [".tumble-lock", "run.json"]


def test_files_of_the_user_do_not_become_tumbles_by_resuming(tmp_path: Path) -> None:
    run = Run("render", {}, reads=())
    for number in range(2):
        with output_directory(tmp_path, run, resume=number > 0, force=False):
            (tmp_path / f"{number}.json").write_text("x", encoding="utf-8")
        (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    assert json.loads((tmp_path / "run.json").read_text(encoding="utf-8"))["files"] == ["0.json", "1.json"]


@pytest.mark.parametrize(
    ("command", "option"),
    [
        ("effect list", "--write"),
        ("challenge score challenge answers", "--result"),
        ("challenge limits", "--table"),
        ("gate --write --set recipes/quick.toml", ""),
    ],
)
def test_a_file_of_others_is_not_replaced(
    command: str, option: str, inputs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(inputs)
    file = tmp_path / "thesis.json"
    file.write_text("years of work", encoding="utf-8")
    assert main([*command.split(), *option.split(), str(file)]) == 2
    assert "expected a new file, or an earlier one of tumble to replace, got another" in capsys.readouterr().err
    assert file.read_text(encoding="utf-8") == "years of work"


def test_a_page_of_the_catalogue_is_replaced(tmp_path: Path) -> None:
    for _ in range(2):
        assert main(["effect", "list", "--write", str(tmp_path / "effects.md")]) == 0


def test_a_refused_run_leaves_nothing(tmp_path: Path) -> None:
    """Neither a description that makes the corrected command refuse, nor the folders that were made for it."""

    def fail() -> None:
        with output_directory(tmp_path / "a" / "b", Run("explain", {}, reads=()), resume=False, force=False):
            raise InputError("expected sequences, got none")

    with pytest.raises(InputError, match="expected sequences"):
        fail()
    assert list(tmp_path.iterdir()) == []
    theirs = tmp_path / "theirs"
    theirs.mkdir()
    (theirs / "thesis.tex").write_text("x", encoding="utf-8")
    with pytest.raises(InputError, match="holds files"), output_directory(theirs, Run("explain", {}, reads=()), resume=False, force=True):
        pass
    assert [path.name for path in theirs.iterdir()] == ["thesis.tex"]
