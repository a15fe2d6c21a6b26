"""The frictionless baseline: an impulse along the normal alone, P = (1 + e) |uₙ| / Kₙₙ n.

Without friction Newton's, Poisson's and Stronge's restitution are one. A particle leaves with the tangential velocity it came with.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.constants import require_restitution
from estimator.contact.laws import Struck
from estimator.contact.rigid_impulses import Impulses, require_approach, strike_by
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Frictionless:
    """``restitution``: normal velocity after over before (0 to 1)."""

    restitution: float

    def __post_init__(self) -> None:
        require_restitution(self.restitution)

    @property
    def name(self) -> str:
        """The law in a few words."""
        return "frictionless"

    def strike(self, state: BodyState, solid: Solid, contact_world: Array, plate: Plate) -> Struck:
        """One impact at ``contact_world`` (3,) m; see :class:`estimator.contact.laws.ImpulseLaw`."""
        return strike_by(self.follow, state, solid, contact_world, plate)

    def follow(self, matrices: Array, velocities: Array) -> Impulses:
        """Impacts given by their collision matrices (n, 3, 3) 1/kg and velocities before (n, 3) m/s, axes (tangent, tangent, normal)."""
        require_approach(velocities)
        normal = (1.0 + self.restitution) * -velocities[:, 2] / matrices[:, 2, 2]
        impulse = np.column_stack([np.zeros((len(normal), 2)), normal])
        compression = -0.5 * velocities[:, 2] ** 2 / matrices[:, 2, 2]
        after = velocities + matrices[:, :, 2] * normal[:, None]
        return Impulses(after, impulse, compression, (1.0 - self.restitution**2) * compression, ("slips throughout",) * len(normal))
