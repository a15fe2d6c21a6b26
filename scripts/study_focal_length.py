"""Velocity errors against the focal length at equal magnification: the longer the lens, the farther the camera stands.

A thin lens of focal length ``f`` at the distance ``d = f (1 + 1/m)`` has the magnification ``m``; at ``m = 0.2`` and 20 µm pixels a
pixel shows 0.1 mm at the particle whatever the lens. Depth shows in the outline's size alone, ``s = p / Z``, so that at equal ``s`` an
error of ``s`` becomes one of depth proportional to ``Z``: the depth velocity should suffer in proportion to the focal length.

``python -m scripts.study_focal_length [--small | --full] [--particles FOLDER]``
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from datasets.recipes.recipe import HsvRecipe, Recipe
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

FOCAL_MM = (25.0, 50.0, 100.0, 200.0, 400.0)
FOCAL_MM_FULL = (25.0, 35.0, 50.0, 70.0, 100.0, 140.0, 200.0, 280.0, 400.0)
MAGNIFICATION = 0.2
REPETITIONS = (12, 60)


def cases(options: Options) -> list[Case]:
    """Every focal length of a repetition after the other."""
    return [
        Case({"focal_mm": focal, "distance_m": distance_m(focal), "repetition": k}, with_lens(standard_recipe(options, k), focal))
        for k in options.repeated(*REPETITIONS)
        for focal in (FOCAL_MM_FULL if options.full else FOCAL_MM)
    ]


def distance_m(focal_mm: float) -> float:
    """Distance of the focal plane at which a thin lens has the magnification of the study."""
    return round(focal_mm * 1e-3 * (1 + 1 / MAGNIFICATION), 9)


def with_lens(recipe: Recipe, focal_mm: float) -> Recipe:
    """The same sequence through another lens."""
    return replace(recipe, hsv=HsvRecipe(focal_mm=focal_mm, distance_m=distance_m(focal_mm)))


def drawn(points: pd.DataFrame) -> Figure:
    """The three quantities beside each other."""
    picture, all_axes = figure(1, len(QUANTITIES), (9.5, 3.6))
    for axes, quantity, colour in zip(all_axes[0], QUANTITIES, COLOURS, strict=False):
        chosen = points[points["quantity"] == quantity.key]
        draw_medians(axes, chosen, Line("focal_mm", colour))
        draw_tolerance(axes, quantity)
        axes.set(xscale="log", title=quantity.title, xlabel="focal length (mm)")
        axes.set_xticks(chosen["focal_mm"].to_numpy(), [number(v) for v in chosen["focal_mm"]])
        axes.set_xticks([], minor=True)
        plain_logarithmic(axes)
    all_axes[0, 0].set_ylabel("error (%)")
    finish(picture)
    return picture


def exponent(points: pd.DataFrame, key: str, column: str) -> float:
    """The power of the focal length that the medians follow."""
    chosen = points[(points["quantity"] == key) & points[column].gt(0)]
    return float(np.polyfit(np.log(chosen["focal_mm"]), np.log(chosen[column]), 1)[0])


def page(table: pd.DataFrame, points: pd.DataFrame, options: Options) -> list[str]:
    """The page, every number from the result files."""
    shortest, longest = points["focal_mm"].min(), points["focal_mm"].max()
    ends = ", ".join(f"{q.title} {_at(points, q.key, shortest)}% → {_at(points, q.key, longest)}%" for q in QUANTITIES)
    powers = ", ".join(
        f"{q.title} {exponent(points, q.key, 'median'):.2f} ({exponent(points, q.key, 'predicted'):.2f} predicted)" for q in QUANTITIES
    )
    return [
        "# Focal length at equal magnification",
        "",
        conditions(table, options),
        f"The camera stands {number(distance_m(shortest))} m away at {number(shortest)} mm and {number(distance_m(longest))} m away at "
        f"{number(longest)} mm, so that the particle is equally large in all pictures.",
        "",
        f"![Median errors against the focal length]({options.name}.png)",
        "",
        *LEGEND,
        "",
        "## What it says",
        "",
        f"Median errors from {number(shortest)} to {number(longest)} mm: {ends}. {lost_in_words(table, 'focal_mm', 'mm')}",
        f"Power of the focal length that the medians follow: {powers}. Depth is seen in the size of the outline alone: at equal",
        "magnification the same error of size is an error of depth in proportion to the distance.",
        inside_tolerance(points, "focal_mm", "mm"),
        "",
        "What to type next: where the depth velocity matters, take the shorter lens and go nearer, for instance",
        "`tumble render --set hsv.focal_mm=50 --set hsv.distance_m=0.3 --out out/near`. Outlines of the silhouette tier are",
        "always sharp: whether the whole flight is in focus so near must be tried with `--set tier=rendered`.",
        "",
        *median_table(points, (("focal_mm", "focal length (mm)"),)),
        "",
        coverage_in_words(table),
        overconfidence_in_words(points, (("focal_mm", "mm"),)),
        "",
        *how_to_repeat(options),
    ]


def _at(points: pd.DataFrame, quantity: str, focal_mm: float) -> str:
    return number(points[(points["quantity"] == quantity) & (points["focal_mm"] == focal_mm)]["median"].iloc[0])


STUDY = Study("study_focal_length", __doc__ or "", ("focal_mm",), cases, drawn, page)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing, then write results, figure and page; exit code 1 when a sequence could not be made."""
    return conduct(STUDY, arguments)


if __name__ == "__main__":
    raise SystemExit(main())
