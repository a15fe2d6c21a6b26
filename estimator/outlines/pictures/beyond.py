"""Whether there is more of the particle outside of its outline.

Just beyond an outline, farther than the blur carries its edge, a picture should be its background. Under front light it is not: facets
that mirror the dark room are as dark as what is behind them, bright ones set the half level, and the outline runs along a facet's
edge inside of the particle. What is left outside departs from the background, either way, by more than noise. Averaged over 4 px across
and 7 samples along the outline, the noise of a pixel is about a sixth of its own, so three standard deviations are far from chance.
Measured: none of the rim of back-lit matte, metal and diamond particles, 57 to 100% of that of front-lit metal and diamond.
Not seen are facets whose light is the background's to within the noise.

Where the background itself is dark just beyond the outline (a plate that the particle is about to touch) there is no contrast to tell the
particle by, and the blurred edge of what is there moves the half level: a frame or two at an impact, ten times as wrong as the others.
The rest of such an outline is as good as any.
"""

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from estimator.outlines.pictures.contour import Edge, outward_normals, profiles
from estimator.outlines.pictures.occupancy import Departure

ACROSS_PX = np.array([1.0, 2.0, 3.0, 4.0])
"""Distances beyond an edge's blur at which pictures are looked at."""
ALONG_SAMPLES = 3.0
"""Standard deviation of the smoothing along the outline: noise of single pixels is no scenery. By judgement."""
NEAREST_PX = 2.0
"""Where that begins at least, however sharp the edge."""
OPEN_SHARE, OPEN_QUANTILE = 0.8, 0.9
"""Of the light around a particle (the brightest tenth of its window) what counts as open background; lamps fall off more slowly."""


def share_beyond(edge: Edge, departure: Departure, least_dn: float, scenery: Bool[NDArray[np.bool_], " n"]) -> float:
    """Share of the outline beyond which the picture departs from its background by ``least_dn`` (DN).

    Points before ``scenery`` do not count: a particle casts its shadow and its mirror image on what it is about to touch.
    """
    offsets = max(edge.reach_px, NEAREST_PX) + ACROSS_PX
    outside = profiles(departure.amount, edge.points_px, outward_normals(edge.points_px), offsets).mean(axis=1)
    smooth = gaussian_filter1d(np.where(scenery, 0.0, outside), ALONG_SAMPLES, mode="wrap")
    return float(np.sum(np.abs(smooth[~scenery]) > least_dn)) / max(int(np.sum(~scenery)), 1)


def before_scenery(edge: Edge, level: Float[NDArray[np.float32], "height width"], far: int = 1) -> Bool[NDArray[np.bool_], " n"]:
    """Outline points (n,) beyond which, at the first ``far`` distances, the background's ``level`` is not open: a plate, a needle."""
    offsets = np.concatenate([[0.0], max(edge.reach_px, NEAREST_PX) + ACROSS_PX[:far]])
    least = profiles(level, edge.points_px, outward_normals(edge.points_px), offsets).min(axis=1)
    return np.asarray(least < OPEN_SHARE * np.quantile(level, OPEN_QUANTILE))
