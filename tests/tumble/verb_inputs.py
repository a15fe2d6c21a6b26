"""Every verb that writes a folder, with a command that gives each of its inputs; the inputs are made in no time."""

import argparse
import importlib
import shutil
from collections.abc import Iterator, Mapping
from pathlib import Path

from tests.tumble.made_up import small_recipe
from tumble.challenge.cases import CASE_FILE, Case, case_folder, write_case
from tumble.challenge.limits import TABLE
from tumble.cli.main import VERBS

ROOT = Path(__file__).resolve().parents[2]
WRITES = {"out", "result", "table", "write"}
"""Options that name what a verb writes, not what it reads."""
SETTINGS = "--particle stone --config config/estimator.toml"
COMMANDS: Mapping[str, str] = {
    "quickstart": "",
    "render": "--config config/recipe.toml",
    "import": "videos/drop.cine --camera calibration/camera.toml --particle dataset/observations/one --gravity down",
    "calibrate camera": "boards/one.png --board chessboard:9x6:5mm",
    "calibrate rig": "boards/one.png --board chessboard:9x6:5mm",
    "calibrate gravity": "boards/one.png --camera calibration/camera.toml",
    "calibrate check": "calibration/camera.toml boards/one.png --board chessboard:9x6:5mm",
    "shape": "drops/one.npz dataset --rig calibration/camera.toml --background boards/one.png",
    "check": "dataset",
    "estimate": f"dataset {SETTINGS} --mesh mesh/body.ply --gravity=0,9.81,0 --effects plug_in/my_wind.py:MyWind",
    "compare": f"dataset {SETTINGS} --mesh mesh/body.ply --also plug_in/my_wind.py:MyWind",
    "diagnose": f"dataset {SETTINGS} --mesh mesh/body.ply --also plug_in/my_wind.py:MyWind",
    "explain": f"dataset {SETTINGS} --mesh mesh/body.ply --also plug_in/my_wind.py:MyWind",
    "ladder": f"dataset {SETTINGS} --mesh mesh/body.ply --effects plug_in/my_wind.py:MyWind --truth dataset/truth",
    "validate-contact": "estimates --observations dataset --mesh mesh/body.ply",
    "score": "estimates --truth dataset/truth",
    "report": "estimates --observations dataset --truth dataset/truth",
    "bench": "--only kernel",
    "challenge make": "--limits limits/limits.json --particles particles",
    "challenge solve": "challenge --config config/estimator.toml --keep kept",
    "challenge score": "challenge answers --limits limits/limits.json --config config/estimator.toml --keep kept",
    "challenge hidden": "--limits limits/limits.json --particles particles --seed 1",
    "challenge limits": "--particles particles",
    "gate": "baseline/quick.json --set recipes/quick.toml --run ran",
    "leaderboard": "dataset --of one=estimates",
    "benchmark make": "free_flight",
}
"""Of every verb with an output folder: all that it can be told to read."""


def make_inputs(folder: Path) -> None:
    """Everything that ``COMMANDS`` names; sequences and estimates are there, but empty."""
    files = {
        "config/recipe.toml": "sequences = 1\n[particle]\nfiles = ['particles/stone.ply']\n",
        "config/estimator.toml": "minimum_frames = 12\n",
        "dataset/run.json": '{"schema": "tumble-run", "verb": "render", "state": "finished", "failures": [], "configuration": {}}',
        "dataset/observations/one/observation.json": "{}",
        "dataset/truth/one/truth.json": "{}",
        "estimates/run.json": '{"schema": "tumble-run", "verb": "estimate", "state": "finished", "failures": [], "configuration": {}}',
        "estimates/one.estimate.json": "{}",
        "answers/notes.txt": "",
        "kept/c001.registered.pickle": "",
        "mesh/body.ply": "",
        "videos/drop.cine": "",
        "boards/one.png": "",
        "drops/one.npz": "",
        "stone/particle.json": "{}",
        "calibration/camera.toml": "",
        "particles/stone.ply": "",
        "ran/flights/notes.txt": "",
        "challenge/campaigns/c001/observations/one/observation.json": "{}",
        "limits/limits.json": TABLE.read_text(encoding="utf-8"),
    }
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text, encoding="utf-8")
    write_case(Case("c001", "control", small_recipe(), 3, {}), case_folder(folder / "challenge", "c001") / CASE_FILE)
    for source, target in (("quick.json", "baseline"), ("quick.toml", "recipes")):
        (folder / target).mkdir()
        shutil.copy(ROOT / "baselines" / source, folder / target / source)


def parsers() -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Every verb, and every part of a verb that has parts, with its parser."""
    for verb, _ in VERBS:
        parser = importlib.import_module(f"tumble.cli.{verb.replace('-', '_')}").parser()
        parts = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
        yield from ((f"{verb} {name}", part) for action in parts for name, part in action.choices.items()) if parts else ((verb, parser),)


def options(parser: argparse.ArgumentParser) -> dict[str, argparse.Action]:
    """The options of a parser by name."""
    return {action.dest: action for action in parser._actions}


def paths_given(parser: argparse.ArgumentParser, words: list[str]) -> dict[str, Path]:
    """What a command reads, by option."""
    values = vars(parser.parse_args(words))
    read = [name for name, action in options(parser).items() if action.type is Path and name not in WRITES]
    first = {name: values[name][0] if isinstance(values[name], list) and values[name] else values[name] for name in read}
    return {name: path for name, path in first.items() if isinstance(path, Path)}
