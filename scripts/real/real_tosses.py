"""Real tosses of a cube, tracked by its tags: what the tool finds in their free flight, whatever it is.

``python -m scripts.real.real_tosses --tosses FOLDER`` writes ``docs/results/real_tosses.json`` and, from it, the page and picture in
``docs/studies``. FOLDER holds ``cube_tosses.npz`` (Pfrommer, Halm and Posa 2020): poses at 148 Hz, of which the rows before the cube's
lowest corner comes near the board are used. Velocities in the file were filtered upstream and are not read. ``--page`` writes the page
alone.
"""

import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.trajectory_files import read_trajectory, trajectories_in
from estimator.diagnosis.adding import with_effect
from estimator.diagnosis.diagnose import Diagnosis, diagnose, tested_values
from estimator.diagnosis.explain import Explanation, explain
from estimator.diagnosis.noise_floor import noise_floor
from estimator.diagnosis.residual_maps import residual_maps, shown
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.held_out import held_out
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.reports.campaign_reporting import effect_values
from scripts.real.real_tosses_page import page
from scripts.real.toss_study import TossStudy, toss_command
from tumble.diagnosis_documents import value_entries
from tumble.reports.map_words import sentence_of

Array = NDArray[np.float64]
RATE_HZ, HALF_WIDTH_M, GRAVITY_MS2 = 148.0, 0.0524, 9.81
CLEAR_M, LEAST_ROWS = 0.003, 8
"""Height of the lowest corner above the board from which a row counts as free flight."""
ENDS = 2
"""Rows left out at both ends, to see whether a hand or the board has a part in it."""
ALONE = ("length_scale", "frame_rate", "gravity", "linear_drag", "quadratic_drag", "magnus_lift", "centre_of_mass", "spin_damping")


