"""The page of optics: which worse camera costs most, as ratios of errors to those of the same flight with the camera as it is."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import optics
from studies.plans.optics import BASE, VARIATIONS
from studies.reporting.figures import COLOURS, figure
from studies.reporting.medians import QUANTITIES, Quantity, errors, held_in_words, lost_in_words, median_table, medians, stated
from studies.reporting.words import number, paragraph, table

Array = NDArray[np.float64]


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    return [
        "# Optics: what limits first",
        *paragraph(
            f"{len(rows)} rendered recordings: {rows['repetition'].nunique()} flights of {', '.join(sorted(rows['particle'].unique()))},",
            "matte,",
            f"each filmed {rows['variation'].nunique()} times, with {rows['n_frames'].max()} pictures ({rows['n_frames'].min()} at half",
            "the frame rate)",
            f"and {rows['n_views'].max()} calibrated views in outlines with 0.2 px noise. The camera as it is: f/16, 50 µs, 12 bits,",
            "20,000",
            "electrons. One thing is worse at a time; flights stay the same as far as the picture lets them.",
        ),
        "",
        "![Stated standard deviations over those of the camera as it is](optics.png)",
        "",
        "Dots: flights; bars: geometric means. Right of 1: worse than the camera as it is.",
        "",
        "Geometric means over flights that both measured, over the camera as it is:",
        "",
        *table(("", "flights", *(f"σ of {q.title}" for q in QUANTITIES), *(f"error of {q.title}" for q in QUANTITIES)), _ratios(rows)),
        "",
        *paragraph(
            *_first(rows),
            "How much worse a variation is, was chosen: what it costs is of that choice. Errors of few flights are luck,",
            "stated standard deviations hardly.",
        ),
        "",
        *median_table(medians(_numbered(rows), ("number",)), (("number", "number"),)),
        "",
        *paragraph("Numbers: " + ", ".join(f"{k} {name}" for k, name in enumerate(VARIATIONS)) + "."),
        "",
        *paragraph(lost_in_words(rows), held_in_words(rows)),
    ]


def _numbered(rows: pd.DataFrame) -> pd.DataFrame:
    return rows.assign(number=rows["variation"].map({name: k for k, name in enumerate(VARIATIONS)}))


def ratios(rows: pd.DataFrame, values: Array, variation: str) -> Array:
    """``values`` (n,), any unit, of a variation over those of the same flight with the camera as it is, where both measured."""
    told = rows.assign(value=np.where(rows["converged"], values, np.nan))
    both = told.pivot(index="repetition", columns="variation", values="value")[[variation, BASE]].dropna()
    return (both[variation] / both[BASE]).to_numpy(dtype=np.float64)


def _mean(found: Array) -> float:
    return float(np.exp(np.mean(np.log(found)))) if found.size else float("nan")


def _ratios(rows: pd.DataFrame) -> list[list[str]]:
    cells = []
    for name in VARIATIONS:
        if name != BASE:
            found = [ratios(rows, of(rows, quantity), name) for of in (stated, errors) for quantity in QUANTITIES]
            cells.append([name, str(len(found[0])), *(number(_mean(each)) for each in found)])
    return cells


def _first(rows: pd.DataFrame) -> list[str]:
    """Which variation costs most of each quantity, by what estimates state."""
    worst = []
    for quantity in QUANTITIES:
        cost = {name: _mean(ratios(rows, stated(rows, quantity), name)) for name in VARIATIONS if name != BASE}
        name = max(cost, key=lambda key: cost[key] if np.isfinite(cost[key]) else 0.0)
        worst.append(f"{quantity.title}: {name} ({number(cost[name])} times)")
    return [f"What limits first, by stated standard deviations: {'; '.join(worst)}."]


def picture(result: Result) -> Figure:
    """Ratios of stated standard deviations, a row for each variation, the three quantities beside each other."""
    rows = result.rows
    names = [name for name in VARIATIONS if name != BASE]
    drawn, axes = figure(1, len(QUANTITIES), (9.5, 3.6))
    for here, quantity, colour in zip(axes[0], QUANTITIES, COLOURS, strict=False):
        _draw(here, rows, quantity, (names, colour))
        here.set_yticks(range(len(names)), names if here is axes[0, 0] else [""] * len(names))
    drawn.tight_layout()
    return drawn


def _draw(here: Axes, rows: pd.DataFrame, quantity: Quantity, look: tuple[list[str], str]) -> None:
    names, colour = look
    for k, name in enumerate(names):
        found = ratios(rows, stated(rows, quantity), name)
        here.plot(found, np.full(len(found), k), "o", ms=4, color=colour, alpha=0.7)
        here.plot([1.0, _mean(found)], [k, k], "-", lw=5, color=colour, alpha=0.3, solid_capstyle="butt")
    here.axvline(1.0, color="0.4", lw=1)
    here.set_xscale("log")
    here.set_xticks([0.5, 1, 2, 4], ["0.5", "1", "2", "4"])
    here.set_xticks([], minor=True)
    here.set_xlim(0.7, 5.0)
    here.set_xlabel("stated σ over that of the base")
    here.set_title(quantity.title)
    here.invert_yaxis()


STUDY = Study("optics", "Which worse thing about camera and light limits first?", optics.PLAN, page, picture, __name__)
