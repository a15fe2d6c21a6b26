"""How far outlines that are measured in pictures lie from the true body's: rendered sequences, the true mesh under the true motion.

``python -m scripts.study_picture_outlines --particles FOLDER --count 2 --seed N``. Matte bodies; the pictures are those of
:mod:`scripts.study_surface_fit` and are rendered where they are not there yet. Printed in px, outwards: mean and spread of the samples, and
their mean in units of ``1/(12 R)`` px, the error of chords a pixel long on a circle as long as the outline.
"""

import argparse
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import shapely
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.recipes.recipe import Recipe
from datasets.truth import Truth
from estimator.outlines.sightings import tracks_of
from scripts.study_surface_fit import classes, rendered
from synth.plan import particle_poses_in_camera
from synth.silhouette.exact_outline import exact_outline, outline_mesh

Array = NDArray[np.float64]


def gaps_px(observation: Observation, truth: Truth) -> Iterator[Array]:
    """Of every frame that is used, how far (s,) px outside of the true outline its samples lie."""
    mesh, camera = outline_mesh(truth.mesh_vertices, truth.mesh_faces), observation.cameras[0].intrinsics
    poses = zip(*particle_poses_in_camera(truth.body, truth.motion, observation.cameras[0]), strict=True)
    for (R, t), frame in zip(poses, tracks_of(observation)[0].frames, strict=True):
        if frame.used:
            true = shapely.Polygon(exact_outline(mesh, camera, R, t))
            shapely.prepare(true)
            points = shapely.points(frame.outline.points_px)
            yield shapely.distance(points, true.exterior) * np.where(shapely.contains(true, points), -1.0, 1.0)


def main() -> int:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--particles", type=Path, required=True, help="folder with the scanned particles (PLY)")
    parser.add_argument("--count", type=int, default=2, help="sequences of each class")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--classes", nargs="+", default=["smooth", "stones", "cut", "jagged"])
    parser.add_argument("--pictures", type=Path, default=Path("out/surface_fit_pictures"), help="folder of the rendered sequences")
    arguments = parser.parse_args()
    for name in arguments.classes:
        body = replace(classes(arguments.particles)[name], material="matte")
        for index in range(arguments.count):
            recipe = Recipe(seed=arguments.seed, sequences=index + 1, tier="rendered", particle=body)
            gaps = list(gaps_px(*rendered(recipe, index, arguments.pictures / f"{name}_matte_{arguments.seed}")))
            every, length = np.concatenate(gaps), float(np.mean([len(gap) for gap in gaps]))
            chords = every.mean() / (2.0 * np.pi / (12.0 * length))
            print(f"{name:8}{index:3} {every.mean():+8.4f} px, spread {every.std():.3f} px, {chords:+5.2f} chords", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
