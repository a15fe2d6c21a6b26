"""Surfaces: matte (Lambert), rough metal (GGX microfacets, iron), clear diamond (smooth dielectric, n = 2.42).

A material is Mitsuba's dictionary and the number of path segments that it takes: one reflection between facets for opaque ones,
and for diamond the many internal reflections that total reflection (from 24.4° on) brings. No dispersion, no absorption.
"""

from dataclasses import dataclass
from typing import Any

from datasets.errors import InputError

DIAMOND_IOR = 2.42


@dataclass(frozen=True)
class Material:
    """``bsdf``: Mitsuba's description; ``depth``: longest path, in segments; ``dull``: its light hardly differs from ray to ray."""

    bsdf: dict[str, Any]
    depth: int
    dull: bool = False


MATERIALS: dict[str, Material] = {
    "matte": Material({"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}}, 3, dull=True),
    "rough_metal": Material(
        {"type": "roughconductor", "alpha": 0.25, "eta": {"type": "uniform", "value": 2.9}, "k": {"type": "uniform", "value": 3.1}}, 4
    ),
    "diamond": Material({"type": "dielectric", "int_ior": DIAMOND_IOR, "ext_ior": 1.0}, 16),
}


STEEL = Material(
    {"type": "roughconductor", "alpha": 0.15, "eta": {"type": "uniform", "value": 2.9}, "k": {"type": "uniform", "value": 3.1}}, 4
)
"""The plate: ground, so smoother than the particles' metal."""


def material(name: str) -> Material:
    """The material called ``name``.

    Raises
    ------
    InputError
        Where there is none of that name.
    """
    if name not in MATERIALS:
        raise InputError(f"particle.material: expected one of {list(MATERIALS)}, got {name!r}")
    return MATERIALS[name]
