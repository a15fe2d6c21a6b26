"""The page of frame steps: errors and intervals where every second, fourth and eighth picture is kept."""

import pandas as pd
from matplotlib.figure import Figure

from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import frame_step
from studies.reporting.figures import COLOURS, figure, finish
from studies.reporting.laws import power_law
from studies.reporting.medians import (
    QUANTITIES,
    Line,
    bounds,
    draw_medians,
    errors,
    held_in_words,
    lay_axes,
    lost_in_words,
    median_table,
    medians,
    stated,
)
from studies.reporting.words import number, paragraph, share, table

RATE_HZ = 4000.0


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    points = medians(rows, ("step",))
    turned_rad = float((rows["spin_rads"] * rows["step"]).max()) / RATE_HZ
    return [
        "# Every picture, every second, fourth and eighth",
        *paragraph(
            f"{rows['repetition'].nunique()} flights of {', '.join(sorted(rows['particle'].unique()))}, {rows['n_frames'].max()}",
            "pictures at",
            "4000 frames/s, 60 calibrated views, outlines with 0.2 px boundary noise. Pictures are left out of one recording: flight,",
            "body,",
            f"views, noise and the time covered are the same at every step. At the largest step the fastest of them turns by"
            f" {number(turned_rad)} rad from one picture to the next.",
        ),
        "",
        "![Median errors against the step](frame_step.png)",
        "",
        *paragraph(
            "Dots: medians with 95% bootstrap intervals. Dashed: the median error that the reported error bars predict.",
            "Dotted: that of the true body's bound.",
        ),
        "",
        *median_table(points, (("step", "every n-th"),)),
        "",
        *paragraph(lost_in_words(rows), held_in_words(rows)),
        "",
        "Whole 95% ellipsoids that hold:",
        "",
        *table(("every n-th", "v", "ω"), [_ellipsoids(rows[rows["step"] == step]) for step in sorted(rows["step"].unique())]),
        "",
        "## The law",
        "",
        *paragraph(
            "Power of the step that errors follow, within flights (95% interval). With noise alone, of outlines that are independent,",
            "it would be +0.5: a quarter of the pictures, twice the error.",
        ),
        "",
        *table(("", "errors", "stated σ", "true body's bound"), [_law(rows, quantity.key) for quantity in QUANTITIES]),
    ]


def _ellipsoids(own: pd.DataFrame) -> list[str]:
    good = own[own["converged"]]
    return [str(own["step"].iloc[0]), *(share(good[f"ellipsoid95_{key}"] > 0) for key in ("v", "omega"))]


def _law(rows: pd.DataFrame, key: str) -> list[str]:
    good = rows[rows["converged"]]
    (quantity,) = (q for q in QUANTITIES if q.key == key)
    laws = [power_law(good, of(good, quantity), ("step",), "repetition")[0][0] for of in (errors, stated, bounds)]
    return [quantity.title, *map(str, laws)]


def picture(result: Result) -> Figure:
    """The three quantities beside each other."""
    points = medians(result.rows, ("step",))
    drawn, axes = figure(1, len(QUANTITIES), (9.5, 3.6))
    for here, quantity, colour in zip(axes[0], QUANTITIES, COLOURS, strict=False):
        own = points[points["quantity"] == quantity.key]
        draw_medians(here, own, Line("step", colour, "median, 95% interval"), accompanied=True)
        lay_axes(here, "every n-th picture", quantity, sorted(own["step"]))
    axes[0, 0].set_ylabel("median error")
    finish(drawn)
    return drawn


STUDY = Study("frame_step", "What is lost where every second, fourth or eighth picture is kept?", frame_step.PLAN, page, picture, __name__)
