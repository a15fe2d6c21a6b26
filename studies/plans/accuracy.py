"""Accuracy of whole measurements on scanned bodies, from nothing: projected outlines, rendered pictures of matte bodies and of diamond.

Flights are those of the recipe where nothing is asked: 100 pictures at 4000 frames/s, 60 calibrated views, up to 4 m/s and 300 rad/s.
Outlines have 0.2 px of noise. Of rendered flights the calibrated views are rendered, too.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from datasets.recipes.recipe import MotionRecipe, Recipe, RigRecipe
from datasets.recipes.toml_files import recipe_to_dict
from studies.flights.bodies import bodies, drawn_seed
from studies.flights.scored import flight, scored_flight
from studies.frame.study import Case, Plan, Row, Settings
from studies.plans.optics import filmed_flight

OUTLINES, MATTE, DIAMOND = "outlines", "matte", "diamond"
MATERIALS: Mapping[str, str] = {MATTE: "matte", DIAMOND: "diamond"}
"""What the bodies of rendered flights are made of."""


@dataclass(frozen=True)
class Accuracy(Settings):
    """``outlines``, ``matte`` and ``diamond``: flights of each kind in a repetition; ``views``: calibrated ones, a multiple of six."""

    outlines: int = 5
    matte: int = 2
    diamond: int = 1
    frames: int = 100
    views: int = 60


def cases(settings: Accuracy, particles: Path | None) -> list[Case]:
    """The flights of every kind, one repetition after the other; bodies come in turn in each."""
    counts = {OUTLINES: settings.outlines, MATTE: settings.matte, DIAMOND: settings.diamond}
    every = [(k, kind, k * many + j) for k in range(settings.count) for kind, many in counts.items() for j in range(many)]
    return [_case(settings, k, kind, number, particles) for k, kind, number in every]


def _case(settings: Accuracy, k: int, kind: str, number: int, particles: Path | None) -> Case:
    six, rendered = bodies(particles), kind in MATERIALS
    body = six[number % len(six)]
    recipe = Recipe(
        seed=drawn_seed(settings.seed, 3 * number + [OUTLINES, MATTE, DIAMOND].index(kind)),
        tier="rendered" if rendered else "silhouette",
        particle=replace(body, material=MATERIALS[kind]) if rendered else body,  # type: ignore[arg-type]
        motion=MotionRecipe(settings.frames),
        rig=RigRecipe(drops=settings.views // 6),
    )
    payload = {"recipe": recipe_to_dict(recipe)} if rendered else flight(recipe)
    return Case(f"{kind}-{number:04d}", {"repetition": k, "kind": kind, "number": number}, payload)


def measured_flight(payload: dict[str, Any]) -> list[Row]:
    """Make, measure and score one flight."""
    return filmed_flight(payload) if payload["recipe"]["tier"] == "rendered" else scored_flight(payload)


PLAN = Plan(
    small=Accuracy(seed=1, count=1, outlines=2, matte=1, frames=21, views=18),
    full=Accuracy(seed=1, count=24),
    cases=cases,
    task=measured_flight,
    modules=("studies.plans.accuracy", "studies.plans.optics", "studies.flights.bodies", "studies.flights.scored"),
)
