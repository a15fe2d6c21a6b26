"""Whether there is more of the particle outside of its outline.

Just beyond an outline, farther than the blur carries its edge, a picture should be its background. Under front light it is not: facets
that mirror the dark room are as dark as what is behind them, bright ones set the half level, and the outline runs along a facet's
edge inside of the particle. What is left outside departs from the background, either way, by more than noise. Averaged over 4 px across
and 7 samples along the outline, the noise of a pixel is about a sixth of its own, so three standard deviations are far from chance.
Measured: none of the rim of back-lit matte, metal and diamond particles, 57 to 100% of that of front-lit metal and diamond.
Not seen are facets whose light is the background's to within the noise.
"""

import numpy as np
from scipy.ndimage import gaussian_filter1d

from estimator.outlines.contour import Edge, outward_normals, profiles
from estimator.outlines.occupancy import Departure

ACROSS_PX = np.array([1.0, 2.0, 3.0, 4.0])
ALONG_SAMPLES = 3.0
NEAREST_PX = 2.0


def share_beyond(edge: Edge, departure: Departure, least_dn: float) -> float:
    """Share of the outline beyond which the picture departs from its background by ``least_dn`` (DN)."""
    offsets = max(edge.reach_px, NEAREST_PX) + ACROSS_PX
    outside = profiles(departure.amount, edge.points_px, outward_normals(edge.points_px), offsets).mean(axis=1)
    smooth = gaussian_filter1d(outside, ALONG_SAMPLES, mode="wrap")
    return float(np.mean(np.abs(smooth) > least_dn))
