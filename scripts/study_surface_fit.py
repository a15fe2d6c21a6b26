"""What the surface as an unknown is worth, by class of body: the same sequences measured without and with `surface_fit`.

``python -m scripts.study_surface_fit --particles FOLDER --count 4 --seed N --result FILE.json``. Silhouette tier, 0.2 px of white noise,
60 views, 100 frames, from nothing. Scanned bodies are smooth (asteroids and a moon) and hand-scanned stones; cut and jagged ones are the
project's own. Printed: root mean squares of the errors at mid-sequence, the same over that of the Cramér-Rao bound of the true body with
all samples (:mod:`synth.flight_bound`), the median error in % of the true speed or spin, the root mean square of pulls, and which share of
95% intervals and of whole 95% ellipsoids holds the truth. Sequence ``i`` of a class and a seed is the same for any ``--count``.

``--drops D``: with calibrated views of so many placements of the body, six each; their number decides how much of the body's surface the
frames have to tell. ``--tier rendered [--material diamond] --pictures FOLDER``: the same from pictures, rendered into the folder and kept
there; there is no bound of theirs.
"""

import argparse
import json
import math
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from datasets.dataset_files import observation_folder, truth_folder
from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.recipes.recipe import ParticleRecipe, Recipe, RigRecipe
from datasets.scoring.efficiency import QUANTITIES, efficiency
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import INTERVAL_95, VECTORS, score
from datasets.truth import Truth
from datasets.truth_files import read_truth
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from studies.flights.bodies import IRREGULAR, REGULAR
from synth.flight_bound import with_bound
from synth.rendering.sequence import render_sequence
from synth.sequence import build_silhouette_sequence, plan_sequence

FITS = {"tangents": Configuration(surface_fit=0), "surface": Configuration(surface_fit=2, offset_prior_px=0.001)}
"""Outlines have no offset here, and who knows that states it: beside gravity their size alone says how far away a body is."""
SIZES = ("in_plane", "out_of_plane", "angular")
"""What a score calls the size of the error of each of :data:`QUANTITIES`."""
KEPT = (
    *(f"middle_{figure}_{c}" for figure in ("pull", "true_bound", "over_true_bound") for c in COMPONENTS),
    *(f"middle_{size}_percent" for size in SIZES),
    *("middle_in_plane_ms", "middle_out_of_plane_ms", "middle_angular_rads"),
)
ELLIPSOIDS = tuple(f"middle_ellipsoid95_{name}" for name in VECTORS)


def classes(folder: Path) -> dict[str, ParticleRecipe]:
    """The bodies of every class."""
    smooth, stones = (tuple(str(folder / f"{name}.ply") for name in names) for names in (REGULAR, IRREGULAR))
    return {
        "smooth": ParticleRecipe(files=smooth),
        "stones": ParticleRecipe(files=stones),
        "cut": ParticleRecipe(family="cut_stone"),
        "jagged": ParticleRecipe(family="jagged"),
    }


def rendered(recipe: Recipe, index: int, out: Path) -> tuple[Observation, Truth]:
    """One sequence in pictures, rendered unless it lies in the folder ``out``."""
    name = plan_sequence(recipe, index).name
    if not truth_folder(out, name).is_dir() or not observation_folder(out, name).is_dir():
        render_sequence(recipe, index, out)
    return read_observation(observation_folder(out, name)), read_truth(truth_folder(out, name))


def outlined(recipe: Recipe, index: int) -> tuple[Observation, Truth]:
    """One sequence in outlines, with its bound."""
    observation, truth = build_silhouette_sequence(recipe, index)
    return observation, with_bound(truth, observation.cameras[0], recipe.noise)


