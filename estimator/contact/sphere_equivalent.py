"""The sphere-equivalent baseline: the particle strikes as the uniform sphere of its volume and mass would.

Sphere on plane: it slips throughout where |u_t| ≥ 3.5 μ (1 + e) |uₙ|, with P = m (1 + e) |uₙ| (-μ t̂, 1); otherwise it ends rolling, with
P_t = -(2m/7) u_t [Maw, Barber & Fawcett 1976 in the rigid limit]. The contact lies below the centre, whatever point the shape touches with.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.collision_matrix import after_impulse, contact_velocity
from estimator.contact.constants import RestitutionAndFriction
from estimator.contact.laws import Struck
from estimator.contact.rigid_impulses import require_approach
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]


class SphereEquivalent(RestitutionAndFriction):
    """``restitution``: normal velocity after over before (0 to 1); ``friction``: Coulomb's (from 0)."""

    def strike(self, state: BodyState, solid: Solid, contact_world: Array, plate: Plate) -> Struck:
        """One impact; ``contact_world`` (3,) m is not used, since a sphere touches below its centre."""
        sphere = sphere_of(solid)
        lever = -sphere.equivalent_radius_m * plate.normal_world
        before = contact_velocity(state, lever, plate)
        approach = float(before @ plate.normal_world)
        require_approach(np.array([[0.0, 0.0, approach]]))
        along = before - approach * plate.normal_world
        normal = -solid.mass_kg * (1.0 + self.restitution) * approach
        sticking = -(2.0 / 7.0) * solid.mass_kg * along
        limit = self.friction * normal
        slips = float(np.linalg.norm(sticking)) >= limit
        tangential = -limit * along / max(float(np.linalg.norm(along)), 1e-300) if slips else sticking
        impulse = normal * plate.normal_world + tangential
        after = after_impulse(state, sphere, lever, impulse)
        compression = -0.5 * solid.mass_kg * approach**2
        return Struck(
            after=after,
            impulse_world=impulse,
            u_before=before,
            u_after=contact_velocity(after, lever, plate),
            compression_j=compression,
            normal_j=(1.0 - self.restitution**2) * compression,
            sliding="slips throughout" if slips else "sticks",
        )


def sphere_of(solid: Solid) -> Solid:
    """The uniform sphere of the same mass and volume."""
    moment = 0.4 * solid.mass_kg * solid.equivalent_radius_m**2
    return Solid(solid.mass_kg, solid.volume_m3, moment * np.eye(3))
