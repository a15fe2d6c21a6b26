"""The Mirtich–Stronge impulse model: rigid impact, Coulomb friction, energetic restitution, at one contact point.

Compression ends at uₙ = 0 with the work W_c < 0 of the normal impulse; restitution ends at W = (1 - e²) W_c [Stronge 1990]; in between the
contact slides, sticks or reverses as :mod:`estimator.contact.sliding_kernel` follows it [Mirtich 1996, chapter 3]. Then P = K⁻¹Δu.
No energy is made for any e from 0 to 1, μ ≥ 0 and inertia. Where the contact compresses a second time, W_c is the deeper of the two.

Limits: one contact point, no tangential compliance, e the same at every speed, no adhesion, friction the same at rest and sliding.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.constants import require_friction, require_restitution
from estimator.contact.laws import Struck
from estimator.contact.rigid_impulses import Impulses, follow_impulses, strike_by
from estimator.contact.sliding_kernel import STRONGE
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StrongeImpulse:
    """Stronge's energetic ``restitution`` (0 to 1) and Coulomb's ``friction`` (from 0)."""

    restitution: float
    friction: float

    def __post_init__(self) -> None:
        require_restitution(self.restitution)
        require_friction(self.friction)

    @property
    def name(self) -> str:
        """The law in a few words."""
        return "Mirtich–Stronge impulse"

    def strike(self, state: BodyState, solid: Solid, contact_world: Array, plate: Plate) -> Struck:
        """One impact at ``contact_world`` (3,) m; see :class:`estimator.contact.laws.ImpulseLaw`."""
        return strike_by(self.follow, state, solid, contact_world, plate)

    def follow(self, matrices: Float[NDArray[np.float64], "n 3 3"], velocities: Float[NDArray[np.float64], "n 3"]) -> Impulses:
        """Impacts given by their collision matrices (1/kg) and velocities before (m/s), axes (tangent, tangent, normal)."""
        return follow_impulses(matrices, velocities, self.restitution, self.friction, STRONGE)
