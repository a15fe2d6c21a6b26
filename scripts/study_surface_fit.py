"""What the surface as an unknown is worth, by class of body: the same sequences measured without and with `surface_fit`.

``python -m scripts.study_surface_fit --particles FOLDER --count 4 --seed N --result FILE.json``. Silhouette tier, 0.2 px of white noise,
60 views, 100 frames, from nothing. Scanned bodies are smooth (asteroids and a moon) and hand-scanned stones; cut and jagged ones are the
project's own. Printed: root mean squares of the errors at mid-sequence, of their pulls, and which share of 95% intervals holds the truth.
Sequence ``i`` of a class and a seed is the same for any ``--count``.

``--tier rendered [--material diamond] --pictures FOLDER``: the same from pictures, rendered into the folder and kept there.
"""

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from datasets.dataset_files import observation_folder, truth_folder
from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.recipes.recipe import ParticleRecipe, Recipe
from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import INTERVAL_95, score
from datasets.truth import Truth
from datasets.truth_files import read_truth
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from scripts.scanned_particles import IRREGULAR, REGULAR
from synth.rendering.sequence import render_sequence
from synth.sequence import build_silhouette_sequence, plan_sequence

FITS = {"tangents": Configuration(), "surface": Configuration(surface_fit=1)}
QUANTITIES = {
    "in-plane v, mm/s": ("middle_in_plane_ms", ("vx", "vy"), 1e3),
    "depth v, mm/s": ("middle_out_of_plane_ms", ("vz",), 1e3),
    "omega, rad/s": ("middle_angular_rads", ("wx", "wy", "wz"), 1.0),
}
"""Column of the error's size, its components, and what its unit is in SI units; RMSE is that of one component."""
KEPT = (*(size for size, _, _ in QUANTITIES.values()), *(f"middle_pull_{c}" for c in COMPONENTS))


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


def measured(recipe: Recipe, index: int, pictures: Path | None) -> dict[str, Any]:
    """Scores of one sequence, by fit; ``pictures``: the folder of the rendered ones."""
    observation, truth = build_silhouette_sequence(recipe, index) if pictures is None else rendered(recipe, index, pictures)
    row: dict[str, Any] = {}
    for name, configuration in FITS.items():
        began = time.process_time()
        scored = score(estimate(observation, configuration), truth)
        row[name] = {key: scored[key] for key in ("status", *KEPT)} | {"cpu_s": time.process_time() - began}
    return row


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Figures of the sequences that both fits measured, by fit."""
    both = [row for row in rows if all(row[name]["status"] == "converged" for name in FITS)]
    return {"sequences": len(rows), "both_converged": len(both), **{name: _figures([row[name] for row in both]) for name in FITS}}


def _figures(rows: list[dict[str, Any]]) -> dict[str, Any]:
    told: dict[str, Any] = {"cpu_s": float(np.median([row["cpu_s"] for row in rows])) if rows else None}
    for quantity, (size, components, unit) in QUANTITIES.items():
        errors = np.array([row[size] for row in rows]) / np.sqrt(len(components))
        pulls = np.array([[row[f"middle_pull_{c}"] for c in components] for row in rows])
        told[quantity] = {
            "rmse": unit * float(np.sqrt(np.mean(errors**2))) if rows else None,
            "pull_rms": float(np.sqrt(np.mean(pulls**2))) if rows else None,
            "inside_95": float(np.mean(np.abs(pulls) <= INTERVAL_95)) if rows else None,
        }
    return told


def table(result: dict[str, Any]) -> list[str]:
    """The figures as lines of a table."""
    lines = [f"{'class':8} {'n':>3}  {'quantity':17} {'tangents':>24}  {'surface':>24}   RMSE, pull, in 95%"]
    for name, told in result.items():
        for quantity in QUANTITIES:
            cells = [told[fit][quantity] for fit in FITS]
            shown = [f"{c['rmse']:9.3f} {c['pull_rms']:6.2f} {100 * c['inside_95']:6.0f}%" if c["rmse"] is not None else "-" for c in cells]
            lines.append(f"{name:8} {told['both_converged']:>3}  {quantity:17} {shown[0]:>24}  {shown[1]:>24}")
    return lines


def main() -> int:
    """Run, print, and keep the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=Path, required=True, help="folder with the scanned particles (PLY)")
    parser.add_argument("--count", type=int, default=4, help="sequences of each class")
    parser.add_argument("--seed", type=int, default=20261126)
    parser.add_argument("--classes", nargs="+", default=["smooth", "stones", "cut", "jagged"])
    parser.add_argument("--tier", choices=["silhouette", "rendered"], default="silhouette")
    parser.add_argument("--material", choices=["matte", "diamond"], default="matte", help="of the bodies in pictures")
    parser.add_argument("--pictures", type=Path, default=Path("out/surface_fit_pictures"), help="folder of the rendered sequences")
    parser.add_argument("--result", type=Path)
    arguments = parser.parse_args()
    result, every = {}, classes(arguments.particles)
    for name in arguments.classes:
        rows = []
        for index in range(arguments.count):
            body = replace(every[name], material=arguments.material)
            recipe = Recipe(seed=arguments.seed, sequences=index + 1, tier=arguments.tier, particle=body)
            folder = arguments.pictures / f"{name}_{arguments.material}_{arguments.seed}"
            rows.append(measured(recipe, index, folder if arguments.tier == "rendered" else None))
            print(f"{name} {index}: {', '.join(row['status'] for row in rows[-1].values())}", flush=True)
        result[name] = summary(rows)
    print("\n".join(table(result)))
    if arguments.result:
        asked = {key: getattr(arguments, key) for key in ("seed", "tier", "material")}
        with written_whole(arguments.result) as path:
            path.write_text(json.dumps({**asked, "classes": result}, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
