"""Depth: focal length at equal magnification, flights within the image plane and along the axis, one camera and two.

A thin lens of focal length ``f`` at the distance ``d = f (1 + 1/m)`` has the magnification ``m``; at 0.2 and 20 µm pixels a pixel shows
0.1 mm at the particle whatever the lens. Depth shows in the outline's size alone, ``s = p / Z``, so that at equal ``s`` an error of ``s``
is one of depth in proportion to ``Z``. A second camera at 90° sees depth as the first one sees its plane.
"""

from dataclasses import dataclass
from itertools import product
from pathlib import Path

import numpy as np

from datasets.recipes.recipe import FurtherHsvRecipe, HsvRecipe, MotionRecipe, Recipe
from studies.flights.bodies import bodies, drawn_seed
from studies.flights.scored import flight, scored_flight
from studies.frame.study import Case, Plan, Settings

MAGNIFICATION = 0.2


@dataclass(frozen=True)
class Depth(Settings):
    """Levels of the three factors; ``direction_deg``: of the velocity at the start from the image plane of the first camera."""

    focal_mm: tuple[float, ...] = (50.0, 100.0, 200.0)
    direction_deg: tuple[float, ...] = (0.0, 90.0)
    cameras: tuple[int, ...] = (1, 2)
    frames: int = 100
    speed_ms: float = 1.5
    spin_rads: tuple[float, float] = (50.0, 300.0)


def distance_m(focal_mm: float) -> float:
    """Distance of the focal plane at which a thin lens has the magnification of the study."""
    return round(focal_mm * 1e-3 * (1 + 1 / MAGNIFICATION), 9)


def cases(settings: Depth, particles: Path | None) -> list[Case]:
    """Every combination of a repetition after the other."""
    points = list(product(settings.focal_mm, settings.direction_deg, settings.cameras))
    return [_case(settings, k, particles, point) for k in range(settings.count) for point in points]


def _case(settings: Depth, k: int, particles: Path | None, point: tuple[float, float, int]) -> Case:
    focal_mm, direction_deg, cameras = point
    six, along = bodies(particles), round(float(settings.speed_ms * np.sin(np.deg2rad(direction_deg))), 9)
    speed = (settings.speed_ms, settings.speed_ms)
    recipe = Recipe(
        seed=drawn_seed(settings.seed, k),
        particle=six[k % len(six)],
        motion=MotionRecipe(frames=settings.frames, speed_ms=speed, spin_rads=settings.spin_rads, out_of_plane_ms=(along, along)),
        hsv=HsvRecipe(focal_mm=focal_mm, distance_m=distance_m(focal_mm)),
        further_hsv=(FurtherHsvRecipe(),) * (cameras - 1),
    )
    labels = {"repetition": k, "focal_mm": focal_mm, "direction_deg": direction_deg, "cameras": cameras}
    return Case(f"{k:04d}-{focal_mm:g}-{direction_deg:g}-{cameras}", labels, flight(recipe, bounded=cameras == 1))


PLAN = Plan(
    small=Depth(seed=1, count=1, focal_mm=(50.0, 200.0)),
    full=Depth(seed=1, count=60),
    cases=cases,
    task=scored_flight,
    modules=("studies.plans.depth", "studies.flights.bodies", "studies.flights.scored"),
)
