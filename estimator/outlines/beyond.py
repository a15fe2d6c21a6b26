"""Whether there is more of the particle outside of its outline.

Just beyond an outline, farther than the blur carries its edge, a picture should be its background. Under front light it is not: facets
that mirror the dark room are as dark as what is behind them, bright ones set the half level, and the outline runs along a facet's
edge inside of the particle. What is left outside departs from the background, either way, by more than noise. Averaged over 4 px across
and 7 samples along the outline, the noise of a pixel is about a sixth of its own, so three standard deviations are far from chance.
Measured: none of the rim of back-lit matte, metal and diamond particles, 57 to 100% of that of front-lit metal and diamond.
Not seen are facets whose light is the background's to within the noise.

Where the background itself is dark just beyond the outline (a plate that the particle is about to touch) there is no contrast to tell the
particle by, and the blurred edge of what is there moves the half level: a frame or two at an impact, ten times as wrong as the others.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from estimator.outlines.contour import Edge, outward_normals, profiles
from estimator.outlines.occupancy import Departure

ACROSS_PX = np.array([1.0, 2.0, 3.0, 4.0])
ALONG_SAMPLES = 3.0
NEAREST_PX = 2.0
OPEN_SHARE, OPEN_QUANTILE = 0.8, 0.9
"""Of the light around a particle (the brightest tenth of its window) what counts as open background; lamps fall off more slowly."""


def share_beyond(edge: Edge, departure: Departure, least_dn: float) -> float:
    """Share of the outline beyond which the picture departs from its background by ``least_dn`` (DN)."""
    offsets = max(edge.reach_px, NEAREST_PX) + ACROSS_PX
    outside = profiles(departure.amount, edge.points_px, outward_normals(edge.points_px), offsets).mean(axis=1)
    smooth = gaussian_filter1d(outside, ALONG_SAMPLES, mode="wrap")
    return float(np.mean(np.abs(smooth) > least_dn))


def before_scenery_px(edge: Edge, level: Float[NDArray[np.float32], "height width"]) -> float:
    """Length (px) of the outline just beyond which the background's ``level`` is not open: a plate's edge, a needle."""
    offsets = np.concatenate([[0.0], max(edge.reach_px, NEAREST_PX) + ACROSS_PX[:1]])
    least = profiles(level, edge.points_px, outward_normals(edge.points_px), offsets).min(axis=1)
    steps = np.linalg.norm(np.roll(edge.points_px, -1, axis=0) - edge.points_px, axis=1)
    return float(steps[least < OPEN_SHARE * np.quantile(level, OPEN_QUANTILE)].sum())
