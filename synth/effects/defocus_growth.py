"""Blur that grows away from the focal plane.

The silhouette is blurred with a Gaussian of ``s = blur |z - z_focus|``, ``z_focus`` the depth of the centre of mass in the sequence's first
frame, and its outline drawn at the half level, so that convex curves recede [Verbeek and van Vliet, IEEE Trans. Pattern Anal. Mach. Intell.
16 (1994) 726]. One depth for the whole particle; a lens's disk of confusion is taken to be Gaussian.

Valid where the lens is far from the particle against the depth of its flight.
"""

import numpy as np
from numpy.typing import NDArray

from synth.effects.links import Values


def sigma_px(beyond_focus_m: NDArray[np.float64], values: Values) -> NDArray[np.float64]:
    """Standard deviation (px) at depths (n,) m beyond the focal plane, negative before it."""
    return np.asarray(values["blur"] * np.abs(beyond_focus_m))