def measured(recipe: Recipe, index: int, pictures: Path | None) -> dict[str, Any]:
    """Scores of one sequence, by fit; ``pictures``: the folder of the rendered ones."""
    observation, truth = outlined(recipe, index) if pictures is None else rendered(recipe, index, pictures)
    row: dict[str, Any] = {}
    for name, configuration in FITS.items():
        began = time.process_time()
        scored = score(estimate(observation, configuration), truth)
        kept = {key: scored.get(key, math.nan) for key in ("status", "converged", *KEPT, *ELLIPSOIDS)}
        row[name] = kept | {"cpu_s": time.process_time() - began}
    return row


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Figures of the sequences that both fits measured, by fit."""
    both = [row for row in rows if all(row[name]["status"] == "converged" for name in FITS)]
    return {"sequences": len(rows), "both_converged": len(both), **{name: _figures([row[name] for row in both]) for name in FITS}}


def _figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    if not rows:
        return {}
    scores = pd.DataFrame(rows)
    told: dict[str, Any] = {"cpu_s": float(scores["cpu_s"].median())}
    told |= {f"{name}_ellipsoids": float(scores[column].mean()) for name, column in zip(VECTORS, ELLIPSOIDS, strict=True)}
    bounds = {row["quantity"]: row for row in efficiency(scores).to_dict("records")}
    for quantity, size in zip(QUANTITIES, SIZES, strict=True):
        pulls = scores[[f"middle_pull_{c}" for c in quantity.components]].to_numpy()
        errors = scores[f"middle_{size}_{'rads' if size == 'angular' else 'ms'}"].to_numpy()
        row = bounds.get(quantity.name, {})
        told[f"{quantity.name}, {quantity.unit}"] = {
            "rmse": quantity.per_si * float(np.sqrt(np.mean(errors**2) / len(quantity.components))),
            "median_percent": float(scores[f"middle_{size}_percent"].median()),
            **{key: row[key] for key in ("rms_bound", "rmse_over_bound", "rms_of_ratios") if key in row},
            "pull_rms": float(np.sqrt(np.mean(pulls**2))),
            "inside_95": float(np.mean(np.abs(pulls) <= INTERVAL_95)),
        }
    return told


def together(results: list[dict[str, Any]]) -> dict[str, Any]:
    """Results of several seeds as one; medians of errors are none, CPU is the mean of medians."""
    return {name: _of_both([result[name] for result in results]) for name in results[0]}


def _of_both(told: list[dict[str, Any]]) -> dict[str, Any]:
    weights = [each["both_converged"] for each in told]
    whole: dict[str, Any] = {key: sum(each[key] for each in told) for key in ("sequences", "both_converged")}
    for fit in FITS:
        every = [each[fit] for each in told]
        whole[fit] = {key: _joined([each[key] for each in every], weights) for key in every[0]}
    return whole


def _joined(values: list[Any], weights: list[int]) -> Any:
    """Shares and CPU as means, all else that is of a quantity as root mean squares."""
    if not isinstance(values[0], dict):
        return float(np.average(values, weights=weights))
    kept = [key for key in ("rmse", "rms_bound", "rms_of_ratios", "pull_rms") if key in values[0]]
    squares = {key: float(np.sqrt(np.average([each[key] ** 2 for each in values], weights=weights))) for key in kept}
    over = {"rmse_over_bound": squares["rmse"] / squares["rms_bound"]} if "rms_bound" in squares else {}
    inside = float(np.average([each["inside_95"] for each in values], weights=weights))
    return {**squares, **over, "median_percent": math.nan, "inside_95": inside}


def table(result: dict[str, Any]) -> list[str]:
    """The figures as lines of a table."""
    heads = (f"{name + ': RMSE, over bound, ratios, median, pull, in 95%':>56}" for name in FITS)
    lines = [f"{'class':8} {'n':>3}  {'quantity':17} {'bound':>8}  {'  '.join(heads)}"]
    for name, told in result.items():
        if not all(told[fit] for fit in FITS):
            lines.append(f"{name:8}   0")
            continue
        for quantity in QUANTITIES:
            key = f"{quantity.name}, {quantity.unit}"
            cells = [told[fit][key] for fit in FITS]
            head = f"{name:8} {told['both_converged']:>3}  {key:17} {cells[0].get('rms_bound', math.nan):8.3f}"
            lines.append("  ".join([head, *(f"{_cell(cell):>56}" for cell in cells)]))
        whole = (
            f"CPU {told[fit]['cpu_s']:.1f} s, v {100 * told[fit]['v_ellipsoids']:.0f}%, omega {100 * told[fit]['omega_ellipsoids']:.0f}%"
            for fit in FITS
        )
        lines.append("  ".join([f"{name:8} {'':>3}  {'95% ellipsoids':17} {'':8}", *(f"{cell:>56}" for cell in whole)]))
    return lines


def _cell(told: dict[str, float]) -> str:
    (over, ratios), inside = (told.get(key, math.nan) for key in ("rmse_over_bound", "rms_of_ratios")), 100 * told["inside_95"]
    return f"{told['rmse']:9.3f} {over:6.2f} {ratios:6.2f} {told['median_percent']:7.3f}% {told['pull_rms']:6.2f} {inside:6.0f}%"


def main() -> int:
    """Run, print, and keep the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--together", type=Path, nargs="+", help="print the figures of these results as one, and no more")
    parser.add_argument("--particles", type=Path, help="folder with the scanned particles (PLY)")
    parser.add_argument("--count", type=int, default=4, help="sequences of each class")
    parser.add_argument("--seed", type=int, default=20261126)
    parser.add_argument("--classes", nargs="+", default=["smooth", "stones", "cut", "jagged"])
    parser.add_argument("--tier", choices=["silhouette", "rendered"], default="silhouette")
    parser.add_argument("--material", choices=["matte", "diamond"], default="matte", help="of the bodies in pictures")
    parser.add_argument("--drops", type=int, default=10, help="placements of the body in the rig, six views each")
    parser.add_argument("--pictures", type=Path, default=Path("out/surface_fit_pictures"), help="folder of the rendered sequences")
    parser.add_argument("--result", type=Path)
    arguments = parser.parse_args()
    if arguments.together:
        print("\n".join(table(together([json.loads(path.read_text())["classes"] for path in arguments.together]))))
        return 0
    if arguments.particles is None:
        parser.error("expected --particles FOLDER, got none")
    result, every = {}, classes(arguments.particles)
    for name in arguments.classes:
        rows = []
        for index in range(arguments.count):
            body = replace(every[name], material=arguments.material)
            rig = RigRecipe(drops=arguments.drops)
            recipe = Recipe(seed=arguments.seed, sequences=index + 1, tier=arguments.tier, particle=body, rig=rig)
            folder = arguments.pictures / f"{name}_{arguments.material}_{arguments.seed}"
            rows.append(measured(recipe, index, folder if arguments.tier == "rendered" else None))
            print(f"{name} {index}: {', '.join(row['status'] for row in rows[-1].values())}", flush=True)
        result[name] = summary(rows)
    print("\n".join(table(result)))
    if arguments.result:
        asked = {key: getattr(arguments, key) for key in ("seed", "tier", "material", "drops")}
        with written_whole(arguments.result) as path:
            path.write_text(json.dumps({**asked, "classes": result}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
