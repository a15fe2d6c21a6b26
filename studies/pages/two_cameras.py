"""The page of two cameras: errors by the second camera's angle, depth beside the plane, and the clock that nobody knew."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from numpy.typing import NDArray

from datasets.scoring.score import INTERVAL_95
from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import two_cameras
from studies.plans.two_cameras import ARRANGEMENTS, UNKNOWN_CLOCK
from studies.reporting.figures import COLOURS, figure, finish, plain_logarithmic
from studies.reporting.medians import (
    QUANTITIES,
    Line,
    draw_medians,
    errors,
    held_in_words,
    lost_in_words,
    median_table,
    medians,
    stated,
)
from studies.reporting.words import number, paragraph, share, table

Array = NDArray[np.float64]
IN_PLANE, DEPTH, _ = QUANTITIES


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    return [
        "# Two cameras",
        *paragraph(
            f"{rows['repetition'].nunique()} flights of {', '.join(sorted(rows['particle'].unique()))}, {rows['n_frames'].max()}",
            f"pictures at 4000 frames/s, {rows['n_views'].max()} calibrated views, outlines with 0.2 px boundary noise, filmed by one",
            "camera and by a second one aimed at the middle of the flights at an angle to it. Lenses and poses are exact. Each",
            "arrangement draws flights that stay in all of its pictures, so that with another camera some flights are others.",
        ),
        "",
        "![Median errors by arrangement](two_cameras.png)",
        "",
        *paragraph(
            "Dots: medians with 95% bootstrap intervals where there are six flights and more. Dashes: the median error that the reported",
            "error bars predict.",
        ),
        "",
        *median_table(medians(_numbered(rows), ("number",)), (("number", "number"),)),
        "",
        *paragraph("Numbers: " + ", ".join(f"{k} {name}" for k, name in enumerate(ARRANGEMENTS)) + "."),
        "",
        "## Depth over plane",
        "",
        *paragraph(
            "Error of depth over that of one component in the plane: of root mean squares over flights, and of stated standard",
            "deviations (geometric mean). Whole 95% ellipsoids that hold the truth.",
        ),
        "",
        *table(("", "errors", "stated σ", "ellipsoids of v", "of ω"), [_ratios(rows, name) for name in ARRANGEMENTS]),
        "",
        *_clock(rows[rows["second"] == UNKNOWN_CLOCK]),
        "",
        *paragraph(lost_in_words(rows), held_in_words(rows)),
        "",
        *paragraph(
            "What to type next: where depth matters, add a camera ([how recordings of two are read](../recordings.md)), as near to 90°",
            "as the rig lets you; its trigger need not be in step, where `offset_sigma_frames` says how far off it may be.",
        ),
    ]


def _numbered(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(number=rows["second"].map({name: k for k, name in enumerate(ARRANGEMENTS)}))


def _ratios(rows: pd.DataFrame, name: str) -> list[str]:
    own = rows[(rows["second"] == name) & rows["converged"]]
    depth, plane = (_rms(errors(own, q)) / np.sqrt(len(q.components)) for q in (DEPTH, IN_PLANE))
    sigmas = np.sqrt(2.0) * stated(own, DEPTH) / stated(own, IN_PLANE)
    told = float(np.exp(np.mean(np.log(sigmas)))) if len(own) else float("nan")
    return [name, number(depth / plane), number(told), *(share(own[f"ellipsoid95_{key}"] > 0) for key in ("v", "omega"))]


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def _clock(own: pd.DataFrame) -> list[str]:
    fitted = own.dropna(subset=["clock_error_frames"])
    if fitted.empty:
        return ["No clock was fitted."]
    off, sigma = (fitted[key].to_numpy(dtype=np.float64) for key in ("clock_error_frames", "clock_sigma_frames"))
    return paragraph(
        "**The clock.** Half a frame of offset, of which the estimator is told no more than its standard deviation (half a frame), is",
        f"found to {number(_rms(off))} frames (root mean square of {len(fitted)}; the largest error is {number(np.abs(off).max())});",
        f"95% intervals hold the truth in {share(np.abs(off) <= INTERVAL_95 * sigma)}.",
    )


def picture(result: Result) -> Figure:
    """The three quantities beside each other, an arrangement at each mark."""
    points = medians(_numbered(result.rows), ("number",))
    drawn, axes = figure(1, len(QUANTITIES), (9.5, 3.8))
    names = [name.replace(", ", ",\n").replace("half a frame", "half\na frame") for name in ARRANGEMENTS]
    for here, quantity, colour in zip(axes[0], QUANTITIES, COLOURS, strict=False):
        own = points[points["quantity"] == quantity.key]
        here.plot(own["number"], own["predicted"], "_", ms=18, mew=1.4, color="0.25", label="predicted by the error bars")
        draw_medians(here, own, Line("number", colour, "median, 95% interval", ""))
        here.set_xticks(range(len(names)), names, fontsize=8)
        here.set_xlim(-0.4, len(names) - 0.6)
        here.set_title(f"{quantity.title} ({quantity.unit})")
        plain_logarithmic(here)
    axes[0, 0].set_ylabel("median error")
    finish(drawn)
    return drawn


QUESTION = "What is a second camera worth, by its angle, and is an unknown offset of its clock found?"
STUDY = Study("two_cameras", QUESTION, two_cameras.PLAN, page, picture, __name__)
