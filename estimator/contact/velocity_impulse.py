"""Newton's and Poisson's restitution on the same sliding contact, for comparison with Stronge's.

Newton: restitution ends at uₙ = -e uₙ⁻; Poisson: at pₙ = (1 + e) p_c, p_c the normal impulse of compression. With friction in an eccentric
impact either may make energy [Stronge 1990; Mirtich 1996, section 3.4], which is why neither is a model under test.
"""

from typing import ClassVar

from estimator.contact.rigid_impulses import SlidingImpulse
from estimator.contact.sliding_kernel import NEWTON, POISSON


class NewtonImpulse(SlidingImpulse):
    """``restitution``: normal velocity after over before (0 to 1); ``friction``: Coulomb's (from 0)."""

    ends_by: ClassVar[int] = NEWTON


class PoissonImpulse(SlidingImpulse):
    """``restitution``: normal impulse of restitution over that of compression (0 to 1); ``friction``: Coulomb's (from 0)."""

    ends_by: ClassVar[int] = POISSON
