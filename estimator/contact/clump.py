"""A particle as a clump of overlapping spheres, as discrete element codes have it.

The spheres give the shape that touches; mass and inertia are those of the mesh, since overlapping spheres would count their overlap twice.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.errors import InputError
from estimator.contact.solid import Solid, SolidHull

Array = NDArray[np.float64]
INSIDE_TOLERANCE = 1e-6
"""How far a sphere may stand out of the hull, over the hull's extent: rounding, no more."""


@dataclass(frozen=True)
class Clump:
    """Spheres at ``centres_body`` (n, 3) m with ``radii`` (n,) m, moving as ``solid``.

    Raises
    ------
    InputError
        Where there is no sphere, or a radius is not above 0.
    """

    solid: Solid
    centres_body: Array
    radii: Array

    def __post_init__(self) -> None:
        if len(self.radii) == 0 or self.centres_body.shape != (len(self.radii), 3):
            raise InputError(
                f"clump: expected as many centres (n, 3) as radii and at least one, got {self.centres_body.shape} and {self.radii.shape}"
            )
        if not (np.isfinite(self.radii).all() and (self.radii > 0.0).all() and np.isfinite(self.centres_body).all()):
            raise InputError(f"clump: expected finite centres and radii above 0 m, got a smallest radius of {np.min(self.radii):g} m")


def clump_within(particle: SolidHull, centres_body: Array, radii: Array) -> Clump:
    """The clump, checked against the particle's hull.

    ``centres_body`` (n, 3) m, ``radii`` (n,) m.

    Raises
    ------
    InputError
        Where a sphere stands out of the hull: the message names the one that does most, and by how much.
    """
    clump = Clump(particle.solid, np.asarray(centres_body, dtype=np.float64), np.asarray(radii, dtype=np.float64))
    faces = ConvexHull(particle.vertices_body).equations
    outside = (clump.centres_body @ faces[:, :3].T + faces[:, 3]).max(axis=1) + clump.radii
    extent = float(np.ptp(particle.vertices_body, axis=0).max())
    worst = int(np.argmax(outside))
    if outside[worst] > INSIDE_TOLERANCE * extent:
        count = int((outside > INSIDE_TOLERANCE * extent).sum())
        raise InputError(
            f"clump: expected all {len(radii)} spheres inside the particle's hull, got {count} outside; "
            f"sphere {worst} stands out by {1e6 * outside[worst]:.3g} µm"
        )
    return clump
