"""What a table of scored impacts says, as figures and as parts of a page."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from datasets.estimate import ImpactEstimate
from datasets.scoring.impacts import impact_summary
from datasets.scoring.score import INTERVAL_95
from datasets.truth import Impact

Array = NDArray[np.float64]
QUANTITIES = {
    "in-plane v, mm/s": ("in_plane_ms", ("vx", "vy"), "v"),
    "depth v, mm/s": ("out_of_plane_ms", ("vz",), "v"),
    "omega, rad/s": ("angular_rads", ("wx", "wy", "wz"), "omega"),
}
"""Errors of a side of an impact: their column, their components, and the ellipsoid that they lie in."""
CONTACT = ("restitution", "impulse_ratio")


def impact_figures(table: pd.DataFrame) -> dict[str, Any]:
    """The figures a reader asks for first, of all impacts and of the first of each sequence, and what was missed."""
    sequences = table.drop_duplicates("sequence")
    missed = table[~table["found"].astype(bool)]
    return {
        "sequences": len(sequences),
        "statuses": {str(k): int(v) for k, v in sequences["status"].value_counts().items()},
        "all_impacts": impact_summary(table),
        "first_impacts": impact_summary(table[table["impact"] == 1]),
        "median_cpu_s": float(sequences["cpu_s"].median()),
        "unmatched": int(sequences["unmatched"].sum()),
        "missed": missed[["sequence", "impact", "status", "message"]].to_dict("records"),
    }


def impacts_table(result: Mapping[str, Any]) -> str:
    """First and all impacts: found, errors, coverage."""
    first, every = result["first_impacts"], result["all_impacts"]
    rows = [("impacts", "impacts", "{:d}"), ("found", "found", "{:d}")]
    rows += [("error of the time, median (frames)", "median_time_error_frames", "{:.3f}")]
    for side in ("before", "after"):
        for key, name in (("in_plane", "in-plane v"), ("out_of_plane", "out-of-plane v"), ("angular", "ω")):
            rows.append((f"{name} {side} the impact, median error (%)", f"median_{side}_{key}_percent", "{:.3f}"))
    coverages = ("time", "before_v", "before_omega", "after_v", "after_omega")
    for key, name in zip(coverages, ("time", "v before", "ω before", "v after", "ω after"), strict=True):
        rows.append((f"95% intervals of {name} that hold the truth", f"coverage_{key}", "{:.1%}"))
    body = "\n".join(f"| {name} | {_cell(first, key, form)} | {_cell(every, key, form)} |" for name, key, form in rows)
    return f"| | first impacts | all impacts |\n| --- | --- | --- |\n{body}"


def _cell(told: Mapping[str, Any], key: str, form: str) -> str:
    return form.format(told[key]) if key in told else "–"


def statuses_of(result: Mapping[str, Any]) -> str:
    """How many sequences ended how."""
    return ", ".join(f"{count} {status}" for status, count in result["statuses"].items())


def not_found(result: Mapping[str, Any]) -> str:
    """The impacts that were missed, and what was said of their sequences."""
    missed = "\n".join(f"- {m['sequence']}, impact {m['impact']}: {m['status']}. {m['message']}" for m in result["missed"])
    invented = f"\n\nMeasured impacts that are none: {result['unmatched']}." if "unmatched" in result else ""
    return f"Not found:\n\n{missed or 'None.'}{invented}"


def contact_errors(found: ImpactEstimate, true: Impact) -> dict[str, float]:
    """By how much a measured impact is off in what contact models are fitted to, seen at the true point and along the true normal.

    Restitution: velocity along the normal at parting over that at first touch, less its sign. Impulse ratio: along the plate over along the
    normal.
    """
    measured = _contact(
        np.stack([found.before.v_world, found.after.v_world]), np.stack([found.before.omega_world, found.after.omega_world]), true
    )
    known = _contact(np.stack([true.v_before, true.v_after]), np.stack([true.omega_before, true.omega_after]), true)
    return {f"{name}_error": float(m - k) for name, m, k in zip(CONTACT, measured, known, strict=True)}


def _contact(v: Array, omega: Array, true: Impact) -> tuple[float, float]:
    """Restitution and impulse ratio of velocities ``v`` and ``omega`` (2, 3) before and after an impact."""
    n = true.normal_world
    along = (v + np.cross(omega, true.point_world - true.x_world) - true.plate_velocity_world) @ n
    impulse = v[1] - v[0]
    return float(-along[1] / along[0]), float(np.linalg.norm(impulse - (impulse @ n) * n) / (impulse @ n))


def compared_figures(tables: Mapping[str, pd.DataFrame]) -> dict[str, Any]:
    """Errors before the first impact of a sequence and after its last, by fit; of sequences of which every fit found all impacts."""
    whole = {fit: table.groupby("sequence")["found"].all() for fit, table in tables.items()}
    every = pd.DataFrame(whole).all(axis=1)
    shared = every.index[every]
    told: dict[str, Any] = {"sequences": len(every), "found_by_all": len(shared)}
    for fit, table in tables.items():
        one = table.drop_duplicates("sequence")
        told[fit] = {"statuses": {str(k): int(v) for k, v in one["status"].value_counts().items()}, "cpu_s": float(one["cpu_s"].median())}
        told[fit]["errors"] = _errors(table[table["sequence"].isin(shared)]) if len(shared) else {}
    return told


def _errors(table: pd.DataFrame) -> dict[str, Any]:
    told = {}
    ends = {"before": table.drop_duplicates("sequence"), "after": table.drop_duplicates("sequence", keep="last")}
    for side, rows in ends.items():
        for name, (column, components, vector) in QUANTITIES.items():
            pulls = rows[[f"{side}_pull_{c}" for c in components]].to_numpy(np.float64)
            size = rows[f"{side}_{column}"].to_numpy(np.float64) * (1e3 if name.endswith("mm/s") else 1.0)
            told[f"{name} {side}"] = {
                "rmse": float(np.sqrt(np.mean(size**2) / len(components))),
                "median": float(np.median(size) / np.sqrt(len(components))),
                "pull_rms": float(np.sqrt(np.mean(pulls**2))),
                "inside_95": float(np.mean(np.abs(pulls) <= INTERVAL_95)),
                "ellipsoids": float(rows[f"{side}_ellipsoid95_{vector}"].mean()),
            }
    for name in CONTACT:
        off = ends["before"].get(f"{name}_error", pd.Series(dtype=np.float64)).dropna().to_numpy(np.float64)
        if len(off):
            told[name] = {"rmse": float(np.sqrt(np.mean(off**2))), "median": float(np.median(np.abs(off)))}
    return told


def compared_table(result: Mapping[str, Mapping[str, Any]], fits: Sequence[str]) -> str:
    """Those figures: a line for each body and quantity."""
    heads = [f"{figure}, {fit}" for figure in ("RMSE", "median", "pull", "in 95%", "ellipsoids") for fit in fits]
    lines = [f"| body | | n | {' | '.join(heads)} |", f"| --- | --- | --- |{' --- |' * len(heads)}"]
    for body, told in result.items():
        for name in told[fits[0]]["errors"]:
            cells = [told[fit]["errors"][name] for fit in fits]
            shown = [_figure(cell, key, form) for key, form in FORMS.items() for cell in cells]
            lines.append(f"| {body} | {name} | {told['found_by_all']} | {' | '.join(shown)} |")
    return "\n".join(lines)


FORMS = {"rmse": "{:.3g}", "median": "{:.3g}", "pull_rms": "{:.2f}", "inside_95": "{:.0%}", "ellipsoids": "{:.0%}"}


def _figure(cell: Mapping[str, float], key: str, form: str) -> str:
    return form.format(cell[key]) if key in cell else "–"
