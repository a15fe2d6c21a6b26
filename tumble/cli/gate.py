"""``tumble gate``: whether a run is worse than a committed baseline. Exit code 1 when it is.

With a baseline alone its sequences are made anew from the recipe that it names, estimated and compared; with ``--estimates`` and
``--truth`` a run that is there already is compared.
"""

import argparse
import json
import os
import platform
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.recipes.toml_files import load_recipe
from datasets.scoring.gate import GateResult, compare, load_baseline, write_baseline
from datasets.scoring.score import Row
from datasets.scoring.table import score_table
from tumble.cli.options import add_engine, add_output, executor_of, verb_parser
from tumble.engine import Outcome, failures
from tumble.gating import Manner, recipe_file, rows_of_recipe
from tumble.output_directory import Run, note_failures, output_directory
from tumble.result_files import estimates_in
from tumble.scoring import score_one
from tumble.versions import versions
from tumble.written_files import refuse_other_file

BOOTSTRAP_SEED = 20240229
VERDICT_FILE = "verdict.json"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "gate",
        description="Compare a run with a committed baseline, sequence by sequence, and name the sequences that got worse.\n"
        "Without --estimates and --truth the baseline's own sequences are made from the recipe that it names, in --out; what is there\n"
        "already and was made by the same sources stays (--resume is how it always works), --force makes it all anew.\n"
        "Exit code 0: not worse; 1: worse; 2: something is missing.",
        example="tumble gate baselines/quick.json --out out/gate",
    )
    verb.add_argument("baseline", type=Path, metavar="BASELINE.json", help="the baseline")
    verb.add_argument("--estimates", type=Path, metavar="FOLDER", help="a run's estimates, to compare instead")
    verb.add_argument("--truth", type=Path, metavar="FOLDER", help="the truth folder of that run's dataset")
    verb.add_argument("--recipe", type=Path, metavar="FILE.toml", help="the recipe of the sequences (default: the one the baseline names)")
    verb.add_argument("--write", action="store_true", help="write the baseline from this run instead of comparing")
    add_output(verb, default="out/gate")
    add_engine(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Compare, or write the baseline."""
    if (arguments.estimates is None) != (arguments.truth is None):
        raise InputError("expected --estimates and --truth together, or neither; came one of them.")
    if arguments.write:
        refuse_other_file(arguments.baseline, "tumble baseline", "BASELINE")
    if arguments.estimates is not None:
        rows = [score_one(path, arguments.truth) for path in estimates_in(arguments.estimates)]
        return _write(arguments, rows) if arguments.write else _compare(arguments, rows, ())
    return _run_anew(arguments)


def verdict(baseline: Path, rows: list[Row]) -> GateResult:
    """The comparison with the committed baseline; the bootstrap always draws the same samples."""
    return compare(load_baseline(baseline), rows, rng=np.random.default_rng(BOOTSTRAP_SEED))


def _run_anew(arguments: argparse.Namespace) -> int:
    source = arguments.recipe or recipe_file(arguments.baseline)
    recipe = load_recipe(source, ())
    manner = Manner(executor_of(arguments), arguments.quiet, arguments.force)
    content = {"baseline": str(arguments.baseline.resolve()), "recipe": str(source.resolve())}
    described = Run("gate", content, recipe.seed, reads=(arguments.baseline, source, *map(Path, recipe.particle.files)))
    with output_directory(arguments.out, described, resume=not arguments.force, force=arguments.force) as out:
        rows, outcomes = rows_of_recipe(recipe, out, manner)
        note_failures(out, {outcome.name: outcome.message for outcome in failures(outcomes)})
        if not arguments.write:
            return _compare(arguments, rows, outcomes)
    for failed in failures(outcomes):
        raise InputError(f"sequence {failed.name} has no estimate, so no baseline is written: {failed.message}")
    return _write(arguments, rows)


def _write(arguments: argparse.Namespace, rows: list[Row]) -> int:
    recipe = arguments.recipe or (recipe_file(arguments.baseline) if arguments.estimates is None else None)
    named = "" if recipe is None else Path(os.path.relpath(recipe.resolve(), arguments.baseline.resolve().parent)).as_posix()
    environment = {**versions(), "platform": f"{platform.system()}-{platform.machine()}"}
    write_baseline(arguments.baseline, score_table(rows), environment, recipe=named)
    print(f"baseline: {arguments.baseline} ({len(rows)} sequences); commit it with the reason for the change")
    return 0


def _compare(arguments: argparse.Namespace, rows: list[Row], outcomes: Sequence[Outcome]) -> int:
    """Say the verdict; a sequence whose estimate failed makes the run worse, whatever the baseline says of it."""
    result = verdict(arguments.baseline, rows)
    lost = {failed.name: failed.message for failed in failures(outcomes)}
    worse = result.worse or bool(lost)
    names = list(dict.fromkeys([*lost, *result.sequences]))
    sentences = [*(f"{name} failed: {message}" for name, message in lost.items()), *result.sentences]
    document = json.dumps({"worse": worse, "sequences": names, "sentences": sentences})
    if arguments.estimates is None:
        with written_whole(arguments.out / VERDICT_FILE) as temporary:
            temporary.write_text(document + "\n", encoding="utf-8")
    if arguments.json:
        print(document)
    elif worse or not arguments.quiet:
        print("\n".join(sentences))
    return int(worse)
