"""The page of the factorial: medians of every combination, and the law that errors follow over length, irregularity and views."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import factorial
from studies.reporting.figures import COLOURS, figure, finish, plain_logarithmic
from studies.reporting.laws import power_law
from studies.reporting.medians import (
    QUANTITIES,
    Line,
    bounds,
    draw_medians,
    errors,
    held_in_words,
    lost_in_words,
    median_table,
    medians,
    stated,
)
from studies.reporting.words import number, paragraph, table

FACTORS = {"n_frames": "frames", "irregularity": "irregularity", "n_views": "views"}
"""Columns that the law has powers of, and what they are called."""
APART = 0.03
"""How far lines are moved apart, as a share of the value."""


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    points = medians(rows, ("frames", "deformation", "views"))
    shape = rows.groupby("deformation")["irregularity"].median()
    return [
        "# Length, irregularity and views in every combination",
        *paragraph(
            f"{len(rows)} flights: {rows['repetition'].nunique()} draws of flight, spin and body in each of",
            f"{len(points) // len(QUANTITIES)} combinations,",
            "4–8 mm lumps of the procedural family, 4000 frames/s, 1–2 m/s, 50–300 rad/s, outlines with 0.2 px boundary noise.",
            "Irregularity",
            "(1 − sphericity × convexity) is "
            + ", ".join(f"{number(value)} at deformation {number(key)}" for key, value in shape.items())
            + ".",
        ),
        "",
        "![Median errors against length, by irregularity and views](factorial.png)",
        "",
        "Lines: calibrated views. Dots: medians with 95% bootstrap intervals where there are six draws and more.",
        "",
        "## The law",
        "",
        *paragraph(
            "Errors as products of powers, with a constant for every draw (95% intervals), of the flights whose last fit is to outline",
            f"samples; the {len(rows) - len(by_samples(rows))} others, whose views are too few for it or which were not measured, are",
            "left out.",
            "*Scatter*: standard deviation of the logarithm of an error about the law; of an error of one, two and three equal components",
            "with nothing unexplained it is 1.1, 0.64 and 0.48.",
        ),
        "",
        *table(("", "of", *FACTORS.values(), "scatter"), _laws(rows)),
        "",
        "## Every combination",
        "",
        *median_table(points, (("frames", "frames"), ("deformation", "deformation"), ("views", "views"))),
        "",
        *paragraph(lost_in_words(rows), held_in_words(rows)),
        "",
        *table(
            ("last fit", "flights", *(f"{q.title}: pull" for q in QUANTITIES), *(f"{q.title} in 95%" for q in QUANTITIES)), _by_fit(rows)
        ),
    ]


def by_samples(rows: pd.DataFrame) -> pd.DataFrame:
    """Flights that were measured to the end by outline samples."""
    return rows[rows["converged"] & rows["by_samples"]]


def _laws(rows: pd.DataFrame) -> list[list[str]]:
    good = by_samples(rows)
    cells = []
    for quantity in QUANTITIES:
        for name, of in (("errors", errors), ("stated σ", stated), ("true body's bound", bounds)):
            exponents, scatter = power_law(good, of(good, quantity), tuple(FACTORS), "repetition")
            cells.append([quantity.title, name, *map(str, exponents), number(scatter)])
    return cells


def _by_fit(rows: pd.DataFrame) -> list[list[str]]:
    good = rows[rows["converged"]].assign(fit=lambda own: own["by_samples"].map({True: "samples", False: "tangents"}))
    points = medians(good, ("fit",))
    cells = []
    for fit, own in points.groupby("fit"):
        by = own.set_index("quantity")
        pulls = [number(by["pull"][q.key]) for q in QUANTITIES]
        held = [f"{100 * float(by['coverage'][q.key]):.1f}%" for q in QUANTITIES]
        cells.append([str(fit), str(by["n"].iloc[0]), *pulls, *held])
    return cells


def picture(result: Result) -> Figure:
    """Quantities below each other, irregularities beside each other, a line for each number of views."""
    points = medians(result.rows, ("frames", "deformation", "views"))
    shapes = sorted(points["deformation"].unique())
    drawn, axes = figure(len(QUANTITIES), len(shapes), (9.5, 7.4))
    for row, quantity in enumerate(QUANTITIES):
        for column, shape in enumerate(shapes):
            own = points[(points["quantity"] == quantity.key) & (points["deformation"] == shape)]
            _draw(axes[row, column], own)
            axes[row, column].set_title(f"deformation {number(shape)}" if row == 0 else "")
            axes[row, column].set_xlabel("frames" if row == len(QUANTITIES) - 1 else "")
            axes[row, column].set_ylabel("" if column else f"{quantity.title} ({quantity.unit})")
        low, high = (pick(here.get_ylim()[k] for here in axes[row]) for k, pick in ((0, min), (1, max)))
        for here in axes[row]:
            here.set_ylim(low, high)
            plain_logarithmic(here)
    finish(drawn)
    return drawn


def _draw(here: Axes, own: pd.DataFrame) -> None:
    for k, (views, colour) in enumerate(zip(sorted(own["views"].unique()), COLOURS, strict=False)):
        draw_medians(here, own[own["views"] == views], Line("frames", colour, f"{views} views", moved=1 + APART * (k - 1)))
    here.set(xscale="log", yscale="log")
    here.set_xticks(sorted(own["frames"].unique()), [str(frames) for frames in sorted(own["frames"].unique())])
    here.set_xticks([], minor=True)


STUDY = Study("factorial", "How do errors follow length, irregularity and number of views?", factorial.PLAN, page, picture, __name__)
