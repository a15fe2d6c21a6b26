"""One row of scores for every true impact: found or not, its time, and the velocities right before and after it.

An impact is found where a converged estimate has one within a frame of it. Velocities are scored as those of a sequence are
(:mod:`datasets.scoring.score`), against the truth at first touch and at parting; the time against first touch. A contact that lasts
``d`` looks like an instant up to ``d`` later.
"""

from typing import Any

import numpy as np
import pandas as pd

from datasets.estimate import Estimate, ImpactEstimate, Status
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import INTERVAL_95, velocity_errors
from datasets.truth import Impact, Truth

Row = dict[str, Any]
LARGEST_ERROR_FRAMES = 1.0
SIDES = ("before", "after")


def score_impacts(estimate: Estimate, truth: Truth) -> list[Row]:
    """A row per impact of the truth that lies within the frames, in order of time."""
    times = truth.motion.times_s
    frame_s = float(np.median(np.diff(times)))
    inside = [(k, i) for k, i in enumerate(truth.impacts) if times[0] <= i.time_s <= times[-1]]
    return [{"sequence": truth.name, "impact": k + 1, **_row(_match(estimate, i, frame_s), i, frame_s)} for k, i in inside]


def _match(estimate: Estimate, impact: Impact, frame_s: float) -> ImpactEstimate | None:
    if estimate.status is not Status.CONVERGED:
        return None
    nearest = min(estimate.impacts, key=lambda i: abs(i.time_s - impact.time_s), default=None)
    near = nearest is not None and abs(nearest.time_s - impact.time_s) <= LARGEST_ERROR_FRAMES * frame_s
    return nearest if near else None


def _row(found: ImpactEstimate | None, impact: Impact, frame_s: float) -> Row:
    if found is None:
        return {"found": False}
    error, sigma = found.time_s - impact.time_s, found.time_sigma_s
    row: Row = {
        "found": True,
        "time_error_frames": abs(error) / frame_s,
        "time_sigma_frames": sigma / frame_s,
        "time_inside95": float(-INTERVAL_95 * sigma <= error <= INTERVAL_95 * sigma + impact.duration_s),
    }
    before = velocity_errors(found.before, impact.v_before, impact.omega_before)
    after = velocity_errors(found.after, impact.v_after, impact.omega_after)
    for side, errors in zip(SIDES, (before, after), strict=True):
        row |= {f"{side}_{key}": value for key, value in errors.items()}
    return row


def impact_table(rows: list[Row]) -> pd.DataFrame:
    """Rows as a table, with ``found`` even where there is none."""
    return pd.DataFrame(rows) if rows else pd.DataFrame({"sequence": [], "impact": [], "found": []})


def impact_summary(table: pd.DataFrame) -> Row:
    """Share found, medians and coverage over a table of impacts; medians and coverage are those of the impacts found."""
    found = table[table["found"].astype(bool)]
    summary: Row = {"impacts": len(table), "found": len(found)}
    if len(found) == 0:
        return summary
    summary["median_time_error_frames"] = float(found["time_error_frames"].median())
    summary["coverage_time"] = float(found["time_inside95"].mean())
    for side in SIDES:
        for key in ("in_plane_percent", "out_of_plane_percent", "angular_percent"):
            summary[f"median_{side}_{key}"] = float(found[f"{side}_{key}"].median())
        for part, names in (("v", COMPONENTS[:3]), ("omega", COMPONENTS[3:])):
            summary[f"coverage_{side}_{part}"] = float(found[[f"{side}_inside95_{name}" for name in names]].to_numpy(np.float64).mean())
    return summary
