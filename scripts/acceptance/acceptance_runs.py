"""What acceptance runs share: their arguments, a seed that is drawn and told, items that are never done twice, and written figures."""

import argparse
import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tumble.cli.options import add_engine, executor_of
from tumble.engine import Item, failures, run
from tumble.progress import progress


def acceptance_parser(description: str | None, out: str) -> argparse.ArgumentParser:
    """The arguments that all have."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path(out))
    parser.add_argument("--result", type=Path, help="where to write the figures as JSON")
    parser.add_argument("--page", type=Path, help="where to write them as a page")
    parser.add_argument("--seed", type=int, help="drawn anew where it is left out")
    add_engine(parser)
    return parser


def seed_of(arguments: argparse.Namespace) -> int:
    """The seed given, or one drawn; it is printed, since figures without it cannot be repeated."""
    seed = secrets.randbelow(10**8) if arguments.seed is None else int(arguments.seed)
    print(f"seed {seed}", flush=True)
    return seed


def run_missing(work: Callable[[dict[str, Any]], dict[str, Any]], items: Sequence[Item], arguments: argparse.Namespace, what: str) -> None:
    """Do the items that are not there yet; say which failed."""
    arguments.out.mkdir(parents=True, exist_ok=True)
    with progress(what, len(items), quiet=False) as advance:
        outcomes = run(work, items, executor=executor_of(arguments), advance=advance)
    for outcome in failures(outcomes):
        print(f"{outcome.name} failed: {outcome.message}")


def write_figures(result: Mapping[str, Any], page: str, arguments: argparse.Namespace) -> None:
    """Write the figures and their page where they are asked for."""
    text = json.dumps(result, indent=1, allow_nan=False) + "\n"
    for path, content in ((arguments.result, text), (arguments.page, page)):
        if path is not None:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(content, encoding="utf-8")
