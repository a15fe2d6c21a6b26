"""Velocity errors along the three axes of the benchmark: sequence length, particle irregularity, number of calibrated views.

``python -m scripts.study_benchmark_axes [--small | --full] [--particles FOLDER]`` runs what is missing and writes
``docs/results/study_benchmark_axes.csv`` (a row per sequence), ``…_summary.csv`` (a row per point and quantity), figure and page in
``docs/studies``. The irregularity axis runs through the procedural family from the sphere to jagged lumps whatever the bodies of the
other axes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd
from matplotlib.figure import Figure

from datasets.recipes.recipe import ParticleRecipe, RigRecipe
from scripts.study_conduct import Study, conduct
from scripts.study_pages import (
    LEGEND,
    Line,
    conditions,
    coverage_in_words,
    draw_medians,
    draw_tolerance,
    how_to_repeat,
    inside_tolerance,
    lost_in_words,
    median_table,
    overconfidence_in_words,
)
from scripts.study_runs import Case, Options, standard_recipe
from scripts.study_summaries import QUANTITIES
from studies.looks.figures import COLOURS, figure, finish, plain_logarithmic
from studies.looks.words import number

CAMERAS = 6


@dataclass(frozen=True)
class Axis:
    """One axis: column value, title, values of the small and of the full size, repetitions of both, and whether it is logarithmic."""

    key: str
    title: str
    small: tuple[float, ...]
    full: tuple[float, ...]
    repetitions: tuple[int, int]
    logarithmic: bool


AXES = (
    Axis("length", "frames", (10, 20, 50, 100, 200), (8, 10, 14, 20, 30, 50, 70, 100, 140, 200), (6, 60), True),
    Axis("irregularity", "deformation", (0, 0.1, 0.2, 0.4, 0.7, 1), (0, 0.03, 0.06, 0.1, 0.2, 0.4, 0.6, 0.8, 1), (6, 60), False),
    Axis("views", "calibrated views", (6, 12, 24, 36, 60), (6, 12, 18, 24, 36, 48, 60, 90, 120), (6, 60), True),
)


def cases(options: Options) -> list[Case]:
    """All sequences, one repetition of every point after the other, so that the time left is well guessed."""
    wanted = [
        (repetition, axis, value)
        for axis in AXES
        for value in (axis.full if options.full else axis.small)
        for repetition in options.repeated(*axis.repetitions)
    ]
    return [case(options, axis, value, repetition) for repetition, axis, value in sorted(wanted, key=lambda entry: entry[0])]


def case(options: Options, axis: Axis, value: float, repetition: int) -> Case:
    """One sequence of an axis."""
    standard = standard_recipe(options, repetition)
    recipe = {
        "length": replace(standard, motion=replace(standard.motion, frames=int(value))),
        "irregularity": replace(standard, particle=ParticleRecipe(family="jagged", irregularity=float(value))),
        "views": replace(standard, rig=RigRecipe(drops=int(value) // CAMERAS)),
    }[axis.key]
    return Case({"axis": axis.key, "value": float(value), "repetition": repetition}, recipe)


def drawn(points: pd.DataFrame) -> Figure:
    """Three axes beside each other, three quantities below each other."""
    picture, all_axes = figure(len(QUANTITIES), len(AXES), (9.5, 7.6))
    for row, quantity in enumerate(QUANTITIES):
        for column, axis in enumerate(AXES):
            chosen = points[(points["axis"] == axis.key) & (points["quantity"] == quantity.key)]
            axes = all_axes[row, column]
            draw_medians(axes, chosen, Line("value", COLOURS[row]))
            draw_tolerance(axes, quantity)
            if axis.logarithmic:
                axes.set_xscale("log")
            axes.set_xticks(chosen["value"].to_numpy(), [number(v) for v in chosen["value"]], minor=False)
            axes.set_xticks([], minor=True)
            if row == len(QUANTITIES) - 1:
                axes.set_xlabel(axis.title)
            if column == 0:
                axes.set_ylabel(f"{quantity.title}\nerror (%)")
        _share_limits(all_axes[row])
    finish(picture)
    return picture


def _share_limits(row: Sequence[Any]) -> None:
    for axes in row:
        axes.set_yscale("log")
    low, high = min(axes.get_ylim()[0] for axes in row), max(axes.get_ylim()[1] for axes in row)
    for axes in row:
        axes.set_ylim(low, high)
        plain_logarithmic(axes)


def page(table: pd.DataFrame, points: pd.DataFrame, options: Options) -> list[str]:
    """The page, every number from the result files."""
    lines = ["# Velocity errors along the axes of the benchmark", "", conditions(table, options), ""]
    lines += [f"![Median errors against sequence length, irregularity and number of views]({options.name}.png)", "", *LEGEND, ""]
    writers = {"length": length_in_words, "irregularity": irregularity_in_words, "views": views_in_words}
    for axis in AXES:
        mine, rows = points[points["axis"] == axis.key], table[table["axis"] == axis.key]
        lines += [f"## {axis.key.capitalize()}", "", *writers[axis.key](mine, rows), ""]
        lines += [*median_table(mine, (("value", axis.title),)), ""]
    too_small = overconfidence_in_words(points, (("axis", ""), ("value", "")))
    lines += ["## Error bars", "", coverage_in_words(table), too_small, ""]
    return [*lines, *how_to_repeat(options)]


def length_in_words(points: pd.DataFrame, table: pd.DataFrame) -> list[str]:
    """What a user learns about the length."""
    return [
        f"{_ends(points, 'frames')} {inside_tolerance(points, 'value', 'frames')} {lost_in_words(table, 'value', 'frames')}",
        "",
        "What to type next: `tumble render --set motion.frames=200 --out out/longer` makes longer recordings.",
        "Of a recording of your own, give every frame in which the whole particle is in view.",
    ]


def irregularity_in_words(points: pd.DataFrame, table: pd.DataFrame) -> list[str]:
    """What a user learns about the shape."""
    shape = table.groupby("value")["irregularity"].median()
    return [
        f"The family `jagged` runs from the sphere (irregularity, 1 − sphericity × convexity: {number(round(shape.iloc[0], 3))}) to lumps",
        f"of irregularity {number(shape.iloc[-1])}. {lost_in_words(table, 'value', 'deformation')}",
        "A ball has no orientation to be seen: there is no angular velocity to measure, and a status must say so.",
        _least_measured(table),
        f"{_ends(points[points['median'].notna()], 'deformation')} {inside_tolerance(points, 'value', 'deformation')}",
        "",
        "What to type next: `tumble render --set particle.family=jagged --set particle.irregularity=0.1 --out out/round`",
        "makes nearly round bodies; `tumble score` names the status of each sequence and the irregularity of its body.",
    ]


def _least_measured(table: pd.DataFrame) -> str:
    whole = table.groupby("value")["converged"].all()
    if not whole.any():
        return "At no deformation was every sequence measured."
    least = whole[whole].index[0]
    shape = float(table.loc[table["value"] == least, "irregularity"].median())
    return f"The roundest bodies of which every sequence was measured: deformation {number(least)}, irregularity {number(shape)}."


def views_in_words(points: pd.DataFrame, table: pd.DataFrame) -> list[str]:
    """What a user learns about the calibrated views."""
    return [
        f"{_ends(points, 'views')} {inside_tolerance(points, 'value', 'views')} {lost_in_words(table, 'value', 'views')}",
        "",
        "What to type next: `tumble render --set rig.drops=4 --out out/fewer` tries 24 views (six cameras, four drops).",
    ]


def _ends(points: pd.DataFrame, unit: str) -> str:
    """How each median changes from one end of the axis to the other."""
    low, high = points["value"].min(), points["value"].max()
    parts = [f"{q.title} {_at(points, q.key, low)}% → {_at(points, q.key, high)}%" for q in QUANTITIES]
    return f"Median errors from {number(low)} to {number(high)} {unit}: " + ", ".join(parts) + "."


def _at(points: pd.DataFrame, quantity: str, value: float) -> str:
    chosen = points[(points["quantity"] == quantity) & (points["value"] == value)]
    return number(chosen["median"].iloc[0])


STUDY = Study("study_benchmark_axes", __doc__ or "", ("axis", "value"), cases, drawn, page)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing, then write results, figure and page; exit code 1 when a sequence could not be made."""
    return conduct(STUDY, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
