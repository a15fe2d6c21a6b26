"""Newton's and Poisson's restitution on the same sliding contact, for comparison with Stronge's.

Newton: restitution ends at uₙ = -e uₙ⁻; Poisson: at pₙ = (1 + e) p_c, p_c the normal impulse of compression. With friction in an eccentric
impact either may make energy [Stronge 1990; Mirtich 1996, section 3.4], which is why neither is a model under test.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.constants import require_friction, require_restitution
from estimator.contact.laws import Struck
from estimator.contact.rigid_impulses import Impulses, follow_impulses, strike_by
from estimator.contact.sliding_kernel import NEWTON, POISSON
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class NewtonImpulse:
    """``restitution``: normal velocity after over before (0 to 1); ``friction``: Coulomb's (from 0)."""

    restitution: float
    friction: float

    def __post_init__(self) -> None:
        require_restitution(self.restitution)
        require_friction(self.friction)

    @property
    def name(self) -> str:
        """The law in a few words."""
        return "Newton's restitution"

    def strike(self, state: BodyState, solid: Solid, contact_world: Array, plate: Plate) -> Struck:
        """One impact at ``contact_world`` (3,) m; see :class:`estimator.contact.laws.ImpulseLaw`."""
        return strike_by(self.follow, state, solid, contact_world, plate)

    def follow(self, matrices: Array, velocities: Array) -> Impulses:
        """Impacts given by their collision matrices (n, 3, 3) 1/kg and velocities before (n, 3) m/s, axes (tangent, tangent, normal)."""
        return follow_impulses(matrices, velocities, self.restitution, self.friction, NEWTON)


@dataclass(frozen=True)
class PoissonImpulse:
    """``restitution``: normal impulse of restitution over that of compression (0 to 1); ``friction``: Coulomb's (from 0)."""

    restitution: float
    friction: float

    def __post_init__(self) -> None:
        require_restitution(self.restitution)
        require_friction(self.friction)

    @property
    def name(self) -> str:
        """The law in a few words."""
        return "Poisson's restitution"

    def strike(self, state: BodyState, solid: Solid, contact_world: Array, plate: Plate) -> Struck:
        """One impact at ``contact_world`` (3,) m; see :class:`estimator.contact.laws.ImpulseLaw`."""
        return strike_by(self.follow, state, solid, contact_world, plate)

    def follow(self, matrices: Array, velocities: Array) -> Impulses:
        """Impacts given by their collision matrices (n, 3, 3) 1/kg and velocities before (n, 3) m/s, axes (tangent, tangent, normal)."""
        return follow_impulses(matrices, velocities, self.restitution, self.friction, POISSON)
