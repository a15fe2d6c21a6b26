"""The Mirtich–Stronge impulse model: rigid impact, Coulomb friction, energetic restitution, at one contact point.

Compression ends at uₙ = 0 with the work W_c < 0 of the normal impulse; restitution ends at W = (1 - e²) W_c [Stronge 1990]; in between the
contact slides, sticks or reverses as :mod:`estimator.contact.sliding_kernel` follows it [Mirtich 1996, chapter 3]. Then P = K⁻¹Δu.
No energy is made for any e from 0 to 1, μ ≥ 0 and inertia. Where the contact compresses a second time, W_c is the deeper of the two.

Limits: one contact point, no tangential compliance, e the same at every speed, no adhesion, friction the same at rest and sliding.
"""

from typing import ClassVar

from estimator.contact.rigid_impulses import SlidingImpulse
from estimator.contact.sliding_kernel import STRONGE


class StrongeImpulse(SlidingImpulse):
    """Stronge's energetic ``restitution`` (0 to 1) and Coulomb's ``friction`` (from 0)."""

    ends_by: ClassVar[int] = STRONGE

    @property
    def name(self) -> str:
        """The law in a few words."""
        return "Mirtich–Stronge impulse"
