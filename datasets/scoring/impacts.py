"""One row of scores for every true impact: found or not, its time, and the velocities right before and after it.

An impact is found where a converged estimate has one within a frame of it that is nearer to no other. Velocities are scored as those of a
sequence are (:mod:`datasets.scoring.score`), against the truth at first touch and at parting; the time against first touch. A contact that
lasts ``d`` looks like an instant up to ``d`` later.

Contacts of the truth less than a frame apart, as when a second corner comes down at once, are one impact: its velocities are those before
the first and after the last of them, and a time between them is right.
"""

from typing import Any

import numpy as np
import pandas as pd

from datasets.estimate import Estimate, ImpactEstimate, Status
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import INTERVAL_95, velocity_errors
from datasets.truth import AT_ONCE_FRAMES, Impact, Truth, at_once

Row = dict[str, Any]
LARGEST_ERROR_FRAMES = 1.0
SIDES = ("before", "after")


def score_impacts(estimate: Estimate, truth: Truth) -> list[Row]:
    """A row per impact of the truth that lies within the frames, in order of time; ``contacts`` says of how many.

    ``unmatched``: measured impacts of the whole sequence that belong to none of the truth's, in every row of it.
    """
    times = truth.motion.times_s
    frame_s = float(np.median(np.diff(times)))
    inside = [i for i in truth.impacts if times[0] <= i.time_s <= times[-1]]
    events = at_once(inside, AT_ONCE_FRAMES * frame_s)
    found, unmatched = _matches(estimate, events, frame_s)
    told = {"sequence": truth.name, "unmatched": unmatched}
    return [{**told, "impact": k + 1, **_row(f, e, frame_s)} for k, (f, e) in enumerate(zip(found, events, strict=True))]


def _matches(
    estimate: Estimate, events: list[list[Impact]], frame_s: float
) -> tuple[list[tuple[ImpactEstimate, ImpactEstimate] | None], int]:
    """The first and the last measured impact, mostly one and the same, of each event, and how many measured ones belong to none.

    Each measured impact belongs to the nearest event; a second one beside an event of one contact belongs to none.
    """
    mine: list[list[ImpactEstimate]] = [[] for _ in events]
    for impact in estimate.impacts if estimate.status is Status.CONVERGED else ():
        away = [_away_s(impact, event) for event in events]
        if away and min(away) <= LARGEST_ERROR_FRAMES * frame_s:
            mine[int(np.argmin(away))].append(impact)
    taken = [min(len(found), len(event)) for found, event in zip(mine, events, strict=True)]
    measured = len(estimate.impacts) if estimate.status is Status.CONVERGED else 0
    return [_ends(found, event) if found else None for found, event in zip(mine, events, strict=True)], measured - sum(taken)


def _away_s(impact: ImpactEstimate, event: list[Impact]) -> float:
    return max(event[0].time_s - impact.time_s, impact.time_s - event[-1].time_s, 0.0)


def _ends(found: list[ImpactEstimate], event: list[Impact]) -> tuple[ImpactEstimate, ImpactEstimate]:
    if len(event) > 1:
        return found[0], found[-1]
    nearest = min(found, key=lambda i: _away_s(i, event))
    return nearest, nearest


def _row(found: tuple[ImpactEstimate, ImpactEstimate] | None, event: list[Impact], frame_s: float) -> Row:
    if found is None:
        return {"found": False, "contacts": len(event)}
    first, last = event[0], event[-1]
    latest_s = last.time_s - first.time_s if found[0] is found[1] else 0.0
    late, sigma = found[0].time_s - first.time_s, found[0].time_sigma_s
    error = max(late - latest_s, 0.0) if late > 0.0 else late
    row: Row = {
        "found": True,
        "contacts": len(event),
        "time_error_frames": abs(error) / frame_s,
        "time_sigma_frames": sigma / frame_s,
        "time_inside95": float(-INTERVAL_95 * sigma <= error <= INTERVAL_95 * sigma + last.duration_s),
    }
    before = velocity_errors(found[0].before, first.v_before, first.omega_before)
    after = velocity_errors(found[1].after, last.v_after, last.omega_after)
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
