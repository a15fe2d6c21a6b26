"""The gate's page: the verdict, every measure with its interval, and links to the sequences that got worse."""

import math
import os
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from datasets.atomic_files import written_whole
from datasets.scoring.gate import CAMPAIGNS, JUMP, Comparison, GateResult
from tumble.engine import Executor, State
from tumble.gate.running import DATASET, ESTIMATES
from tumble.gate.words import REPORT, file_of, lost_in_words, lost_together, most_in, summary
from tumble.output_directory import Run, output_directory
from tumble.reporting import collect
from tumble.reports.page import write_page
from tumble.versions import versions

PAGE = "gate.html"
WIDTH = 160
"""Of the drawing of an interval, px; its ends are a ``JUMP`` times better and worse."""


def write_reports(result: GateResult, out: Path, *, executor: Executor, quiet: bool) -> None:
    """A report of every kind that got worse, of sequences with pictures or outlines."""
    for kind in [losses.kind for losses in result.losses if losses.kind != CAMPAIGNS and result.verdict(losses.kind) == "worse"]:
        estimates, dataset, report = out / kind / ESTIMATES, out / kind / DATASET, out / kind / REPORT
        described = Run("report", {"estimates": str(estimates.resolve())}, reads=(estimates, dataset))
        with output_directory(report, described, resume=False, force=True):
            outcomes = collect(estimates, dataset, dataset / "truth", out=report, executor=executor, quiet=quiet)
            if parts := [outcome.result for outcome in outcomes if outcome.state is State.DONE]:
                write_page(parts, report / "report.html", title=f"Gate: {kind}")


def write_gate_page(result: GateResult, run: Path, path: Path) -> None:
    """Write the page of a verdict on what lies in the folder ``run``; links are relative."""
    environment = Environment(loader=PackageLoader("tumble.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    text = environment.get_template("gate.html.j2").render(
        worse=result.worse,
        verdict=summary(result),
        together=lost_together(result),
        failed=sorted(result.failed.items()),
        width=WIDTH,
        kinds=[_kind(result, losses.kind, run, path.parent) for losses in result.losses],
        made_by=versions()["tumble"],
    )
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _kind(result: GateResult, kind: str, run: Path, beside: Path) -> dict[str, Any]:
    (losses,) = (each for each in result.losses if each.kind == kind)
    named = result.sequences(kind) if result.verdict(kind) == "worse" else ()
    return {
        "name": kind,
        "verdict": result.verdict(kind),
        "n": losses.n,
        "losses": lost_in_words(losses, result),
        "measures": [_measure(each) for each in result.comparisons if each.kind == kind],
        "links": [(name, _link(file_of(kind, name, run), beside)) for name in named],
    }


def _measure(told: Comparison) -> dict[str, Any]:
    return {
        "words": told.measure.words,
        "verdict": told.verdict,
        "figures": f"{told.ratio:.2f} ({told.low:.2f} to {told.high:.2f})",
        "at": {name: _place(value) for name, value in (("low", told.low), ("ratio", told.ratio), ("high", told.high))},
        "sequences": most_in(told),
    }


def _place(ratio: float) -> float:
    """Where a ratio lies in the drawing, px."""
    share = math.log(min(max(ratio, 1 / JUMP), JUMP)) / math.log(JUMP)
    return round(0.5 * WIDTH * (1.0 + share), 1)


def _link(file: Path, beside: Path) -> str:
    return Path(os.path.relpath(file, beside)).as_posix()
