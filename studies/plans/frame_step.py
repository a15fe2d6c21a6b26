"""Frame step: the same flight measured from every picture, and from every second, fourth and eighth.

Pictures are left out of one recording, so that flight, body, views and noise are the same at every step and the time covered is, too. A
step takes away samples (errors grow as the root of the step, if nothing else does) and lets the particle turn farther from one picture to
the next, which is what tracking has to stand: at 300 rad/s and a step of 8 it is 0.6 rad.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, cast

from datasets.observation import Observation
from datasets.recipes.recipe import MotionRecipe, Recipe
from datasets.recipes.toml_files import recipe_from_dict, recipe_to_dict
from datasets.truth import Truth
from datasets.vocabulary.outline import Outline
from studies.flights.bodies import bodies, drawn_seed
from studies.flights.scored import measured_row
from studies.frame.study import Case, Plan, Row, Settings
from synth.flight_bound import with_bound
from synth.sequence import build_silhouette_sequence


@dataclass(frozen=True)
class FrameStep(Settings):
    """``frames`` of the whole recording, one more than a multiple of all ``steps``, so that its middle belongs to every step."""

    frames: int = 161
    steps: tuple[int, ...] = (1, 2, 4, 8)
    speed_ms: tuple[float, float] = (0.5, 1.5)
    spin_rads: tuple[float, float] = (50.0, 300.0)


def cases(settings: FrameStep, particles: Path | None) -> list[Case]:
    """One flight of each repetition, measured at every step."""
    return [_case(settings, k, particles) for k in range(settings.count)]


def _case(settings: FrameStep, k: int, particles: Path | None) -> Case:
    six = bodies(particles)
    motion = MotionRecipe(frames=settings.frames, speed_ms=settings.speed_ms, spin_rads=settings.spin_rads)
    recipe = Recipe(seed=drawn_seed(settings.seed, k), particle=six[k % len(six)], motion=motion)
    return Case(f"{k:04d}", {"repetition": k, "regular": k % 2 == 0}, {"recipe": recipe_to_dict(recipe), "steps": list(settings.steps)})


def stepped_rows(payload: dict[str, Any]) -> list[Row]:
    """Measure one flight at every step: a row for each."""
    recipe = recipe_from_dict(payload["recipe"], "case of a study")
    observation, truth = build_silhouette_sequence(recipe, 0)
    rows = []
    for step in payload["steps"]:
        seen, true = every(observation, truth, step)
        rows.append({"step": step, **measured_row(seen, with_bound(true, seen.cameras[0], recipe.noise), {})})
    return rows


def every(observation: Observation, truth: Truth, step: int) -> tuple[Observation, Truth]:
    """What is left of a recording where only every ``step``-th picture is kept."""
    outlines, motion = cast("Sequence[Outline]", observation.recordings[0]), truth.motion
    clock = replace(observation.clock, times_s=observation.clock.times_s[::step])
    kept = {name: getattr(motion, name)[::step] for name in ("times_s", "x_world", "q_world_body", "v_world", "omega_world")}
    return replace(observation, clock=clock, recordings=(tuple(outlines[::step]),)), replace(truth, motion=replace(motion, **kept))


PLAN = Plan(
    small=FrameStep(seed=1, count=3),
    full=FrameStep(seed=1, count=120),
    cases=cases,
    task=stepped_rows,
    modules=("studies.plans.frame_step", "studies.flights.bodies", "studies.flights.scored"),
)
