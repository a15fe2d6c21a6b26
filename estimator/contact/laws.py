"""The two protocols of contact laws: one that strikes with an impulse, one that pushes with forces.

A model under test is one frozen parameter class that implements a protocol; nothing else knows which model it has in hand.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.plate import Plate
from estimator.contact.clump import Clump
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
class Pushed:
    """What a force law says of one impact.

    ``after``: the state when the last sphere lifts off, ``duration_s`` after the first touched. ``deepest_m``: greatest depth of a sphere.
    ``energy_off``: what the energy balance was off at most, over the energy before. ``steps`` taken; ``most_touching`` spheres at once.
    """

    after: BodyState
    duration_s: float
    deepest_m: float
    energy_off: float
    steps: int
    most_touching: int


class ForceLaw(Protocol):
    """State before, clump and plate give the state after, by forces integrated through the contact."""

    @property
    def name(self) -> str:
        """The law in a few words."""

    def through(self, state: BodyState, clump: Clump, plate: Plate) -> Pushed:
        """One impact, from the pose where the lowest sphere touches (the clump is set onto the plate along its normal).

        Raises
        ------
        InputError
            Where the lowest sphere does not approach the plate, or the time step given is too large.
        """
