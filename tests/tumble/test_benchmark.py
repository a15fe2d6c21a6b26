"""Benchmark sets: made, checked, told apart from copies that are not whole, and the same as when their targets were listed."""

import json
from pathlib import Path

import pytest

from datasets.recipes.recipe import Recipe
from synth.sequence import plan_sequence, truth_of
from tumble.benchmarks import sets
from tumble.benchmarks.papers import croissant, write_targets
from tumble.benchmarks.sets import differing, read_set, read_targets, set_names, target_of, targets_file
from tumble.cli.main import main

SMALL = """
version = "0.1.0"
published = "2026-11-27"
title = "Small"
what = "One flight."
why = "A test."
licence = "CC0-1.0"
megabytes = 1
minutes = 1
[datasets.one]
seed = 4
motion = { frames = 6 }
rig = { drops = 1 }
"""


@pytest.fixture
def small(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A made set, whose list of targets is that of the code as it is."""
    (tmp_path / "sets").mkdir()
    (tmp_path / "sets" / "small.toml").write_text(SMALL)
    monkeypatch.setattr(sets, "FOLDER", tmp_path / "sets")
    made = tmp_path / "made"
    assert main(["benchmark", "make", "small", "--out", str(made), "--jobs", "1", "-q"]) == 0
    (tmp_path / "sets" / "small.targets.csv").write_bytes((made / "targets.csv").read_bytes())
    return made


def test_a_set_is_whole_with_its_card_manifest_and_description(small, capsys) -> None:
    assert main(["benchmark", "verify", str(small)]) == 0
    assert "whole, and small 0.1.0" in capsys.readouterr().out
    assert "One flight." in (small / "card.md").read_text()
    told = json.loads((small / "croissant.json").read_text())
    assert {"url", "creator", "datePublished", "license", "description", "name", "version"} <= set(told)
    assert told["conformsTo"] == "http://mlcommons.org/croissant/1.0"
    assert {entry["@type"] for entry in told["distribution"]} == {"cr:FileObject"}
    listed = {line.partition("  ")[2] for line in (small / "manifest.sha256").read_text().splitlines()}
    assert {entry["contentUrl"] for entry in told["distribution"]} == listed
    assert all((small / name).is_file() for name in listed)


def test_what_is_missing_changed_or_too_many_is_named(small, capsys) -> None:
    observation = next(small.rglob("observation.json"))
    observation.write_text(observation.read_text() + " ")
    next(small.rglob("motion.npz")).unlink()
    (small / "stray.txt").write_text("")
    assert main(["benchmark", "verify", str(small)]) == 1
    said = capsys.readouterr().out
    assert "observation.json: changed" in said
    assert "motion.npz: missing" in said
    assert "stray.txt: not in the manifest" in said


def test_a_damaged_set_is_not_made_whole_by_going_on(small, capsys) -> None:
    next(small.rglob("motion.npz")).unlink()
    assert main(["benchmark", "make", "small", "--out", str(small), "--jobs", "1", "--resume"]) == 2
    assert "motion.npz: missing" in capsys.readouterr().err
    assert main(["benchmark", "verify", str(small)]) == 1


def test_a_copy_is_held_against_its_own_truth_not_against_its_list(small, tmp_path, capsys) -> None:
    recipe = (tmp_path / "sets" / "small.toml").read_text()
    (tmp_path / "sets" / "small.toml").write_text(recipe.replace("seed = 4", "seed = 5"))
    assert main(["benchmark", "make", "small", "--out", str(tmp_path / "other"), "--jobs", "1", "-q"]) == 0
    assert main(["benchmark", "verify", str(tmp_path / "other")]) == 1
    assert "expected the velocities of the list" in capsys.readouterr().out


def test_another_version_is_told(small, tmp_path, capsys) -> None:
    recipe = (tmp_path / "sets" / "small.toml").read_text()
    (tmp_path / "sets" / "small.toml").write_text(recipe.replace('"0.1.0"', '"0.2.0"'))
    assert main(["benchmark", "verify", str(small)]) == 1
    assert "expected small 0.2.0, got small 0.1.0" in capsys.readouterr().out


def test_sequences_that_are_not_the_listed_ones_are_named(small, tmp_path, capsys) -> None:
    rows = read_targets(small / "targets.csv")
    rows[0]["vx"] = float(rows[0]["vx"]) + 1e-3
    write_targets([*rows, {**rows[0], "sequence": "another"}], tmp_path / "sets" / "small.targets.csv")
    assert main(["benchmark", "verify", str(small)]) == 1
    said = capsys.readouterr().out
    assert "expected the velocities of the list" in said
    assert "one/another: expected by the list of targets" in said


@pytest.mark.parametrize(("words", "said"), [(["show", "nothing"], "expected a benchmark set"), (["verify", "nowhere"], "manifest")])
def test_bad_input_is_named(tmp_path, capsys, words, said) -> None:
    assert main(["benchmark", *words]) == 2
    assert said in capsys.readouterr().err


def test_a_broken_manifest_is_named_with_its_line(small, capsys) -> None:
    (small / "manifest.sha256").write_text("nonsense\n")
    assert main(["benchmark", "verify", str(small)]) == 2
    assert "line 1" in capsys.readouterr().err


def test_every_set_has_a_card_and_a_description(capsys) -> None:
    assert main(["benchmark", "list"]) == 0
    listed = capsys.readouterr().out
    for name in set_names():
        told = read_set(name)
        assert f"{name} {told.version}" in listed
        assert bool(told.recipes) != bool(told.challenge)
        assert told.seeds
        assert main(["benchmark", "show", name]) == 0
        assert told.why in capsys.readouterr().out
        assert croissant(told, {})["name"] == name


@pytest.mark.parametrize("name", [name for name in set_names() if read_set(name).recipes])
def test_a_set_has_the_sequences_of_its_list(name: str) -> None:
    """The first of each dataset; a change of nature that moves them needs another version of the set."""
    told, listed = read_set(name), read_targets(targets_file(name))
    for dataset, recipe in told.recipes.items():
        assert isinstance(recipe, Recipe)
        mine = [row for row in listed if row["dataset"] == dataset]
        assert len(mine) == recipe.sequences
        assert differing([target_of(dataset, truth_of(plan_sequence(recipe, 0)))], mine[:1]) == []
