"""Length, irregularity of the body and number of calibrated views in every combination.

One repetition draws flight and spin; its body, of the family that runs from the sphere to jagged lumps, has the same draw at every
irregularity. So points differ by what is varied, and a repetition's own luck is common to all of them.
"""

from dataclasses import dataclass
from itertools import product
from pathlib import Path

from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from studies.flights.bodies import drawn_seed
from studies.flights.scored import flight, scored_flight
from studies.frame.study import Case, Plan, Settings

CAMERAS = 6


@dataclass(frozen=True)
class Factorial(Settings):
    """Levels of the three factors; ``deformation`` is the recipe's irregularity, ``views`` multiples of the rig's six cameras."""

    frames: tuple[int, ...] = (25, 50, 100)
    deformation: tuple[float, ...] = (0.1, 0.4, 1.0)
    views: tuple[int, ...] = (12, 24, 60)
    speed_ms: tuple[float, float] = (1.0, 2.0)
    spin_rads: tuple[float, float] = (50.0, 300.0)


def cases(settings: Factorial, particles: Path | None) -> list[Case]:
    """Every combination of a repetition after the other; bodies are the project's own, whatever the others are."""
    points = list(product(settings.frames, settings.deformation, settings.views))
    return [_case(settings, k, *point) for k in range(settings.count) for point in points]


def _case(settings: Factorial, k: int, frames: int, deformation: float, views: int) -> Case:
    recipe = Recipe(
        seed=drawn_seed(settings.seed, k),
        particle=ParticleRecipe(family="jagged", irregularity=deformation),
        motion=MotionRecipe(frames=frames, speed_ms=settings.speed_ms, spin_rads=settings.spin_rads),
        rig=RigRecipe(drops=views // CAMERAS),
    )
    labels = {"repetition": k, "frames": frames, "deformation": deformation, "views": views}
    return Case(f"{k:04d}-{frames:03d}-{deformation:g}-{views:02d}", labels, flight(recipe))


PLAN = Plan(
    small=Factorial(seed=1, count=2, frames=(25, 100), deformation=(0.2, 1.0), views=(18, 60)),
    full=Factorial(seed=1, count=60),
    cases=cases,
    task=scored_flight,
    modules=("studies.plans.factorial", "studies.flights.bodies", "studies.flights.scored"),
)
