"""The page of depth: errors against the focal length at equal magnification, by direction of flight, with one camera and two."""

import pandas as pd
from matplotlib.figure import Figure

from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import depth
from studies.reporting.figures import COLOURS, figure, finish
from studies.reporting.laws import power_law
from studies.reporting.medians import (
    QUANTITIES,
    Line,
    draw_medians,
    errors,
    held_in_words,
    lay_axes,
    lost_in_words,
    median_table,
    medians,
    stated,
)
from studies.reporting.words import number, paragraph, table

POINTS = (("cameras", "cameras"), ("focal_mm", "focal length (mm)"), ("direction_deg", "direction (°)"))
STYLES = ("-", "--", ":")


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    points = medians(rows, [column for column, _ in POINTS])
    shortest, longest = rows["focal_mm"].min(), rows["focal_mm"].max()
    return [
        "# Depth: lens, direction of flight, one camera and two",
        *paragraph(
            f"{len(rows)} flights: {rows['repetition'].nunique()} draws of body ({', '.join(sorted(rows['particle'].unique()))}) and",
            "spin at each point,",
            "100 frames at 4000 frames/s, 1.5 m/s at the start, 60 calibrated views, outlines with 0.2 px boundary noise, 0.1 mm per",
            "pixel whatever",
            f"the lens: the camera stands {number(depth.distance_m(shortest))} m away at {number(shortest)} mm and",
            f"{number(depth.distance_m(longest))} m away at",
            f"{number(longest)} mm. *Direction*: of the velocity at the start from the first camera's image plane; 90° is along its",
            "axis. A second",
            "camera stands at 90° to the first, its clock known.",
        ),
        "",
        "![Median errors against the focal length](depth.png)",
        "",
        *paragraph(
            "Blue: one camera; orange: two. Whole lines: within the image plane; dashed: along the axis. Dots: medians with 95%",
            "bootstrap intervals",
            "where there are six draws and more.",
        ),
        "",
        *median_table(points, POINTS),
        "",
        "## The law",
        "",
        *paragraph(
            "Power of the focal length that errors follow, within draws (95% intervals). Depth is seen in the size of an outline alone:",
            "at equal",
            "magnification an error of size is one of depth in proportion to the distance (+1 for one camera). A second camera sees",
            "depth as the",
            "first one sees its plane (0).",
        ),
        "",
        *table(("cameras", "", "errors", "stated σ"), _laws(rows)),
        "",
        *paragraph(lost_in_words(rows), held_in_words(rows)),
        "",
        *paragraph(
            "What to type next: where the depth velocity matters, add a camera (`[[further_hsv]]` in a recipe); with one, take the",
            "shorter lens and",
            "go nearer, for instance `tumble render --set hsv.focal_mm=50 --set hsv.distance_m=0.3 --out out/near`. Outlines of the",
            "silhouette tier",
            "are always sharp: whether a whole flight is in focus so near has to be tried with `--set tier=rendered`.",
        ),
    ]


def _laws(rows: pd.DataFrame) -> list[list[str]]:
    cells = []
    for cameras, own in rows[rows["converged"]].groupby("cameras"):
        drawn = own.assign(draw=own["repetition"].astype(str) + "/" + own["direction_deg"].astype(str))
        for quantity in QUANTITIES:
            laws = [power_law(drawn, of(drawn, quantity), ("focal_mm",), "draw")[0][0] for of in (errors, stated)]
            cells.append([str(cameras), quantity.title, *map(str, laws)])
    return cells


def picture(result: Result) -> Figure:
    """The three quantities beside each other; colours are cameras, styles directions."""
    points = medians(result.rows, [column for column, _ in POINTS])
    drawn, axes = figure(1, len(QUANTITIES), (9.5, 3.8))
    for here, quantity in zip(axes[0], QUANTITIES, strict=True):
        own = points[points["quantity"] == quantity.key]
        for cameras, colour in zip(sorted(own["cameras"].unique()), COLOURS, strict=False):
            for direction, style in zip(sorted(own["direction_deg"].unique()), STYLES, strict=False):
                of = own[(own["cameras"] == cameras) & (own["direction_deg"] == direction)]
                label = f"{cameras} camera{'s' if cameras > 1 else ''}, {direction:g}°"
                draw_medians(here, of, Line("focal_mm", colour, label, style))
        lay_axes(here, "focal length (mm)", quantity, sorted(own["focal_mm"].unique()))
    axes[0, 0].set_ylabel("median error")
    finish(drawn)
    return drawn


STUDY = Study("depth", "What do lens, direction of flight and a second camera do to depth?", depth.PLAN, page, picture, __name__)
