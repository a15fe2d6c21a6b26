"""Is what ``estimate`` calls a measurement one? Sequences with few or many views, slow or fast, and views whose calibration is off.

Every sequence draws its body (cut or jagged), the number of calibrated views, frames, speed, spin, and by how much the calibration is
off: each view is moved and turned so that its outline moves by N(0, ``calibration``²) px along each axis of the picture, and by as much at
its rim. Outlines are of the silhouette tier; nothing is rendered. Printed are, by number of views, how the estimates ended, how many of
the measured ones have an orientation more than 5° off, which share of 95% intervals of v and ω at mid-sequence holds the truth, and how
often the estimate says that its residuals are not noise.

``python -m scripts.trials.study_wrong_poses --count 200 --seed 1``; sequence ``i`` of a seed is the same for any ``--count``. ``--views``,
``--frames``, ``--calibration`` and the like narrow what is drawn: ``--views 12 --frames 20 20 --calibration 0`` is a study of the error
bars of short flights. ``--result FILE.json`` keeps a row per sequence.
"""

import argparse
import json
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.scoring.score import score
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.measure import measure
from synth.rig import miscalibrated
from synth.sequence import build_silhouette_sequence

Array = NDArray[np.float64]
WRONG_DEG = 5.0
COMPONENTS = ("vx", "vy", "vz", "wx", "wy", "wz")
SLOW = 0.1
CAMERAS = 6
"""Views of one drop in the rig."""


@dataclass(frozen=True)
class Drawn:
    """What may be drawn of a sequence; pairs are ranges, the others are chosen from.

    Half of the sequences are slow: a tenth of speed and spin. ``mm_per_px``: size of a view's pixel at the particle; that of the high-speed
    camera is 0.12 mm.
    """

    views: tuple[int, ...] = (6, 12, 24, 60)
    frames: tuple[int, int] = (20, 60)
    calibration_px: tuple[float, ...] = (0.5, 1.0, 2.0)
    speed_ms: tuple[float, float] = (0.2, 3.0)
    spin_rads: tuple[float, float] = (0.0, 300.0)
    mm_per_px: tuple[float, ...] = (0.017, 0.06)
    families: tuple[str, ...] = ("cut_stone", "jagged")


@dataclass(frozen=True)
class Sequence:
    """One drawn sequence; ``calibration_px``: by how much its views are off."""

    observation: Observation
    truth: Truth
    calibration_px: float


