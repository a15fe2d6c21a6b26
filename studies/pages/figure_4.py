"""The page of Figure 4: shares of poses within 5 degrees, beside the paper's, and histograms of the errors."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import figure_4
from studies.reporting.figures import COLOURS, RED, figure
from studies.reporting.words import judged, number, paragraph, share, table

WITHIN_DEG = 5.0
"""The paper's measure of a pose that was found."""
PUBLISHED = {"regular": 0.66, "irregular": 0.88}
"""Shares within 5 degrees in the paper."""
ASKED = 0.99
"""Of poses within 5 degrees with 60 views, for both kinds."""
NOTICED = 1.1
"""A next minimum whose RMS ETE is at most so many times the best one's makes a single picture ambiguous, as the estimator has it."""
EDGES_DEG = np.geomspace(0.01, 180.0, 44)


def kinds(rows: pd.DataFrame) -> list[tuple[str, pd.DataFrame]]:
    """Regular and irregular bodies."""
    return [("regular", rows[rows["regular"]]), ("irregular", rows[~rows["regular"]])]


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    return [
        "# Figure 4: the pose in one picture",
        *paragraph(
            f"{len(rows)} pictures of {rows['particle'].nunique()} shapes ({_names(rows)}), scaled and placed anew",
            f"{rows['body'].nunique()} times, 4–8 mm, outlines with 0.2 px boundary noise.",
            "A body is placed in the rig of six cameras once more than the views need, and each of the six pictures of that last placement",
            "is an unknown one: hull, centre of mass and fit come of the other views alone. The error is the angle to the pose that the",
            "picture was made with. Nothing is tracked and nothing is known of the pose before.",
        ),
        "",
        "![Histograms of pose errors, by number of views and kind of body](figure_4.png)",
        "",
        "Blue and orange: within 5°; red: beyond. Intervals of shares count pictures as independent; those of one shape are less so.",
        "",
        *table(("kind", "views", "within 5°", "the paper", "median", "95th percentile"), _shares(rows)),
        "",
        *paragraph(
            _verdict(rows),
            "The paper takes each view of a set out in turn; its particles, camera and noise are its own: its shares are a mark, no rival.",
        ),
        "",
        *_wrong(rows),
    ]


def _names(rows: pd.DataFrame) -> str:
    return ", ".join(sorted(rows["particle"].unique()))


def _shares(rows: pd.DataFrame) -> list[list[str]]:
    cells = []
    for kind, own in kinds(rows):
        for views, few in own.groupby("views"):
            error = few["error_deg"].to_numpy()
            quantiles = [f"{number(np.quantile(error, q))}°" for q in (0.5, 0.95)]
            cells.append([kind, str(views), share(error <= WITHIN_DEG), f"{PUBLISHED[kind]:.0%}", *quantiles])
    return cells


def _verdict(rows: pd.DataFrame) -> str:
    most = rows["views"].max()
    parts = []
    for kind, own in kinds(rows):
        held = own.loc[own["views"] == most, "error_deg"] <= WITHIN_DEG
        parts.append(f"{kind} {100 * held.mean():.1f}% ({judged(held, ASKED)})")
    return f"Asked of {most} views: {ASKED:.0%} within 5° for both kinds: {', '.join(parts)}."


def _wrong(rows: pd.DataFrame) -> list[str]:
    """What can be said of the poses that are wrong: whether another minimum was as good, and the best one's error."""
    wrong = rows[rows["error_deg"] > WITHIN_DEG]
    if wrong.empty:
        return ["No pose is wrong."]
    close = wrong["next_rms_px"] <= NOTICED * wrong["rms_px"]
    right = rows[rows["error_deg"] <= WITHIN_DEG]
    typical = right.groupby("views")["rms_px"].quantile(0.99)
    large = ~close & (wrong["rms_px"] > wrong["views"].map(typical))
    head = ("views", "wrong", "another minimum as good (within 10%)", "fits worse than 99% of right ones", "neither: nothing shows it")
    cells = []
    for views in sorted(wrong["views"].unique()):
        of = (wrong["views"] == views).to_numpy()
        counts = [int(np.sum(of)), *(int(np.sum(of & mask.to_numpy())) for mask in (close, large, ~close & ~large))]
        cells.append([views, *counts])
    return [
        "## Poses that are wrong",
        "",
        *table(head, cells),
        "",
        *paragraph(
            "A single picture cannot settle the first of these causes: silhouettes from opposite sides are nearly mirror images.",
            "A flight does, through its other frames ([Figure 5](figure_5.md)).",
        ),
    ]


def picture(result: Result) -> Figure:
    """A histogram for each kind (rows) and number of views (columns), counts as shares."""
    rows = result.rows
    numbers = sorted(rows["views"].unique())
    drawn, axes = figure(2, len(numbers), (9.5, 4.6))
    for row, ((kind, own), colour) in enumerate(zip(kinds(rows), COLOURS, strict=False)):
        for column, views in enumerate(numbers):
            error = np.clip(own.loc[own["views"] == views, "error_deg"].to_numpy(), EDGES_DEG[0], EDGES_DEG[-1])
            here, within = axes[row, column], error <= WITHIN_DEG
            for part, shade in ((within, colour), (~within, RED)):
                here.hist(error[part], EDGES_DEG, weights=np.full(int(part.sum()), 100 / max(len(error), 1)), color=shade)
            here.axvline(WITHIN_DEG, color="0.4", lw=1)
            here.set(xscale="log", xlim=(EDGES_DEG[0], EDGES_DEG[-1]))
            here.set_xticks([0.01, 0.1, 1, 10, 100], ["0.01", "0.1", "1", "10", "100"])
            here.set_title(f"{kind}, {views} views\n{100 * within.mean():.1f}% within 5° (paper {PUBLISHED[kind]:.0%})", fontsize=8.5)
            here.set_xlabel("error of the pose (°)" if row else "")
            here.set_ylabel("" if column else "pictures (%)")
    drawn.tight_layout()
    return drawn


STUDY = Study("figure_4", "How often is the pose found from one picture, by number of views?", figure_4.PLAN, page, picture, __name__)
