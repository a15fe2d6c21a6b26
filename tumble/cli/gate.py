"""``tumble gate``: whether the estimator is worse than a committed baseline. Exit code 1 when it is.

The baseline's own sequences are made anew from the set that it names, measured and compared; with ``--run`` what an earlier gate left in
a folder is compared as it is.
"""

import argparse
import json
import os
import platform
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.scoring.gate import Baseline, compare, load_baseline, write_baseline
from tumble.cli.options import add_engine, add_output, executor_of, verb_parser
from tumble.differences import first_difference
from tumble.gate.earlier import read_earlier
from tumble.gate.page import PAGE, write_gate_page, write_reports
from tumble.gate.running import Manner, Ran, run_set
from tumble.gate.sets import GateSet, read_set
from tumble.gate.words import document, sentences
from tumble.output_directory import Run, note_failures, output_directory
from tumble.versions import versions
from tumble.written_files import refuse_other_file

VERDICT_FILE = "verdict.json"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "gate",
        description="Compare the estimator with a committed baseline on the same sequences: flights, pictures, impacts, campaigns.\n"
        "The sequences are made from the set that the baseline names, in --out; what is there already and was made by the same\n"
        "sources stays (--resume is how it always works), --force makes it all anew.\n"
        "Exit code 0: no worsening shown; 1: worse; 2: something is missing.",
        example="tumble gate baselines/quick.json --out out/gate",
    )
    verb.add_argument("baseline", type=Path, metavar="BASELINE.json", help="the baseline")
    verb.add_argument("--set", type=Path, metavar="FILE.toml", dest="set_file", help="the set (default: the one the baseline names)")
    verb.add_argument("--run", type=Path, metavar="FOLDER", dest="ran", help="an earlier gate's --out, to compare as it is instead")
    verb.add_argument("--write", action="store_true", help="write the baseline from this run instead of comparing")
    add_output(verb, default="out/gate")
    add_engine(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Compare, or write the baseline."""
    if arguments.write:
        refuse_other_file(arguments.baseline, "tumble baseline", "BASELINE")
    if arguments.write and arguments.set_file is None and not arguments.baseline.exists():
        raise InputError(f"{arguments.baseline}: expected --set FILE.toml with the sequences of a new baseline, got none.")
    source = arguments.set_file or set_file_of(arguments.baseline)
    gate_set = read_set(source)
    baseline = None if arguments.write else _baseline_of(arguments.baseline, gate_set, source)
    content = {"set": str(source.resolve()), **gate_set.content(), "run": str(arguments.ran.resolve()) if arguments.ran else None}
    reads = (arguments.baseline, source, *gate_set.meshes, *([arguments.ran] if arguments.ran else []))
    described = Run("gate", json.loads(json.dumps(content)), reads=reads)
    with output_directory(arguments.out, described, resume=not arguments.force, force=arguments.force) as out:
        ran = _run(gate_set, arguments, out)
        note_failures(out, ran.failed)
        if baseline is not None:
            return _compare(arguments, baseline, ran)
    return _write(arguments, source, gate_set, ran)


def set_file_of(path: Path) -> Path:
    """The file of the set that the baseline of this ``path`` names.

    Raises
    ------
    InputError
        Where it is not there.
    """
    named = load_baseline(path).set_file
    found = path.parent / named
    if not found.is_file():
        raise InputError(f"{path}: expected its set {found}, got no such file. Name it with --set.")
    return found


def _baseline_of(path: Path, gate_set: GateSet, source: Path) -> Baseline:
    baseline = load_baseline(path)
    if different := first_difference(_with_defaults(baseline.made_from, path), json.loads(json.dumps(gate_set.content()))):
        raise InputError(
            f"{source}: expected the set that {path} was made from, but {different}. Other sequences cannot be compared: take the change "
            "back, or write the baseline anew with --write."
        )
    return baseline


def _with_defaults(made_from: dict[str, Any], path: Path) -> dict[str, Any]:
    """What a baseline was made from, its recipes with the defaults of keys that are newer than they; as it is where they have others."""
    try:
        recipes = {kind: recipe_to_dict(recipe_from_dict(table, str(path))) for kind, table in made_from.get("recipes", {}).items()}
    except InputError:
        return made_from
    return {**made_from, "recipes": json.loads(json.dumps(recipes))}


def _run(gate_set: GateSet, arguments: argparse.Namespace, out: Path) -> Ran:
    if arguments.ran is not None:
        return read_earlier(gate_set, arguments.ran)
    return run_set(gate_set, out, Manner(executor_of(arguments), arguments.quiet, arguments.force))


def _write(arguments: argparse.Namespace, source: Path, gate_set: GateSet, ran: Ran) -> int:
    for name, message in ran.failed.items():
        raise InputError(f"{name} could not be measured, so no baseline is written: {message}")
    named = Path(os.path.relpath(source.resolve(), arguments.baseline.resolve().parent)).as_posix()
    environment = {**versions(), "platform": _platform()}
    cpu_s = {kind: round(value, 1) for kind, value in ran.cpu_s.items()}
    write_baseline(arguments.baseline, Baseline(ran.rows, environment, named, gate_set.content(), cpu_s))
    count = sum(len(rows) for rows in ran.rows.values())
    print(f"baseline: {arguments.baseline} ({count} sequences); commit it with the reason for the change")
    return 0


def _compare(arguments: argparse.Namespace, baseline: Baseline, ran: Ran) -> int:
    """Say the verdict, and write it with its page; a sequence whose estimate failed makes the run worse, whatever the baseline says."""
    result = compare(baseline, ran.rows, ran.failed)
    place, out = arguments.ran or arguments.out, arguments.out
    if arguments.ran is None:
        write_reports(result, out, executor=executor_of(arguments), quiet=arguments.quiet)
    write_gate_page(result, place, out / PAGE)
    cpu_s = _cpu_s(ran.cpu_s, baseline)
    told = json.dumps(document(result, place, cpu_s), indent=1)
    with written_whole(out / VERDICT_FILE) as temporary:
        temporary.write_text(told + "\n", encoding="utf-8")
    if arguments.json:
        print(told)
    elif result.worse or not arguments.quiet:
        print("\n".join([*sentences(result, place, cpu_s, every=arguments.verbose), f"page: {out / PAGE}"]))
    return int(result.worse)


def _cpu_s(now: Mapping[str, float], baseline: Baseline) -> dict[str, tuple[float, float]]:
    """Now and in the baseline, of kinds that were measured whole both times on the same platform."""
    if baseline.environment.get("platform") != _platform():
        return {}
    return {kind: (now[kind], baseline.cpu_s[kind]) for kind in now if kind in baseline.cpu_s}


def _platform() -> str:
    return f"{platform.system()}-{platform.machine()}"
