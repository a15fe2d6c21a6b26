"""Figure 4 of the published method: the pose in one picture, found from calibrated views of the same particle.

A body is placed in the rig once more than the views need; each of the six pictures of that last placement is an unknown one. The hull that
ranks the starts, the centre of mass and the fit come of the views of the other placements alone. The error is the geodesic angle to the
pose that the picture was made with, the smallest over the body's rotational symmetries. The paper takes each view out in turn and has 66%
(regular particles) and 88% (irregular) of poses within 5 degrees.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from datasets.recipes.recipe import MotionRecipe, Recipe, RigRecipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.scoring.angles import angles_up_to_symmetry
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.data.views import Views
from estimator.geometry.silhouettes import silhouettes
from estimator.particle.particle import Particle, particle_of
from estimator.poses.pose_search import SearchEffort, search_pose
from studies.flights.bodies import bodies, drawn_seed
from studies.frame.study import Case, Plan, Row, Settings
from synth.sequence import build_silhouette_sequence

EFFORT = SearchEffort(starts=96, candidates=16)
"""Twice the starts and candidates that a tracked sequence needs: a single picture has no neighbours that correct it."""
CAMERAS = 6
NOT_FOUND_DEG = 180.0


@dataclass(frozen=True)
class Figure4(Settings):
    """``views``: numbers of calibrated views, each a multiple of the rig's six cameras."""

    views: tuple[int, ...] = (6, 12, 24, 60)


def cases(settings: Figure4, particles: Path | None) -> list[Case]:
    """Every number of views of a body after the other; the body is the same in all."""
    return [_case(settings, k, n, particles) for k in range(settings.count) for n in settings.views]


def _case(settings: Figure4, k: int, views: int, particles: Path | None) -> Case:
    six, rig = bodies(particles), RigRecipe(drops=views // CAMERAS + 1)
    motion = MotionRecipe(frames=3, speed_ms=(0.0, 1.0))
    recipe = Recipe(seed=drawn_seed(settings.seed, k), particle=six[k % len(six)], motion=motion, rig=rig)
    labels = {"body": k, "regular": k % 2 == 0, "views": views}
    return Case(f"{k:04d}-{views:02d}", labels, {"recipe": recipe_to_dict(recipe), "views": views})


def pose_errors(payload: dict[str, Any]) -> list[Row]:
    """The poses of the last placement's pictures from the other views: a row per picture."""
    recipe = recipe_from_dict(payload["recipe"], "case of a study")
    observation, truth = build_silhouette_sequence(recipe, 0)
    n, outlines = payload["views"], cast("Sequence[Outline]", observation.view_recording)
    particle = particle_of(outlines[:n], observation.views[:n], Configuration())
    shared = {"particle": str(truth.notes["particle"]), "irregularity": float(truth.descriptors["irregularity"])}
    unknown = zip(outlines[n:], observation.views[n:], strict=True)
    return [shared | _found(particle, outline, view, truth.symmetries) for outline, view in unknown]


def _found(particle: Particle, outline: Outline, view: CalibratedView, symmetries: NDArray[np.float64]) -> Row:
    """Error (degrees) of the best pose, the RMS ETE (px) of it and of the next minimum; infinite where there is none."""
    views = Views(particle.seen, particle.poses, particle.body.com_particle)
    found = search_pose(silhouettes([outline], [view.intrinsics]), views, particle.catalogue, EFFORT)
    rms = [*found.rms_px[:2].tolist(), np.inf, np.inf][:2]
    if len(found.rms_px) == 0:
        return {"error_deg": NOT_FOUND_DEG, "rms_px": np.inf, "next_rms_px": np.inf}
    angle = angles_up_to_symmetry(found.poses.R[:1], view.R_cam_particle[None], symmetries)
    return {"error_deg": float(np.degrees(angle[0])), "rms_px": rms[0], "next_rms_px": rms[1]}


PLAN = Plan(
    small=Figure4(seed=1, count=6),
    full=Figure4(seed=1, count=240),
    cases=cases,
    task=pose_errors,
    modules=("studies.plans.figure_4", "studies.flights.bodies"),
)
