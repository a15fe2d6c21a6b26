"""One row of scores for every collision of two particles: point, normal, restitution, impulse, mass ratio and momentum beside the truth.

The true values are those of the contact at first touch and at parting: relative velocity of the two bodies at the true point along the true
normal, ``e = -u_after / u_before``; tangential over normal impulse. Times and velocities are scored as every impact's are
(:mod:`datasets.scoring.impacts`), a row for each of the two.
"""

from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from datasets.estimate import CollisionEstimate, Estimate, Measured, Status
from datasets.observation import COMPANION
from datasets.scoring.score import INTERVAL_95
from datasets.truth import Impact, Truth

Array = NDArray[np.float64]
Row = dict[str, Any]
MEASURED = ("approach_ms", "separation_ms", "restitution", "impulse_ratio", "mass_ratio", "momentum_mass_ratio")


def parts_of(estimate: Estimate, truth: Truth) -> list[tuple[str, Estimate, Truth]]:
    """Both particles of a sequence, each with the name that its rows get; one where there is one."""
    first = [(truth.name, estimate, truth)]
    if estimate.companion is None or truth.companion is None:
        return first
    return [*first, (truth.name + COMPANION, estimate.companion, truth.companion)]


def score_collision(estimate: Estimate, truth: Truth) -> list[Row]:
    """The row of a sequence whose truth is a collision; none for others."""
    if truth.companion is None or not truth.impacts:
        return []
    found = estimate.collision if estimate.status is Status.CONVERGED else None
    first, second = truth.impacts[0], truth.companion.impacts[0]
    row: Row = {"sequence": truth.name, "status": estimate.status.value, "found": found is not None}
    return [row if found is None else row | _errors(found, (first, second), truth.mass_kg / truth.companion.mass_kg)]


def true_collision(first: Impact, second: Impact, mass_ratio: float) -> dict[str, float]:
    """What a collision truly was, by the names of :data:`MEASURED`."""
    n, point = first.normal_world, first.point_world
    before = _velocity(first.v_before, first.omega_before, point - first.x_world)
    before = before - _velocity(second.v_before, second.omega_before, point - second.x_world)
    after = _velocity(first.v_after, first.omega_after, point - first.x_world)
    after = after - _velocity(second.v_after, second.omega_after, point - second.x_world)
    approach, separation = float(before @ n), float(after @ n)
    along = float(first.impulse_world @ n)
    across = float(np.linalg.norm(first.impulse_world - along * n))
    return {
        "approach_ms": approach,
        "separation_ms": separation,
        "restitution": -separation / approach,
        "impulse_ratio": across / along,
        "mass_ratio": mass_ratio,
        "momentum_mass_ratio": mass_ratio,
    }


def _velocity(v: Array, omega: Array, arm: Array) -> Array:
    return np.asarray(v + np.cross(omega, arm))


def _errors(found: CollisionEstimate, impacts: tuple[Impact, Impact], mass_ratio: float) -> Row:
    cosine = float(np.clip(found.normal_world @ impacts[0].normal_world, -1.0, 1.0))
    row: Row = {
        "point_error_mm": 1e3 * float(np.linalg.norm(found.point_world - impacts[0].point_world)),
        "normal_error_deg": float(np.degrees(np.arccos(cosine))),
        "normal_sigma_deg": float(np.degrees(found.normal_sigma_rad)),
        "gap_mm": 1e3 * found.gap_m.value,
        "gap_sigma_mm": 1e3 * found.gap_m.sigma,
        "momentum_kept": found.momentum_kept,
    }
    for name, true in true_collision(*impacts, mass_ratio).items():
        measured: Measured = getattr(found, name)
        error = measured.value - true
        row |= {name: measured.value, f"{name}_true": true, f"{name}_sigma": measured.sigma}
        row[f"{name}_inside95"] = float(abs(error) <= INTERVAL_95 * measured.sigma)
    return row


def collision_summary(table: pd.DataFrame) -> Row:
    """Shares and medians over a table of collisions."""
    found = table[table["found"].astype(bool)]
    summary: Row = {"collisions": len(table), "found": len(found)}
    if len(found) == 0:
        return summary
    summary["momentum_kept"] = int(found["momentum_kept"].sum())
    summary["median_normal_error_deg"] = float(found["normal_error_deg"].median())
    for name in MEASURED:
        error = (found[name] - found[f"{name}_true"]).abs()
        summary[f"median_{name}_error"] = float(error.median())
        summary[f"coverage_{name}"] = float(found[f"{name}_inside95"].mean())
    return summary
