"""Focal length measured with the flight: what a camera that states 5% too much does, and what letting the focal length free repairs.

``python -m scripts.trials.study_free_focal --particles FOLDER --result docs/results/free_focal.json``. Silhouette tier, 0.2 px, 60 views,
100 frames, six scanned bodies, two lenses of equal magnification; each sequence with the stated focal length believed, held to 5% and held
to 30%.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from datasets.recipes.recipe import HsvRecipe, ParticleRecipe, Recipe
from datasets.truth import Truth
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from studies.flights.bodies import SIX, scanned_files
from synth.sequence import build_silhouette_sequence

STATED_OVER_TRUE = 1.05
SEED = 20261123
LENSES = {"100 mm, 0.6 m": HsvRecipe(), "25 mm, 0.15 m": HsvRecipe(focal_mm=25.0, distance_m=0.15)}
PRIORS = (0.0, 0.05, 0.3)


def misled(observation: Observation) -> Observation:
    """The observation with a camera that states ``STATED_OVER_TRUE`` times its focal length."""
    camera = observation.cameras[0]
    k = camera.intrinsics
    stated = replace(k, fx_px=STATED_OVER_TRUE * k.fx_px, fy_px=STATED_OVER_TRUE * k.fy_px)
    return replace(observation, cameras=(replace(camera, intrinsics=stated),))


def row(result: Estimate, truth: Truth, prior: float) -> dict[str, Any]:
    """Errors of the mid-sequence velocities (%), and of the focal length in its own standard deviations."""
    told: dict[str, Any] = {"prior": prior, "status": str(result.status)}
    if result.middle is None:
        return told
    frame = int(np.argmin(np.abs(truth.motion.times_s - result.middle.time_s)))
    v, omega = truth.motion.v_world[frame], truth.motion.omega_world[frame]
    dv = result.middle.v_world - v
    told["in_plane_percent"] = 100.0 * float(np.linalg.norm(dv[:2]) / np.linalg.norm(v))
    told["out_of_plane_percent"] = 100.0 * float(abs(dv[2]) / np.linalg.norm(v))
    told["angular_percent"] = 100.0 * float(np.linalg.norm(result.middle.omega_world - omega) / np.linalg.norm(omega))
    told["distance_percent"] = 100.0 * float(np.median(np.abs(motion_z(result) / truth.motion.x_world[:, 2] - 1.0)))
    if prior:
        error, sigma = float(result.values[-1]) + np.log(STATED_OVER_TRUE), float(np.sqrt(result.covariance[-1, -1]))
        told |= {"focal_error_percent": 100.0 * error, "focal_sigma_percent": 100.0 * sigma, "focal_pull": error / sigma}
    return told


def motion_z(result: Estimate) -> np.ndarray[Any, np.dtype[np.float64]]:
    """Estimated distances (m) along the optical axis."""
    assert result.motion is not None
    return result.motion.x_world[:, 2]


def summary(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Medians over the sequences that were measured; the pulls' root mean square."""
    measured = [r for r in rows if "in_plane_percent" in r]
    names = [n for n in measured[0] if n.endswith("_percent")]
    told: dict[str, Any] = {n: float(np.median([abs(r[n]) for r in measured])) for n in names}
    if "focal_pull" in measured[0]:
        told["focal_pull_rms"] = float(np.sqrt(np.mean([r["focal_pull"] ** 2 for r in measured])))
    return {"sequences": len(rows), "converged": sum(r["status"] == str(Status.CONVERGED) for r in rows), **told}


def study(files: list[str]) -> dict[str, Any]:
    """Rows and medians by lens and prior."""
    told: dict[str, Any] = {}
    for name, lens in LENSES.items():
        recipe = Recipe(seed=SEED, particle=ParticleRecipe(files=tuple(files)), hsv=lens)
        sequences = [build_silhouette_sequence(recipe, i) for i in range(len(SIX))]
        for prior in PRIORS:
            rows = [row(estimate(misled(o), Configuration(focal_prior=prior)), t, prior) for o, t in sequences]
            told[f"{name}, prior {100 * prior:g}%"] = {**summary(rows), "rows": rows}
            print(f"{name}, prior {100 * prior:g}%", {k: round(v, 3) for k, v in summary(rows).items()}, flush=True)
    return told


def main() -> int:
    """All cases, printed and written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=Path, required=True, help="folder with the scanned particles")
    parser.add_argument("--result", type=Path, default=Path("out/free_focal.json"))
    arguments = parser.parse_args()
    result = study(scanned_files(arguments.particles))
    arguments.result.parent.mkdir(parents=True, exist_ok=True)
    arguments.result.write_text(json.dumps(result, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
