"""Velocity errors against the direction of motion, from within the image plane to along the optical axis, at several speeds.

Errors are in mm/s and rad/s: relative to the speed, a slow flight is worse by definition. The direction is that at the start; gravity
turns slow flights by mid-sequence.

``python -m scripts.study_out_of_plane [--small | --full] [--particles FOLDER]``
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from datasets.recipes.recipe import Recipe
from scripts.study_conduct import Study, conduct
from scripts.study_pages import (
    Line,
    conditions,
    coverage_in_words,
    draw_medians,
    how_to_repeat,
    lost_in_words,
    median_table,
    overconfidence_in_words,
)
from scripts.study_runs import Case, Options, standard_recipe
from scripts.study_summaries import QUANTITIES
from studies.looks.figures import COLOURS, figure, finish, plain_logarithmic
from studies.looks.words import number

DIRECTIONS_DEG = (0.0, 30.0, 60.0, 90.0)
DIRECTIONS_DEG_FULL = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 90.0)
SPEEDS_MS = (0.5, 1.5, 3.0)
SPEEDS_MS_FULL = (0.25, 0.5, 1.0, 2.0, 3.0)
REPETITIONS = (6, 60)


def cases(options: Options) -> list[Case]:
    """Every direction and speed of a repetition after the other."""
    directions, speeds = (DIRECTIONS_DEG_FULL, SPEEDS_MS_FULL) if options.full else (DIRECTIONS_DEG, SPEEDS_MS)
    return [
        Case({"speed_start_ms": speed, "direction_deg": angle, "repetition": k}, directed(standard_recipe(options, k), speed, angle))
        for k in options.repeated(*REPETITIONS)
        for speed in speeds
        for angle in directions
    ]


def directed(recipe: Recipe, speed_ms: float, direction_deg: float) -> Recipe:
    """The same sequence with a velocity at ``direction_deg`` from the image plane."""
    along = round(float(speed_ms * np.sin(np.deg2rad(direction_deg))), 9)
    return replace(recipe, motion=replace(recipe.motion, speed_ms=(speed_ms, speed_ms), out_of_plane_ms=(along, along)))


def drawn(points: pd.DataFrame) -> Figure:
    """The three quantities beside each other, one line per speed; dashed: what the error bars predict."""
    picture, all_axes = figure(1, len(QUANTITIES), (9.5, 3.8))
    speeds = sorted(points["speed_start_ms"].unique())
    width = 1.5
    for axes, quantity in zip(all_axes[0], QUANTITIES, strict=True):
        for k, (speed, colour) in enumerate(zip(speeds, [*COLOURS, "0.4"], strict=False)):
            chosen = points[(points["quantity"] == quantity.key) & (points["speed_start_ms"] == speed)]
            moved = chosen.assign(shown_deg=chosen["direction_deg"] + width * (k - (len(speeds) - 1) / 2))
            draw_medians(axes, moved, Line("shown_deg", colour, f"{number(speed)} m/s", accompanied=False))
            axes.plot(moved["shown_deg"], moved["predicted"], "--", lw=1.1, color=colour, alpha=0.8)
        axes.set(title=quantity.title, xlabel="direction (degrees from the image plane)")
        axes.set_ylabel(f"median error ({quantity.absolute_unit})")
        axes.set_xticks(sorted(points["direction_deg"].unique()))
        plain_logarithmic(axes)
    finish(picture)
    return picture


def page(table: pd.DataFrame, points: pd.DataFrame, options: Options) -> list[str]:
    """The page, every number from the result files."""
    return [
        "# Motion out of the image plane",
        "",
        conditions(table, options),
        "Here the errors are in mm/s and rad/s: relative to the speed a slow flight would be worse by definition.",
        "Speed and direction are those at the start.",
        "",
        f"![Median errors against the direction of motion]({options.name}.png)",
        "",
        "Dots: medians with 95% bootstrap intervals, moved sideways a little where they would hide each other.",
        "Dashed: the median error that the reported error bars predict.",
        "",
        "## What it says",
        "",
        *(_speed_in_words(points, speed) for speed in sorted(points["speed_start_ms"].unique())),
        _factor_in_words(points),
        lost_in_words(table, "direction_deg", "degrees"),
        "",
        "What to type next:",
        "`tumble render --set 'motion.speed_ms=[1.5,1.5]' --set 'motion.out_of_plane_ms=[1.5,1.5]' --out out/towards`",
        "makes flights along the axis. To measure depth better use a shorter lens ([focal length](study_focal_length.md)) or more frames",
        "([axes of the benchmark](study_benchmark_axes.md)).",
        "",
        *median_table(points, (("speed_start_ms", "speed (m/s)"), ("direction_deg", "direction (°)")), unit="absolute"),
        "",
        coverage_in_words(table),
        overconfidence_in_words(points, (("speed_start_ms", "m/s,"), ("direction_deg", "degrees"))),
        "",
        *how_to_repeat(options),
    ]


def _speed_in_words(points: pd.DataFrame, speed: float) -> str:
    first, last = points["direction_deg"].min(), points["direction_deg"].max()
    parts = [f"{q.title} {_at(points, q.key, speed, first)} → {_at(points, q.key, speed, last)} {q.absolute_unit}" for q in QUANTITIES]
    return f"- At {number(speed)} m/s, from within the plane to along the axis: {', '.join(parts)}."


def _factor_in_words(points: pd.DataFrame) -> str:
    """How much worse depth is than the plane, over all points."""
    by = points.pivot(index=["speed_start_ms", "direction_deg"], columns="quantity", values="median")
    ratio = by["out_of_plane"] / by["in_plane"]
    everywhere = ": depth is measured worse in whatever direction the particle flies." if ratio.min() > 1 else "."
    return (
        f"\nThe median out-of-plane error is {number(ratio.min())} to {number(ratio.max())} times the median in-plane error, "
        f"at half of the points more than {number(ratio.median())} times{everywhere}"
    )


def _at(points: pd.DataFrame, quantity: str, speed: float, direction: float) -> str:
    chosen = points[(points["quantity"] == quantity) & (points["speed_start_ms"] == speed) & (points["direction_deg"] == direction)]
    return number(chosen["median"].iloc[0])


STUDY = Study("study_out_of_plane", __doc__ or "", ("speed_start_ms", "direction_deg"), cases, drawn, page, absolute=True)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing, then write results, figure and page; exit code 1 when a sequence could not be made."""
    return conduct(STUDY, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
