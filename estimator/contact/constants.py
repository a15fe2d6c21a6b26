"""Checks of material constants, said once: every parameter class of the contact models calls these in its constructor.

The limits are those of isotropic linear elasticity (Poisson's ratio in (-1, 0.5), Young's modulus above 0), of a restitution that makes no
energy (at most 1) and of Coulomb friction (at least 0).
"""

import math
from dataclasses import dataclass

from datasets.errors import InputError


def require_restitution(value: float, *, lowest_allowed: bool = True) -> None:
    """Raise :class:`InputError` unless 0 ≤ e ≤ 1; with ``lowest_allowed`` false e = 0 is refused too."""
    if not math.isfinite(value) or value > 1.0 or value < 0.0 or (value == 0.0 and not lowest_allowed):
        raise InputError(f"coefficient of restitution: expected a number {'from' if lowest_allowed else 'above'} 0 to 1, got {value:g}")


def require_friction(value: float) -> None:
    """Raise :class:`InputError` unless the friction coefficient is finite and at least 0."""
    if not math.isfinite(value) or value < 0.0:
        raise InputError(f"friction coefficient: expected a number from 0 upwards, got {value:g}")


def require_poisson(value: float, of: str) -> None:
    """Raise :class:`InputError` unless Poisson's ratio of ``of`` lies above -1 and below 0.5."""
    if not -1.0 < value < 0.5:
        raise InputError(f"Poisson's ratio of the {of}: expected above -1 and below 0.5, got {value:g}")


def require_young(value: float, of: str, *, rigid_allowed: bool = False) -> None:
    """Raise :class:`InputError` unless Young's modulus (Pa) of ``of`` is above 0; infinite means rigid, where that is allowed."""
    if not value > 0.0 or (math.isinf(value) and not rigid_allowed):
        raise InputError(f"Young's modulus of the {of}: expected a{'' if rigid_allowed else ' finite'} number above 0 Pa, got {value:g}")


def require_positive(value: float, what: str, unit: str) -> None:
    """Raise :class:`InputError` unless ``value`` is finite and above 0."""
    if not math.isfinite(value) or value <= 0.0:
        raise InputError(f"{what}: expected a finite number above 0 {unit}, got {value:g}")


@dataclass(frozen=True)
class RestitutionAndFriction:
    """The constants of a rigid law with friction: ``restitution`` (0 to 1) and Coulomb's ``friction`` (from 0)."""

    restitution: float
    friction: float

    def __post_init__(self) -> None:
        require_restitution(self.restitution)
        require_friction(self.friction)