def free_flights(path: Path) -> list[tuple[Array, Array]]:
    """Positions (n, 3) m and quaternions (n, 4), scalar last, of every toss before its first contact."""
    with np.load(path) as archive:
        data, offsets = archive["data"], archive["offsets"]
    corners = HALF_WIDTH_M * np.array([[a, b, c] for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
    flights = []
    for first, last in pairwise(offsets):
        x, q = data[first:last, :3], data[first:last, [4, 5, 6, 3]]
        lowest = x[:, 2] + (Rotation.from_quat(q).as_matrix() @ corners.T)[:, 2].min(axis=1)
        near = np.flatnonzero(lowest < CLEAR_M)
        rows = int(near[0]) if len(near) else len(x)
        if rows >= LEAST_ROWS:
            flights.append((x[:rows], q[:rows]))
    return flights


def write_flights(flights: Sequence[tuple[Array, Array]], folder: Path, rate_hz: float = RATE_HZ) -> None:
    """One TUM file for each flight, its rows at ``rate_hz``, and what holds for all of them beside them."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, (x, q) in enumerate(flights):
        rows = np.column_stack([np.arange(len(x)) / rate_hz, x, q])
        lines = [" ".join(repr(float(value)) for value in row) for row in rows]
        (folder / f"toss_{number:02d}.tum").write_text("# timestamp tx ty tz qx qy qz qw\n" + "\n".join(lines) + "\n")
    (folder / "trajectory.toml").write_text(f"gravity_world = [0.0, 0.0, -{GRAVITY_MS2}]\ninertia_ratios = [1.0, 1.0, 1.0]\n")


def plain_falls(flights: Sequence[tuple[Array, Array]]) -> Array:
    """Acceleration (k, 3) m/s² of each flight: a parabola through its positions, nothing else."""
    found = []
    for x, _ in flights:
        t = np.arange(len(x)) / RATE_HZ
        found.append(2.0 * np.polynomial.polynomial.polyfit(t - t.mean(), x, 2)[2])
    return np.array(found)


def resting_height(path: Path) -> Array:
    """Height (k,) m of the cube's middle in the last row of every toss."""
    with np.load(path) as archive:
        return np.asarray(archive["data"][archive["offsets"][1:] - 1, 2])


def values_of(registered: Registered, fit: CampaignFit) -> list[dict[str, Any]]:
    """Fitted values with their standard deviations and intervals."""
    return value_entries(effect_values(registered, fit, campaign_covariance(registered.campaign, fit)))


def diagnosis_of(found: Diagnosis) -> dict[str, Any]:
    """Every candidate: what it explains, its p-value, and its first values."""
    rows = []
    for finding in found.findings:
        values = [
            {"parameter": v.parameter.name, "value": v.value, "sigma": v.sigma} for v in tested_values(finding.test) if v.sequence is None
        ]
        rows.append({"effect": finding.key, "share": finding.share, "p": finding.p, "columns": len(finding.test.columns), "values": values})
    return {"group": list(found.group), "candidates": rows}


def explanation_of(registered: Registered, told: Explanation) -> dict[str, Any]:
    """The steps, what was dropped, what is in the last model, and what is left unknown."""
    steps = [
        {"added": s.added, "group": list(s.group), "before": s.before.rms_px, "after": s.after.rms_px, "probability": s.probability}
        for s in told.steps
    ]
    left = {"stage": told.left.stage.value, "p": told.left.p, "present": told.left.present}
    return {
        "steps": steps,
        "found": list(told.found),
        "values": values_of(registered, told.fit),
        "left": left,
    }


def alone(registered: Registered, base: CampaignFit) -> list[dict[str, Any]]:
    """Some effects, each fitted as the only one: values and the error on what was not fitted."""
    effects, rows = catalogue(), []
    for key in ALONE:
        campaign, fit = with_effect(registered.campaign, base, effects[key])
        judged = held_out(campaign, fit.state, fit.model)
        rows.append({"effect": key, "held_out": judged.rms_px, "values": values_of(registered, fit)})
    return rows


def study(path: Path, folder: Path) -> dict[str, Any]:
    """All figures."""
    flights = free_flights(path)
    write_flights(flights, folder)
    registered = register_trajectories([read_trajectory(file, {}) for file in trajectories_in(folder)])
    campaign, began = registered.campaign, time.monotonic()
    base = base_fit(campaign, registered.start)
    floor = noise_floor(campaign, base, np.random.default_rng(0))
    falls, rest = plain_falls(flights), resting_height(path)
    inner = plain_falls([(x[ENDS:-ENDS], q[ENDS:-ENDS]) for x, q in flights if len(x) >= LEAST_ROWS + 2 * ENDS])
    effects = catalogue()
    shared = {key: effect for key, effect in effects.items() if key != "uniform_acceleration"}
    found = diagnose(campaign, base, effects)
    return {
        "tosses": len(flights),
        "rows": [len(x) for x, _ in flights],
        "noise": {"sigma": campaign.sequences[0].sigma[0].tolist(), "repeats": campaign.sequences[0].repeats.tolist()},
        "floor": {"rms": floor.rms_px, "noise": floor.floor_px, "reduced": floor.reduced, "interval": list(floor.interval)},
        "autocorrelation": dict(zip(map(str, floor.lags.tolist()), floor.autocorrelation.tolist(), strict=True)),
        "maps": [sentence_of(m) for m in shown(residual_maps(campaign, base)) if m.significant],
        "held_out_base": held_out(campaign, base.state, base.model).rms_px,
        "diagnosis": diagnosis_of(found),
        "not_applicable": sorted(key for key, e in effects.items() if campaign.kind.why_not(campaign, e) is not None),
        "alone": alone(registered, base),
        "explained": explanation_of(registered, explain(campaign, registered.start, effects)),
        "explained_with_shared_effects": explanation_of(registered, explain(campaign, registered.start, shared)),
        "plain_falls_ms2": falls.tolist(),
        "plain_fall_median_ms2": np.median(falls, axis=0).tolist(),
        "plain_fall_median_without_ends_ms2": np.median(inner, axis=0).tolist(),
        "resting_height_m": {"median": float(np.median(rest)), "spread": float(np.ptp(rest)), "half_width": HALF_WIDTH_M},
        "seconds": round(time.monotonic() - began),
    }


def drawn(result: dict[str, Any]) -> Figure:
    """How fast each toss falls, and the error on what was not fitted, model by model."""
    figure = Figure(figsize=(9.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    falls = -np.array(result["plain_falls_ms2"])[:, 2]
    left.plot(falls, "o", markersize=4)
    left.axhline(GRAVITY_MS2, color="0.4", linestyle="--", label=f"gravity, {GRAVITY_MS2} m/s²")
    left.axhline(float(np.median(falls)), label=f"median, {np.median(falls):.3f} m/s²")
    left.set_xlabel("toss")
    left.set_ylabel("acceleration downwards, m/s²")
    left.set_ylim(8.5, 10.0)
    left.legend(loc="lower left", fontsize=8)
    names = ["free flight", *(row["effect"].replace("_", " ") for row in result["alone"])]
    values = [result["held_out_base"], *(row["held_out"] for row in result["alone"])]
    right.barh(names[::-1], values[::-1], color="tab:blue")
    right.set_xlabel("held-out RMS residual, σ")
    return figure


def main() -> int:
    """Run, or take the result that is there, and write page and picture."""
    return toss_command(TossStudy("real_tosses", "the trajectories are written", study, drawn, page), __doc__)


if __name__ == "__main__":
    raise SystemExit(main())
