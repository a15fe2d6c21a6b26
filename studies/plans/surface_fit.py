"""The surface as an unknown: the same flights measured by tangents alone and by all samples of all outlines, by class of body.

Smooth bodies are scanned asteroids and a moon, stones are scanned by hand; cut and jagged ones are the project's own. Outlines have no
offset here. Who knows that states it, since beside gravity the size of outlines alone says how far away a body is: the third fit does.
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from studies.flights.bodies import drawn_seed, scanned_files
from studies.flights.scored import measured_row
from studies.frame.study import Case, Plan, Row, Settings
from synth.flight_bound import with_bound
from synth.sequence import build_silhouette_sequence

TANGENTS, SAMPLES, KNOWN = "tangents", "samples", "samples, offset known"
FITS: Mapping[str, Mapping[str, Any]] = {TANGENTS: {"surface_fit": 0}, SAMPLES: {}, KNOWN: {"offset_prior_px": 0.001}}
"""How the estimator is asked; samples are what it fits where nothing is asked and views are enough."""


@dataclass(frozen=True)
class SurfaceFit(Settings):
    """``views``: calibrated ones, a multiple of six; their number decides how much of the surface the frames have to tell."""

    frames: int = 100
    views: int = 60
    speed_ms: tuple[float, float] = (0.5, 1.5)
    spin_rads: tuple[float, float] = (50.0, 300.0)


def classes(folder: Path | None) -> dict[str, ParticleRecipe]:
    """The bodies of every class; without a folder of scanned particles the project's own."""
    own = {name: ParticleRecipe(family=family) for name, family in (("cut", "cut_stone"), ("jagged", "jagged"))}  # type: ignore[arg-type]
    if folder is None:
        return own
    files = scanned_files(folder)
    return {"smooth": ParticleRecipe(files=tuple(files[3:])), "stones": ParticleRecipe(files=tuple(files[:3])), **own}


def cases(settings: SurfaceFit, particles: Path | None) -> list[Case]:
    """One flight of each class, one repetition after the other."""
    return [_case(settings, k, name, body) for k in range(settings.count) for name, body in classes(particles).items()]


def _case(settings: SurfaceFit, k: int, name: str, body: ParticleRecipe) -> Case:
    one = replace(body, files=(body.files[k % len(body.files)],)) if body.files else body
    recipe = Recipe(
        seed=drawn_seed(settings.seed, k),
        particle=one,
        motion=MotionRecipe(settings.frames, speed_ms=settings.speed_ms, spin_rads=settings.spin_rads),
        rig=RigRecipe(drops=settings.views // 6),
    )
    return Case(f"{k:04d}-{name}", {"repetition": k, "body": name}, {"recipe": recipe_to_dict(recipe)})


def fitted_rows(payload: dict[str, Any]) -> list[Row]:
    """Make one flight and measure it by every fit: a row for each."""
    recipe = recipe_from_dict(payload["recipe"], "case of a study")
    observation, truth = build_silhouette_sequence(recipe, 0)
    truth = with_bound(truth, observation.cameras[0], recipe.noise)
    rows = []
    for name, configuration in FITS.items():
        began = time.process_time()
        row = measured_row(observation, truth, configuration)
        rows.append({"fit": name, **row, "fit_cpu_s": time.process_time() - began})
    return rows


PLAN = Plan(
    small=SurfaceFit(seed=1, count=1),
    full=SurfaceFit(seed=1, count=60),
    cases=cases,
    task=fitted_rows,
    modules=("studies.plans.surface_fit", "studies.flights.bodies", "studies.flights.scored"),
)
