"""The command of a study of the real tosses: run it or take the result that is there, then write its page and picture."""

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from studies.reporting.figures import write_figure
from studies.reporting.words import write_page

DOCS = Path("docs")
Result = dict[str, Any]


@dataclass(frozen=True)
class TossStudy:
    """A study: ``name`` of its files, ``kept`` what its work folder holds, and how it runs, draws and tells."""

    name: str
    kept: str
    run: Callable[[Path, Path], Result]
    drawn: Callable[[Result], Figure]
    page: Callable[[Result], Sequence[str]]


def toss_command(study: TossStudy, description: str | None) -> int:
    """Read the arguments, run, and write."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tosses", type=Path, help="folder with cube_tosses.npz")
    parser.add_argument("--work", type=Path, default=Path("out") / study.name, help=f"where {study.kept}")
    parser.add_argument("--result", type=Path, default=DOCS / "results" / f"{study.name}.json")
    parser.add_argument("--page", action="store_true", help="write page and picture from the result that is there")
    arguments = parser.parse_args()
    if not arguments.page:
        if arguments.tosses is None:
            parser.error("expected --tosses FOLDER, or --page")
        result = study.run(arguments.tosses / "cube_tosses.npz", arguments.work)
        arguments.result.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    result = json.loads(arguments.result.read_text(encoding="utf-8"))
    write_figure(study.drawn(result), DOCS / "studies" / f"{study.name}.png")
    write_page(study.page(result), DOCS / "studies" / f"{study.name}.md")
    return 0
