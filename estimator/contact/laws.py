"""The two protocols of contact laws: one that strikes with an impulse, one that pushes with forces.

A model under test is one frozen parameter class that implements a protocol; nothing else knows which model it has in hand.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.solid import BodyState, Solid

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Struck:
    """What an impulse law says of one impact.

    ``after``: the state just after, pose unchanged. ``impulse_world`` (3,) N s on the particle at the contact. ``u_before`` and
    ``u_after`` (3,) m/s: of the contact point as seen from the plate, world frame. ``compression_j`` and ``normal_j``: work (J) of the
    normal impulse up to the greatest compression and over the whole impact. ``sliding``: how the contact ended, in words.
    """

    after: BodyState
    impulse_world: Array
    u_before: Array
    u_after: Array
    compression_j: float
    normal_j: float
    sliding: str


class ImpulseLaw(Protocol):
    """State before, solid, contact point and plate give the state after."""

    @property
    def name(self) -> str:
        """The law in a few words."""

    def strike(self, state: BodyState, solid: Solid, contact_world: Array, plate: Plate) -> Struck:
        """One impact at ``contact_world`` (3,) m.

        Raises
        ------
        InputError
            Where the contact point does not approach the plate.
        """


@dataclass(frozen=True)
class SphereContacts:
    """Spheres that touch a plate at one moment, seen in the axes (tangent, tangent, normal) of the plate.

    ``depth`` (n,) m, above 0; ``radius`` (n,) m; ``slip`` (n, 2) m total tangential displacement; ``velocity`` (n, 3) m/s of the contact
    point as seen from the plate; ``effective_mass`` (n,) kg: what the damping of each contact has to work against.
    """

    depth: Array
    radius: Array
    slip: Array
    velocity: Array
    effective_mass: Array


class ForceLaw(Protocol):
    """Depths, slips and velocities of touching spheres give forces; an integrator carries them through the contact."""

    @property
    def name(self) -> str:
        """The law in a few words."""

    def forces(self, contacts: SphereContacts) -> Array:
        """Forces (n, 3) N on the particle in the axes of the contacts."""
