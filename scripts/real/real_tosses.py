"""Real tosses of a cube, tracked by its tags: what ``tumble explain`` finds in their free flight, whatever it is.

``python -m scripts.real.real_tosses --tosses FOLDER`` writes ``docs/results/real_tosses.json`` and, from it, the page and picture in
``docs/studies``. FOLDER holds ``cube_tosses.npz`` (Pfrommer, Halm and Posa 2020): poses at 148 Hz, of which the rows before the cube's
lowest corner comes near the board are used. Velocities in the file were filtered upstream and are not read. The verb runs twice, once with
the height of the cube at rest as a fact beside it. ``--page`` writes the page alone.
"""

import json
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scripts.real.real_tosses_page import known_height, page, words
from scripts.real.toss_study import TossStudy, toss_command
from tumble.cli.main import main as tumble
from tumble.diagnosing import DIAGNOSIS_FILE
from tumble.versions import versions

Array = NDArray[np.float64]
RATE_HZ, HALF_WIDTH_M, GRAVITY_MS2 = 148.0, 0.0524, 9.81
CLEAR_M, LEAST_ROWS = 0.003, 8
"""Height of the lowest corner above the board from which a row counts as free flight."""
ENDS = 2
"""Rows left out at both ends, to see whether a hand or the board has a part in it."""


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


def told_by_explain(observations: Path, out: Path, known: Sequence[str] = ()) -> dict[str, Any]:
    """What the verb ends with, ``known`` facts stated: values, names, errors, tests of the first model; CPU time (s) of one process."""
    began = time.process_time()
    stated = [word for fact in known for word in ("--known", fact)]
    code = tumble(["explain", str(observations), *stated, "--jobs", "1", "--quiet", "--force", "--out", str(out)])
    cpu_s = time.process_time() - began
    if code != 0:
        raise RuntimeError(f"tumble explain ended with {code}, expected 0")
    told = json.loads((out / DIAGNOSIS_FILE).read_text(encoding="utf-8"))
    estimates = [json.loads(path.read_text(encoding="utf-8"))["statistics"] for path in sorted(out.glob("*.estimate.json"))]
    scatter = [remark for remark in told["verdict"]["remarks"] if "differs from sequence to sequence" in remark]
    unknown = told["unknown"]
    return {
        "sentence": told["verdict"]["sentence"],
        "limit": told["limits"]["sentence"],
        "noise": next(each["noise"] for each in estimates if each["noise"]),
        "model": told["model"],
        "values": [v for v in told["values"] if v["sequence"] is None],
        "names": told["names"],
        "steps": [{key: step[key] for key in ("added", "group", "probability", "sure", "worth", "p")} for step in told["steps"]],
        "scatter": scatter,
        "held_out": [{"added": rung["added"], "rms": rung["held_out"]["rms_px"]} for rung in told["ladder"]],
        "unknown": unknown and {**{key: unknown[key] for key in ("stage", "family", "p")}, "rms": unknown["after"]["rms_px"]},
        "floor": {key: told["noise_floor"][key] for key in ("floor_px", "reduced_chi_square", "interval")},
        "first_tests": [{key: c[key] for key in ("effect", "share", "p", "log_odds")} for c in told["begun"]["candidates"]],
        "not_applicable": sorted(told["not_applicable"]),
        "cpu_s": round(cpu_s),
    }


def study(path: Path, folder: Path) -> dict[str, Any]:
    """All figures."""
    flights = free_flights(path)
    write_flights(flights, folder / "tosses")
    falls, rest = plain_falls(flights), resting_height(path)
    inner = plain_falls([(x[ENDS:-ENDS], q[ENDS:-ENDS]) for x, q in flights if len(x) >= LEAST_ROWS + 2 * ENDS])
    at_rest = {"median": float(np.median(rest)), "sigma": float(np.std(rest)), "spread": float(np.ptp(rest)), "half_width": HALF_WIDTH_M}
    return {
        "versions": versions(),
        "tosses": len(flights),
        "rows": [len(x) for x, _ in flights],
        "explained": told_by_explain(folder / "tosses", folder / "explained"),
        "explained_beside_height": told_by_explain(folder / "tosses", folder / "explained_beside_height", [known_height(at_rest)]),
        "plain_falls_ms2": falls.tolist(),
        "plain_fall_median_ms2": np.median(falls, axis=0).tolist(),
        "plain_fall_median_without_ends_ms2": np.median(inner, axis=0).tolist(),
        "resting_height_m": at_rest,
    }


def drawn(result: dict[str, Any]) -> Figure:
    """How fast each toss falls, and the error on what was not fitted, effect by effect."""
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
    told = result["explained"]
    rungs = [("free flight" if rung["added"] is None else f"+ {words(rung['added'])}", rung["rms"]) for rung in told["held_out"]]
    if told["unknown"]:
        rungs.append((f"+ {words(told['unknown']['family'])}", told["unknown"]["rms"]))
    right.barh([name for name, _ in rungs[::-1]], [rms for _, rms in rungs[::-1]], color="tab:blue")
    right.axvline(told["floor"]["floor_px"], color="0.4", linestyle="--", label="noise floor")
    right.set_xlabel("held-out RMS residual, σ")
    right.legend(loc="lower right", fontsize=8)
    return figure


def main() -> int:
    """Run, or take the result that is there, and write page and picture."""
    return toss_command(TossStudy("real_tosses", "the trajectories and what is told of them are written", study, drawn, page), __doc__)


if __name__ == "__main__":
    raise SystemExit(main())
