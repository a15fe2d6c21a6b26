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


def signed_axes(axes: Float[NDArray[np.float64], "3 3"]) -> Float[NDArray[np.float64], "3 3"]:
    """The one right-handed choice of signs that everybody makes of principal axes (columns, ascending moments).

    The largest component of the first two is positive and the third is their cross product, so that a vector in body axes, such as a
    centre of mass, means the same whoever found the axes.
    """
    first, second = (axes[:, k] * np.sign(axes[np.argmax(np.abs(axes[:, k])), k]) for k in (0, 1))
    return np.column_stack([first, second, np.cross(first, second)])
