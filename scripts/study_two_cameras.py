"""Two high-speed cameras of one flight: what the second one is worth, by its angle, and how well an unknown offset of its clock is found.

``python -m scripts.study_two_cameras [--sequences 48] [--seed N] [--jobs 1] [--result FILE.json] [--page FILE.md]``; ``--sequences 2`` is
a small size. The recipe is ``scripts/two_cameras.toml``. Every flight is filmed from each arrangement; it is the same flight as far as it
stays in all pictures. Each sequence is made, measured and scored in one piece of work whose row is written when it is done, so a killed run
goes on.
"""

import json
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import chi2

from datasets.atomic_files import written_whole
from datasets.estimate import Status
from datasets.recipes.recipe import FurtherHsvRecipe, Recipe
from datasets.recipes.toml_files import load_recipe
from estimator.data.configuration import Configuration
from estimator.measure import measure
from scripts.acceptance_runs import acceptance_parser, run_missing, write_figures
from synth.sequence import build_silhouette_sequence
from tumble.engine import Item

RECIPE = Path(__file__).with_name("two_cameras.toml")
KNOWN = FurtherHsvRecipe()
ARRANGEMENTS: Mapping[str, FurtherHsvRecipe | None] = {
    "90°, clock half a frame off": load_recipe(RECIPE).further_hsv[0],
    "90°": KNOWN,
    "one camera": None,
    "30°": replace(KNOWN, angle_deg=30.0),
    "10°": replace(KNOWN, angle_deg=10.0),
}
"""The second camera of each; ``None``: there is none. Clocks are in step and known, but for the first."""
FEWER = {"30°": 2, "10°": 2}
"""By how many times fewer sequences of an arrangement are measured."""
WITHIN_SIGMAS = 1.959964
"""Half of a 95% interval, in standard deviations."""
INTERVAL_S = 1.0 / 4000.0


def recipe_of(arrangement: str, seed: int | None, sequences: int) -> Recipe:
    """The committed recipe with the second camera of an arrangement, another number of sequences, and another seed where one is given."""
    recipe, second = load_recipe(RECIPE), ARRANGEMENTS[arrangement]
    further = () if second is None else (second,)
    return replace(recipe, sequences=sequences, seed=recipe.seed if seed is None else seed, further_hsv=further)


def one_sequence(payload: dict[str, Any]) -> dict[str, Any]:
    """Make, measure and score one sequence; writes its row."""
    observation, truth = build_silhouette_sequence(
        recipe_of(payload["arrangement"], payload["seed"], payload["sequences"]), payload["index"]
    )
    began = time.process_time()
    result = measure(observation, Configuration())
    row: dict[str, Any] = {"sequence": truth.name, "status": str(result.status), "cpu_s": time.process_time() - began}
    if result.middle is not None:
        frame = int(np.argmin(np.abs(truth.motion.times_s - result.middle.time_s)))
        v, omega = truth.motion.v_world[frame], truth.motion.omega_world[frame]
        error = np.concatenate([result.middle.v_world - v, result.middle.omega_world - omega])
        covariance = result.middle.covariance
        row |= {"error": error.tolist(), "sigma": np.sqrt(np.diag(covariance)).tolist(), "speed": float(np.linalg.norm(v))}
        row["ellipsoids"] = [float(error[part] @ np.linalg.solve(covariance[part, part], error[part])) for part in (slice(3), slice(3, 6))]
    clock = result.statistics.get("clocks", {}).get("hsv_2")
    if clock is not None:
        off = clock["offset_s"] - truth.notes["further_cameras"][0]["clock_offset_s"]
        row |= {"offset_error_frames": off / INTERVAL_S, "offset_sigma_frames": clock["offset_s_sigma"] / INTERVAL_S}
    with written_whole(Path(payload["product"])) as path:
        path.write_text(json.dumps(row))
    return {"status": result.status.value}


def figures_of(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """What one arrangement's rows come to: errors of a component in the plane, in depth and of ω, and how often intervals hold."""
    measured = [row for row in rows if "error" in row]
    told: dict[str, Any] = {"sequences": len(rows), "converged": sum(row["status"] == str(Status.CONVERGED) for row in rows)}
    told["median_cpu_s"] = float(np.median([row["cpu_s"] for row in rows]))
    if not measured:
        return told
    error, sigma = (np.array([row[key] for row in measured]) for key in ("error", "sigma"))
    held, whole = np.abs(error) <= WITHIN_SIGMAS * sigma, np.array([row["ellipsoids"] for row in measured]) <= chi2.ppf(0.95, 3)
    plane, depth = _size(error[:, :2]), _size(error[:, 2])
    told |= {"in_plane_mms": 1e3 * plane, "out_of_plane_mms": 1e3 * depth, "ratio": depth / plane, "angular_rads": _size(error[:, 3:])}
    told |= {
        f"{name}_ratio": float(np.median(of[:, 2]) / np.median(of[:, :2])) for name, of in (("median", np.abs(error)), ("stated", sigma))
    }
    told |= {"v_held": float(held[:, :3].mean()), "omega_held": float(held[:, 3:].mean())}
    told |= {"v_ellipsoids_held": float(whole[:, 0].mean()), "omega_ellipsoids_held": float(whole[:, 1].mean())}
    off = [(row["offset_error_frames"], row["offset_sigma_frames"]) for row in measured if "offset_error_frames" in row]
    if off:
        errors, sigmas = np.array(off).T
        told |= {"offset_rms_frames": _size(errors), "offset_largest_frames": float(np.abs(errors).max())}
        told |= {"offset_held": float(np.mean(np.abs(errors) <= WITHIN_SIGMAS * sigmas))}
    return told


def _size(errors: np.ndarray[Any, np.dtype[np.float64]]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(errors**2)))


