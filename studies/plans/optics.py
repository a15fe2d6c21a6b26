"""Optics: pictures of one flight, one thing about camera and light worse at a time, to see which limits first.

The base is the recipe's camera: f/16, 50 µs, 12 bits, 20,000 electrons of full well. Each variation renders the same flight of the same
body anew; the calibrated views are outlines, so that what differs is the high-speed camera's. The extraction has no threshold to vary: it
measures where the edge is from the picture's own blur and levels.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from datasets.dataset_files import observation_folder, truth_folder
from datasets.observation_files import read_observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, Recipe, RenderingRecipe, RigRecipe, SensorRecipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.truth_files import read_truth
from studies.flights.bodies import bodies, drawn_seed
from studies.flights.scored import measured_row
from studies.frame.study import Case, Plan, Row, Settings
from synth.rendering.sequence import render_sequence

BASE = "as it is"
VARIATIONS: Mapping[str, Any] = {
    BASE: {},
    "exposure 200 µs": {"hsv": {"exposure_us": 200.0}},
    "f/4": {"hsv": {"f_number": 4.0}},
    "8 bits": {"sensor": {"bit_depth": 8}},
    "2000 electrons": {"sensor": {"full_well_e": 2000.0, "read_noise_e": 30.0}},
    "pixels twice as large": {"hsv": {"pixel_pitch_um": 40.0, "width_px": 512, "height_px": 512}},
    "half the frame rate": {"motion": {"frame_rate_hz": 2000.0}},
}
"""What is changed in each part of the recipe; half the frame rate films the same time in half the pictures."""


@dataclass(frozen=True)
class Optics(Settings):
    """``frames`` of the base, one more than a multiple of two; ``samples`` of light for each pixel and sub-frame."""

    frames: int = 41
    views: int = 24
    speed_ms: tuple[float, float] = (0.5, 1.5)
    spin_rads: tuple[float, float] = (50.0, 200.0)
    samples: int = 4


def cases(settings: Optics, particles: Path | None) -> list[Case]:
    """Every variation of a flight after the other."""
    return [_case(settings, k, name, particles) for k in range(settings.count) for name in VARIATIONS]


def _case(settings: Optics, k: int, name: str, particles: Path | None) -> Case:
    six, changed = bodies(particles), VARIATIONS[name]
    frames = (settings.frames - 1) // 2 + 1 if "motion" in changed else settings.frames
    recipe = Recipe(
        seed=drawn_seed(settings.seed, k),
        tier="rendered",
        particle=six[k % len(six)],
        motion=replace(MotionRecipe(frames, speed_ms=settings.speed_ms, spin_rads=settings.spin_rads), **changed.get("motion", {})),
        hsv=replace(HsvRecipe(), **changed.get("hsv", {})),
        rig=RigRecipe(drops=settings.views // 6, rendered=False),
        rendering=RenderingRecipe(samples_per_subframe=settings.samples),
        sensor=replace(SensorRecipe(), **changed.get("sensor", {})),
    )
    number = list(VARIATIONS).index(name)
    return Case(f"{k:04d}-{number}", {"repetition": k, "variation": name}, {"recipe": recipe_to_dict(recipe)})


def filmed_flight(payload: dict[str, Any]) -> list[Row]:
    """Render, measure and score one flight; its pictures are not kept."""
    recipe = recipe_from_dict(payload["recipe"], "case of a study")
    with TemporaryDirectory() as folder:
        out = Path(folder)
        name = render_sequence(recipe, 0, out)
        observation, truth = read_observation(observation_folder(out, name)), read_truth(truth_folder(out, name))
        return [measured_row(observation, truth, {})]


PLAN = Plan(
    small=Optics(seed=1, count=1, frames=21),
    full=Optics(seed=1, count=60),
    cases=cases,
    task=filmed_flight,
    modules=("studies.plans.optics", "studies.flights.bodies", "studies.flights.scored"),
)
