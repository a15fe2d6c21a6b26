"""Forces that the catalogue lacks, in a field campaign: attraction to a plane, or a thrust fixed to the body.

The limit is the size at which what the best effect that flights share leaves of it would be found; it is approached by flying the force.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.recipes.effects import KNOWN
from tumble.challenge.field_case import Effects, FieldCase
from tumble.challenge.field_flights import flown
from tumble.challenge.field_limits import Known, left_at_limit, left_of

Array = NDArray[np.float64]
ROUNDS = 3
FIRST_MS2 = 0.3
"""Acceleration that is flown first."""
LARGEST_MS2 = 20.0
APART_M = (0.1, 0.5)
"""Distance of the wall from the flight that comes nearest to it."""
ARM_M = (1e-3, 5e-3)


def draw_outside(case: FieldCase, of: Known, over: tuple[float, float], rng: np.random.Generator) -> tuple[Effects, dict[str, float]]:
    """A force and its size over its limit.

    Raises
    ------
    InputError
        Where it would have to be larger than nature makes it.
    """
    key = "wall_attraction" if case.measured.startswith("positions") else "outgassing_thrust"
    unit = _wall(case, rng) if key == "wall_attraction" else _thrust(rng)
    size = FIRST_MS2
    for _ in range(ROUNDS):
        left = left_of(of, replace(case, outside={key: _of_size(case, key, unit, size)}))
        if left <= 0.0:
            raise InputError(f"{key}: expected something left by the catalogue, came nothing.")
        size = min(size * float(np.sqrt(left_at_limit(of) / left)), LARGEST_MS2)
    if size * over[0] >= LARGEST_MS2:
        raise InputError(f"{key}: expected a limit below {LARGEST_MS2:g} m/s2, came more.")
    times = float(np.exp(rng.uniform(*np.log((over[0], min(over[1], LARGEST_MS2 / size))))))
    return {key: _of_size(case, key, unit, size * times)}, {key: times}


def _wall(case: FieldCase, rng: np.random.Generator) -> dict[str, float]:
    """A wall of any direction beside all flights; ``strength`` for 1 m/s² where a flight is nearest."""
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    apart = float(rng.uniform(*APART_M))
    nearest = min(float((flown(case, number).x @ normal).min()) for number in range(len(case.flights)))
    names = KNOWN["wall_attraction"].names
    return dict(zip(names, (apart**2, *(float(n) for n in normal), nearest - apart), strict=True))


def _thrust(rng: np.random.Generator) -> dict[str, float]:
    """A vent; its thrust is 1 m/s²."""
    thrust, arm = rng.normal(size=3), rng.normal(size=3)
    thrust /= np.linalg.norm(thrust)
    arm *= float(rng.uniform(*ARM_M)) / np.linalg.norm(arm)
    return dict(zip(KNOWN["outgassing_thrust"].names, (float(v) for v in (*thrust, *arm)), strict=True))


def _of_size(case: FieldCase, key: str, unit: dict[str, float], size: float) -> dict[str, tuple[float, ...]]:
    """Values of every flight."""
    sizes = KNOWN[key].sizes
    return {name: (value * (size if name in sizes else 1.0),) * len(case.flights) for name, value in unit.items()}
