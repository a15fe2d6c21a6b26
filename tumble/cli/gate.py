"""``tumble gate``: whether a run is worse than a committed baseline. Exit code 1 when it is."""

import argparse
import json
from pathlib import Path

import numpy as np

from datasets.scoring.gate import GateResult, compare, load_baseline, write_baseline
from datasets.scoring.score import Row
from datasets.scoring.table import score_table
from tumble.cli.options import verb_parser
from tumble.result_files import estimates_in
from tumble.scoring import score_one
from tumble.versions import versions

BOOTSTRAP_SEED = 20240229


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "gate",
        description="Compare a run with a committed baseline, sequence by sequence, and name the sequences that got worse.\n"
        "Exit code 0: not worse; 1: worse; 2: something is missing.",
        example="tumble gate baseline.json --estimates out/estimates --truth out/dataset/truth",
    )
    verb.add_argument("baseline", type=Path, metavar="BASELINE.json", help="the baseline")
    verb.add_argument("--estimates", type=Path, required=True, metavar="FOLDER", help="the run's estimates")
    verb.add_argument("--truth", type=Path, required=True, metavar="FOLDER", help="the dataset's truth folder")
    verb.add_argument("--write", action="store_true", help="write the baseline from this run instead of comparing")
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Compare, or write the baseline."""
    rows = [score_one(path, arguments.truth) for path in estimates_in(arguments.estimates)]
    if arguments.write:
        write_baseline(arguments.baseline, score_table(rows), versions())
        print(f"baseline: {arguments.baseline} ({len(rows)} sequences); commit it with the reason for the change")
        return 0
    result = verdict(arguments.baseline, rows)
    if arguments.json:
        print(json.dumps({"worse": result.worse, "sequences": result.sequences, "sentences": result.sentences}))
    elif result.worse or not arguments.quiet:
        print("\n".join(result.sentences))
    return int(result.worse)


def verdict(baseline: Path, rows: list[Row]) -> GateResult:
    """The comparison with the committed baseline; the bootstrap always draws the same samples."""
    return compare(load_baseline(baseline), rows, rng=np.random.default_rng(BOOTSTRAP_SEED))
