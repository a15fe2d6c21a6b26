"""What the pages of the studies of accuracy share: tables with intervals, failures in words, and how results are written."""

import argparse
import json
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes

from datasets.atomic_files import written_whole
from scripts.study_runs import SPEED_MS, SPIN_RADS, Options
from scripts.study_summaries import POOR_COVERAGE, QUANTITIES, Quantity, inside_in_words, overconfident
from studies.looks.words import number, with_interval, write_page

LARGEST_SEED = 2**31
MOST_NAMED = 6
LEGEND = (
    "Dots: medians with 95% bootstrap intervals. Dashed: the median error that the reported error bars predict. Dotted: the median error",
    "at the estimate's own bound, that of tangents. Red: the tolerance that the score sets a good sequence.",
)


@dataclass(frozen=True)
class Line:
    """One line of medians: column of the horizontal axis, colour, label, and whether prediction and bound accompany it."""

    column: str
    colour: str
    label: str = "median, 95% interval"
    accompanied: bool = True


def draw_medians(axes: Axes, points: pd.DataFrame, line: Line) -> None:
    """Medians with intervals, what the error bars predict (dashed) and the bound (dotted); crosses at the foot: nothing was measured."""
    x = points[line.column].to_numpy(dtype=np.float64)
    median, low, high = (points[key].to_numpy(dtype=np.float64) for key in ("median", "low", "high"))
    spread = np.vstack([median - low, high - median])
    axes.errorbar(x, median, yerr=spread, fmt="o-", ms=4, lw=1.4, capsize=2.5, color=line.colour, label=line.label)
    lost = x[np.isnan(median)]
    if lost.size:
        cross: dict[str, Any] = {"color": "#b00020", "ms": 7, "mew": 1.8, "clip_on": False, "label": "no measurement"}
        axes.plot(lost, np.full(lost.size, 0.05), "x", transform=axes.get_xaxis_transform(), **cross)
    if line.accompanied:
        axes.plot(x, points["predicted"], "--", lw=1.2, color="0.25", label="predicted by the error bars")
        axes.plot(x, points["bound"], ":", lw=1.4, color="0.5", label="bound")


def draw_tolerance(axes: Axes, quantity: Quantity) -> None:
    """The tolerance as a thin line."""
    axes.axhline(quantity.tolerance_percent, color="#b00020", lw=0.8, label="tolerance")


def median_table(points: pd.DataFrame, columns: Sequence[tuple[str, str]], unit: str = "%") -> list[str]:
    """Lines of a Markdown table: one row per point, medians with intervals; ``columns`` are (column, heading)."""
    units = {q.key: unit if unit == "%" else q.absolute_unit for q in QUANTITIES}
    head = [*(heading for _, heading in columns), "converged", *(f"{q.title} ({units[q.key]})" for q in QUANTITIES)]
    lines = ["| " + " | ".join(head) + " |", "| " + " | ".join("---" for _ in head) + " |"]
    for point, group in points.groupby([column for column, _ in columns], sort=True):
        by = group.set_index("quantity")
        cells = [*(number(value) for value in point), f"{by['n_converged'].iloc[0]} of {by['n'].iloc[0]}"]
        cells += [with_interval(by.loc[q.key].to_dict()) for q in QUANTITIES]
        lines.append("| " + " | ".join(cells) + " |")
    return lines


def lost_in_words(table: pd.DataFrame, column: str, what: str) -> str:
    """A sentence that says where sequences ended without a measurement."""
    lost = table[~table["converged"]]
    if lost.empty:
        return f"All {len(table)} sequences of this axis converged."
    counts = lost.groupby([column, "status"], sort=True).size().reset_index(name="n")
    whole = table.groupby(column).size()
    parts = [f"{number(row[column])} ({row['n']} of {whole[row[column]]} *{row['status']}*)" for _, row in counts.iterrows()]
    return f"No measurement, with a status that says so: at {what} " + ", ".join(parts) + "."


def conditions(table: pd.DataFrame, options: Options) -> str:
    """A paragraph: how many sequences of what, and what a relative error refers to."""
    which = "six scanned bodies" if options.particles else "six bodies of the procedural family (three cut stones, three jagged lumps)"
    return (
        f"{len(table)} sequences of the silhouette tier: outlines with 0.2 px boundary noise, {which}, 4–8 mm, started from nothing. "
        f"Unless varied: 100 frames at 4000 frames/s, 60 calibrated views, 0.1 mm per pixel, {SPEED_MS[0]:g}–{SPEED_MS[1]:g} m/s, "
        f"{SPIN_RADS[0]:g}–{SPIN_RADS[1]:g} rad/s. Errors are those at mid-sequence; linear ones relative to the speed, angular ones to "
        "the spin. Medians with 95% bootstrap intervals over the converged sequences. All points share particles and flights "
        "and differ by what is varied alone; so they are not independent, and a few unlucky draws show all along a line."
    )


