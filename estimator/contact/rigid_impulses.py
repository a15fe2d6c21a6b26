"""From states to contact axes and back: what every rigid impulse law with Coulomb friction does around its kernel."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError, TumbleError
from datasets.vocabulary.plate import Plate
from estimator.contact.collision_matrix import after_impulse, collision_matrix, contact_axes, contact_velocity
from estimator.contact.constants import RestitutionAndFriction
from estimator.contact.laws import Struck
from estimator.contact.sliding_kernel import REVERSES, SLIPS, STICKS, follow_many
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]
SLIDING_WORDS = {SLIPS: "slips throughout", STICKS: "sticks", REVERSES: "slips anew along the diverging ray"}


@dataclass(frozen=True)
class Impulses:
    """n impacts in contact axes: ``velocity_after`` (n, 3) m/s, ``impulse`` (n, 3) N s and the rest as in :class:`Struck`.

    ``compression_j``, ``normal_j`` (n,) J.
    """

    velocity_after: Array
    impulse: Array
    compression_j: Array
    normal_j: Array
    sliding: tuple[str, ...]


def require_approach(velocities: Array) -> None:
    """Raise :class:`InputError` unless all contact points of ``velocities`` (n, 3) m/s, normal last, move towards the plate."""
    leaving = np.flatnonzero(~(velocities[:, 2] < 0.0))
    if leaving.size:
        found = velocities[leaving[0], 2]
        raise InputError(f"impact {leaving[0]}: expected a contact point that approaches the plate, got normal velocity {found:+.4g} m/s")


class SlidingImpulse(RestitutionAndFriction):
    """A law that follows the sliding contact to the end that ``ends_by`` names."""

    ends_by: ClassVar[int]

    def strike(self, state: BodyState, solid: Solid, contact_world: Array, plate: Plate) -> Struck:
        """One impact at ``contact_world`` (3,) m.

        Raises
        ------
        InputError
            Where the contact point does not approach the plate.
        """
        lever = contact_world - state.x_world
        axes = contact_axes(plate.normal_world)
        matrix = collision_matrix(solid.mass_kg, solid.inertia_world(state.R_world_body), lever)
        before = contact_velocity(state, lever, plate)
        found = self.follow((axes @ matrix @ axes.T)[None], (axes @ before)[None])
        impulse = axes.T @ found.impulse[0]
        return Struck(
            after=after_impulse(state, solid, lever, impulse),
            impulse_world=impulse,
            u_before=before,
            u_after=axes.T @ found.velocity_after[0],
            compression_j=float(found.compression_j[0]),
            normal_j=float(found.normal_j[0]),
            sliding=found.sliding[0],
        )

    def follow(self, matrices: Array, velocities: Array) -> Impulses:
        """Impacts given by their collision matrices (n, 3, 3) 1/kg and velocities before (n, 3) m/s, axes (tangent, tangent, normal).

        Raises
        ------
        InputError
            Where a contact point does not approach.
        """
        require_approach(velocities)
        e, mu = np.full(len(velocities), float(self.restitution)), np.full(len(velocities), float(self.friction))
        K, u = np.ascontiguousarray(matrices, dtype=float), np.ascontiguousarray(velocities, dtype=float)
        followed = follow_many(K, u, e, mu, self.ends_by)
        if not followed[:, 7].all():
            raise TumbleError(f"impact {int(np.argmin(followed[:, 7]))}: the sliding contact came to no end")
        change = np.linalg.solve(matrices, (followed[:, :3] - velocities)[:, :, None])[:, :, 0]
        words = tuple(SLIDING_WORDS[int(kind)] for kind in followed[:, 6])
        return Impulses(followed[:, :3], change, followed[:, 3], followed[:, 4], words)
