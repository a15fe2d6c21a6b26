"""``tumble leaderboard``: instruments beside one another on the same datasets."""

import argparse
from pathlib import Path

import numpy as np

from datasets.scoring.leaderboard import leaderboard
from tumble.cli.console import console
from tumble.cli.options import add_output, verb_parser
from tumble.leaderboard import NUMBERS, PAGE, cells_of, instruments_of, page, rows_of, write_leaderboard
from tumble.output_directory import Run, output_directory

BOOTSTRAP_SEED = 20240229


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "leaderboard",
        description="Put instruments beside one another: who is nearest to the truth in each dataset, by how much, and is that decided?\n"
        "Each instrument is a folder of estimates (docs/format.md), whoever wrote them; docs/rivals says how to join.\n"
        "A sequence without an estimate counts against its instrument.",
        example="tumble leaderboard out/dataset --of tumble=out/estimates --of centroids=out/centroids --out out/leaderboard",
    )
    verb.add_argument("datasets", type=Path, nargs="+", metavar="DATASET", help="datasets with their truth; each is a cell of the table")
    verb.add_argument(
        "--of",
        action="append",
        required=True,
        metavar="NAME=FOLDER",
        help="an instrument and its estimates, FOLDER/<dataset's name>/*.estimate.json or FOLDER/*.estimate.json; once for each instrument",
    )
    verb.add_argument("--title", default="Leaderboard", help="of the page (default: Leaderboard)")
    add_output(verb, default="out/leaderboard")
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Score, rank, write the page."""
    instruments = instruments_of(arguments.of)
    of = {name: str(path.resolve()) for name, path in instruments.items()}
    content = {"datasets": [str(path.resolve()) for path in arguments.datasets], "of": of}
    described = Run("leaderboard", content, reads=(*arguments.datasets, *instruments.values()))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        told = leaderboard(rows_of(cells_of(arguments.datasets), instruments), np.random.default_rng(BOOTSTRAP_SEED))
        write_leaderboard(told, arguments.title, out)
    if arguments.json:
        print((arguments.out / NUMBERS).read_text(encoding="utf-8"), end="")
    elif not arguments.quiet:
        console().print(page(told, arguments.title), soft_wrap=True, markup=False, highlight=False)
        console().print(f"page: {arguments.out / PAGE}", soft_wrap=True)
    return 0
