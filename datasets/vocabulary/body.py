"""The rigid body: where its centre of mass and principal axes lie in the particle frame, and its inertia."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray


@dataclass(frozen=True)
class Body:
    """A rigid body in the particle frame.

    ``x_particle = R_particle_body @ x_body + com_particle`` (m). ``inertia_ratios`` are the principal
    moments divided by the largest, ascending; the last is 1. Free flight sees no more than these.
    """

    com_particle: Float[NDArray[np.float64], "3"]
    R_particle_body: Float[NDArray[np.float64], "3 3"]
    inertia_ratios: Float[NDArray[np.float64], "3"]