def overconfidence_in_words(points: pd.DataFrame, columns: Sequence[tuple[str, str]]) -> str:
    """A paragraph that names the points whose error bars are too small; ``columns`` are (column, unit)."""
    poor = overconfident(points)
    if poor.empty:
        return f"At no point do the 95% intervals hold the truth for less than {POOR_COVERAGE:.0%} of the components."
    title = {q.key: q.title for q in QUANTITIES}
    parts = []
    for _, row in poor.head(MOST_NAMED).iterrows():
        shown = (row[column] if isinstance(row[column], str) else number(row[column]) for column, _ in columns)
        where = " ".join(f"{value} {unit}".strip() for value, (_, unit) in zip(shown, columns, strict=True))
        median, predicted = number(row["median"]), number(row["predicted"])
        held = f"{row['coverage']:.0%} of the intervals hold the truth"
        parts.append(f"{title[row['quantity']]} at {where} ({held}; median error {median}, predicted {predicted} {row['unit']})")
    more = f", and {len(poor) - MOST_NAMED} more" if len(poor) > MOST_NAMED else ""
    return "Where the error bars are too small: " + "; ".join(parts) + more + "."


def inside_tolerance(points: pd.DataFrame, column: str, unit: str) -> str:
    """A sentence: at which values of ``column`` the medians are inside the tolerances."""
    parts = [f"{q.title} {inside_in_words(points, column, q, unit)} ({q.tolerance_percent:g}%)" for q in QUANTITIES]
    return "Medians inside the tolerance: " + ", ".join(parts) + "."


def coverage_in_words(table: pd.DataFrame) -> str:
    """A sentence on the 95% intervals of the whole study."""
    good = table[table["converged"]]
    shares = [100 * float(good[[f"inside95_{c}" for c in names]].to_numpy(dtype=float).mean()) for names in (_LINEAR, _ANGULAR)]
    return (
        f"Over the whole study the reported 95% intervals hold the truth for {shares[0]:.1f}% of the components of v and "
        f"{shares[1]:.1f}% of those of ω; {good['repetition'].nunique()} independent draws of particle and flight stand behind them."
    )


_LINEAR = (*QUANTITIES[0].components, *QUANTITIES[1].components)
_ANGULAR = QUANTITIES[2].components


def how_to_repeat(options: Options) -> list[str]:
    """The last lines of a page: commands, result files."""
    flags = (" --particles FOLDER" if options.particles else "") + (" --full" if options.full else "")
    files = f"[every sequence](../results/{options.name}.csv), [medians](../results/{options.name}_summary.csv)"
    command = f"python -m scripts.{options.study}{flags}"
    return [
        "## Again",
        "",
        "```sh",
        command,
        "```",
        "",
        f"Results: {files}. A killed run goes on where it was; this page is written by the command from these files.",
        "",
    ]


def write_csv(table: pd.DataFrame, path: Path) -> pd.DataFrame:
    """Write a tidy table with six significant digits and read it back, so that pages copy what the file holds."""
    with written_whole(path) as temporary:
        table.to_csv(temporary, index=False, float_format="%.6g", lineterminator="\n")
    return pd.read_csv(path)


def body_study_arguments(description: str | None, bodies: int) -> argparse.Namespace:
    """The arguments of a study on ``bodies`` drawn ones; its seed is drawn unless one is given."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bodies", type=int, default=bodies)
    parser.add_argument("--seed", type=int, default=None)
    parser.add_argument("--result", type=Path)
    parser.add_argument("--page", type=Path)
    arguments = parser.parse_args()
    if arguments.seed is None:
        arguments.seed = secrets.randbelow(LARGEST_SEED)
    return arguments


def write_body_study(result: Mapping[str, Any], page: Callable[[Any], Sequence[str]], arguments: argparse.Namespace) -> None:
    """Write the figures and their page where they are asked for."""
    if arguments.result:
        with written_whole(arguments.result) as temporary:
            temporary.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    if arguments.page:
        write_page(page(result), arguments.page)
