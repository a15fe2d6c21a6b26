"""What contact laws say of an impact: those that strike with an impulse, and those that push with forces.

A law is one frozen parameter class.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.contact.solid import BodyState

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