def drawn_sequence(drawn: Drawn, seed: int, index: int) -> Sequence:
    """Sequence ``index`` of a seed."""
    rng = np.random.default_rng([seed, index])
    views, frames = int(rng.choice(drawn.views)), int(rng.integers(drawn.frames[0], drawn.frames[1] + 1))
    share = SLOW if rng.random() < 0.5 else 1.0
    speed, spin = (share * float(rng.uniform(*limits)) for limits in (drawn.speed_ms, drawn.spin_rads))
    family, irregularity = str(rng.choice(drawn.families)), float(rng.uniform(0.3, 1.0))
    off_px = float(rng.choice(drawn.calibration_px))
    recipe = Recipe(
        seed=int(rng.integers(2**31)),
        particle=ParticleRecipe(family=family, irregularity=irregularity),  # type: ignore[arg-type]
        motion=MotionRecipe(frames=frames, speed_ms=(speed, speed), spin_rads=(spin, spin)),
        rig=RigRecipe(drops=-(-views // CAMERAS), mm_per_px=float(rng.choice(drawn.mm_per_px))),
    )
    observation, truth = build_silhouette_sequence(recipe, 0)
    radius = 0.5 * float(np.ptp(truth.mesh_vertices, axis=0).max())
    centre = truth.body.com_particle
    moved = tuple(miscalibrated(view, centre, radius, off_px, rng) for view in observation.views[:views])
    outlines = tuple(observation.view_recording[i] for i in range(views))  # type: ignore[index]
    return Sequence(replace(observation, views=moved, view_recording=outlines), truth, off_px)


def one_row(drawn: Drawn, seed: int, index: int) -> dict[str, Any]:
    """Make, measure and score one sequence."""
    sequence = drawn_sequence(drawn, seed, index)
    began = time.process_time()
    estimate = measure(sequence.observation, Configuration())
    scored = score(estimate if estimate.motion is None else replace(estimate, status=Status.CONVERGED), sequence.truth)
    row = {
        "index": index,
        "views": len(sequence.observation.views),
        "calibration_px": sequence.calibration_px,
        "status": str(estimate.status),
        "message": estimate.message,
        "cpu_s": round(time.process_time() - began, 2),
        "misfit_p": misfit_p(estimate),
    }
    names = ("particle", "n_frames", "speed_ms", "spin_rads", "orientation_median_deg", "orientation_max_deg")
    pulls = {f"pull_{name}": scored[f"middle_pull_{name}"] for name in COMPONENTS}
    return row | {name: scored[name] for name in names} | pulls


def misfit_p(estimate: Estimate) -> float | None:
    """The p-value of the estimate's test of its residuals."""
    adequacy = estimate.statistics.get("adequacy")
    return None if adequacy is None else float(adequacy["p"])


HEADINGS = ("views", "n  ", "converged", "ambiguous", "other", "> 5 deg", "v in 95%", "omega in 95%", "largest pull", "misfit p < 0.001")


def table(rows: list[dict[str, Any]]) -> list[str]:
    """The figures by number of views, and of all."""
    lines = ["  ".join(HEADINGS)]
    for views in [*sorted({row["views"] for row in rows}), None]:
        here = [row for row in rows if views in {None, row["views"]}]
        lines.append(_line("all" if views is None else str(views), here))
    return lines


def _line(name: str, rows: list[dict[str, Any]]) -> str:
    good = [row for row in rows if row["status"] == Status.CONVERGED]
    ambiguous = sum(row["status"] == Status.AMBIGUOUS for row in rows)
    wrong = sum(row["orientation_median_deg"] > WRONG_DEG for row in good)
    pulls = np.array([[row[f"pull_{c}"] for c in COMPONENTS] for row in good]).reshape(-1, 6)
    right = pulls[[row["orientation_median_deg"] <= WRONG_DEG for row in good]]
    inside = np.abs(right) <= 1.96
    v, omega = (f"{100 * part.mean():.1f}%" if part.size else "-" for part in (inside[:, :3], inside[:, 3:]))
    largest = f"{np.abs(right).max():.1f}" if right.size else "-"
    told = [row["misfit_p"] for row in good if row["misfit_p"] is not None]
    misfit = f"{sum(p < 1e-3 for p in told)} of {len(told)}"
    cells = (name, len(rows), len(good), ambiguous, len(rows) - len(good) - ambiguous, wrong, v, omega, largest, misfit)
    return "  ".join(f"{cell!s:<{len(heading)}}" for cell, heading in zip(cells, HEADINGS, strict=True))


def main() -> int:
    """Run, print the table, name what is wrong, and keep the rows."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    default = Drawn()
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first sequence")
    parser.add_argument("--seed", type=int, default=20261125)
    parser.add_argument("--views", type=int, nargs="+", default=default.views)
    parser.add_argument("--frames", type=int, nargs=2, default=default.frames)
    parser.add_argument("--calibration", type=float, nargs="+", default=default.calibration_px, help="px")
    parser.add_argument("--speed", type=float, nargs=2, default=default.speed_ms, help="m/s")
    parser.add_argument("--spin", type=float, nargs=2, default=default.spin_rads, help="rad/s")
    parser.add_argument("--mm-per-px", type=float, nargs="+", default=default.mm_per_px, help="of the views")
    parser.add_argument("--families", nargs="+", default=default.families)
    parser.add_argument("--result", type=Path)
    given = parser.parse_args()
    given_ranges = (given.views, given.frames, given.calibration, given.speed, given.spin, given.mm_per_px, given.families)
    drawn = Drawn(*(tuple(values) for values in given_ranges))  # type: ignore[arg-type]
    rows: list[dict[str, Any]] = []
    for index in range(given.first, given.first + given.count):
        rows.append(one_row(drawn, given.seed, index))
        if given.result:
            given.result.parent.mkdir(parents=True, exist_ok=True)
            given.result.write_text(json.dumps(rows, indent=1) + "\n")
    print("\n".join(table(rows)))
    for row in rows:
        if row["status"] == Status.CONVERGED and row["orientation_median_deg"] > WRONG_DEG:
            print(f"wrong: sequence {row['index']}, {row['views']} views, {row['orientation_median_deg']:.1f} deg off: {row['message']}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
