"""Two cameras: the same flight filmed by one camera, and by a second one at several angles, its clock known or half a frame off.

The second camera looks at the middle of the flights; lenses and poses of both are exact. Each arrangement draws flights that stay in all
of its pictures, so that with another camera some flights are others.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from datasets.recipes.recipe import FurtherHsvRecipe, MotionRecipe, Recipe
from datasets.recipes.toml_files import recipe_from_dict
from datasets.scoring.score import score
from estimator.data.configuration import Configuration
from estimator.measure import measure
from studies.flights.bodies import bodies, drawn_seed
from studies.flights.scored import DESCRIBED, SCORED, flight
from studies.frame.study import Case, Plan, Row, Settings
from synth.flight_bound import with_bound
from synth.sequence import build_silhouette_sequence

KNOWN = FurtherHsvRecipe()
ONE, UNKNOWN_CLOCK = "one camera", "90°, clock half a frame off"
ARRANGEMENTS: Mapping[str, FurtherHsvRecipe | None] = {
    ONE: None,
    "10°": replace(KNOWN, angle_deg=10.0),
    "30°": replace(KNOWN, angle_deg=30.0),
    "90°": replace(KNOWN, angle_deg=90.0),
    UNKNOWN_CLOCK: replace(KNOWN, angle_deg=90.0, offset_sigma_frames=0.5, hidden_offset_frames=(0.5, 0.5)),
}
"""The second camera of each; of the last one's clock the estimator is told no more than that it may be off by half a frame."""


@dataclass(frozen=True)
class TwoCameras(Settings):
    """Length and ranges of the flights."""

    frames: int = 100
    speed_ms: tuple[float, float] = (0.5, 1.5)
    spin_rads: tuple[float, float] = (50.0, 300.0)


def cases(settings: TwoCameras, particles: Path | None) -> list[Case]:
    """Every arrangement of a repetition after the other."""
    return [_case(settings, k, name, particles) for k in range(settings.count) for name in ARRANGEMENTS]


def _case(settings: TwoCameras, k: int, name: str, particles: Path | None) -> Case:
    six, second = bodies(particles), ARRANGEMENTS[name]
    recipe = Recipe(
        seed=drawn_seed(settings.seed, k),
        particle=six[k % len(six)],
        motion=MotionRecipe(settings.frames, speed_ms=settings.speed_ms, spin_rads=settings.spin_rads),
        further_hsv=() if second is None else (second,),
    )
    number = list(ARRANGEMENTS).index(name)
    return Case(f"{k:04d}-{number}", {"repetition": k, "second": name}, flight(recipe, bounded=second is None))


def clocked_flight(payload: dict[str, Any]) -> list[Row]:
    """Make, measure and score one flight, with the error of the second camera's clock where it was fitted."""
    recipe = recipe_from_dict(payload["recipe"], "case of a study")
    observation, truth = build_silhouette_sequence(recipe, 0)
    if payload["bounded"]:
        truth = with_bound(truth, observation.cameras[0], recipe.noise)
    estimate = measure(observation, Configuration())
    scored = score(estimate, truth)
    row = {key: scored[key] for key in DESCRIBED} | {key: scored[f"middle_{key}"] for key in SCORED if f"middle_{key}" in scored}
    row["by_samples"] = "surface" in estimate.statistics
    clock = estimate.statistics.get("clocks", {}).get("hsv_2")
    if clock is not None:
        off_s = clock["offset_s"] - truth.notes["further_cameras"][0]["clock_offset_s"]
        rate_hz = recipe.motion.frame_rate_hz
        row |= {"clock_error_frames": off_s * rate_hz, "clock_sigma_frames": clock["offset_s_sigma"] * rate_hz}
    return [row]


PLAN = Plan(
    small=TwoCameras(seed=1, count=1),
    full=TwoCameras(seed=1, count=120),
    cases=cases,
    task=clocked_flight,
    modules=("studies.plans.two_cameras", "studies.flights.bodies", "studies.flights.scored"),
)