def summary(parts: Mapping[str, list[dict[str, Any]]], seed: int) -> dict[str, Any]:
    """Figures and rows of every arrangement."""
    return {"seed": seed, "arrangements": {name: {**figures_of(rows), "each": rows} for name, rows in parts.items()}}


COLUMNS = (
    ("sequences", "sequences", "{:.0f}"),
    ("converged", "converged", "{:.0f}"),
    ("in-plane v", "in_plane_mms", "{:.3f}"),
    ("depth v", "out_of_plane_mms", "{:.3f}"),
    ("depth over plane", "ratio", "{:.2f}"),
    ("of medians", "median_ratio", "{:.2f}"),
    ("as stated", "stated_ratio", "{:.2f}"),
    ("ω", "angular_rads", "{:.3f}"),
    ("v held", "v_held", "{:.0%}"),
    ("ω held", "omega_held", "{:.0%}"),
    ("ellipsoids of v, ω", "v_ellipsoids_held", "{:.0%}"),
    ("CPU", "median_cpu_s", "{:.0f} s"),
)


def page(result: dict[str, Any]) -> str:
    """The figures as a page."""
    arrangements = result["arrangements"]
    rows = "\n".join(
        f"| {name} | {' | '.join(_cell(told, key, form) for _, key, form in COLUMNS)} |" for name, told in arrangements.items()
    )
    off = next((told for told in arrangements.values() if "offset_rms_frames" in told), None)
    clock = "No clock was fitted." if off is None else _clock_in_words(off)
    return f"""# Two high-speed cameras

Flights of cut stones in outlines with 0.2 px boundary noise, 100 frames at 4000 Hz, 60 calibrated views, filmed from each arrangement; the
first camera is the same in all, the second stands at an angle to it and looks at the middle of the flights. Seed {result["seed"]};
written by `python -m scripts.study_two_cameras`.

Root mean squares over sequences: error of one component of v in the first camera's plane and in its depth (mm/s), of one component of ω
(rad/s), mid-sequence. *Depth over plane*: their ratio, that of the medians of absolute errors, and that of the medians of stated standard
deviations. *Held*: share of components whose 95% interval holds the truth, and of whole 95% ellipsoids.

| second camera | {" | ".join(name for name, _, _ in COLUMNS)} |
| --- |{" --- |" * len(COLUMNS)}
{rows}

{clock}

Each arrangement draws the flights that stay in all of its pictures, so with another camera some flights are others. Poses and lenses of the
cameras are exact here.

The recipe is [`scripts/two_cameras.toml`](../../scripts/two_cameras.toml):

```sh
tumble render --config scripts/two_cameras.toml --out out/two_cameras
tumble estimate out/two_cameras --out out/two_cameras_estimates
```
"""


def _cell(told: dict[str, Any], key: str, form: str) -> str:
    if key not in told:
        return "–"
    both = f", {form.format(told['omega_ellipsoids_held'])}" if key == "v_ellipsoids_held" else ""
    return form.format(told[key]) + both


def _clock_in_words(told: dict[str, Any]) -> str:
    return (
        "**The clock.** Half a frame of offset, of which the estimator is told no more than its standard deviation (half a frame), is\n"
        f"found to {told['offset_rms_frames']:.4f} frames (root mean square; the largest error is {told['offset_largest_frames']:.4f}); "
        f"{told['offset_held']:.0%} of its 95% intervals hold the truth."
    )


def main() -> int:
    """Run what is missing, print and write the result."""
    parser = acceptance_parser(__doc__, "out/study_two_cameras")
    parser.add_argument("--sequences", type=int, default=48)
    arguments = parser.parse_args()
    seed, items = recipe_of("one camera", arguments.seed, 1).seed, []
    products: dict[str, list[Path]] = {}
    for number, name in enumerate(ARRANGEMENTS):
        for index in range(max(1, arguments.sequences // FEWER.get(name, 1))):
            product = arguments.out / f"{number}-{seed}-{index:04d}.json"
            payload = {"arrangement": name, "seed": seed, "sequences": arguments.sequences, "index": index, "product": product}
            items.append(Item(product.stem, payload, product, apart=("sequences",)))
            products.setdefault(name, []).append(product)
    run_missing(one_sequence, items, arguments, "sequences")
    parts = {name: [json.loads(path.read_text()) for path in paths if path.exists()] for name, paths in products.items()}
    result = summary({name: rows for name, rows in parts.items() if rows}, seed)
    for name, told in result["arrangements"].items():
        print(name, json.dumps({key: value for key, value in told.items() if key != "each"}, allow_nan=False))
    write_figures(result, page(result), arguments)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
