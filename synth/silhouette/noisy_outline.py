"""An outline as a camera with a stated boundary noise would deliver it: the silhouette tier.

The exact outline is sampled at equal steps of arc length, and every sample is displaced along the outline's outward normal by
its own draw from N(0, sigma²): white boundary noise, the setting of the paper's simulations. Sampling does not keep corners, as
a camera does not either; a corner is cut by at most half a step.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.outline import Outline

Array = NDArray[np.float64]


def noisy_outline(exact: Float[NDArray[np.float64], "n 2"], *, spacing_px: float, sigma_px: float, rng: np.random.Generator) -> Outline:
    """Sample ``exact`` (px, positive area) about every ``spacing_px`` and displace each sample along its normal by N(0, ``sigma_px``²).

    The first sample lies at a random place of the outline.
    """
    samples, normals = samples_with_normals(exact, spacing_px=spacing_px, phase=rng.random())
    return Outline(samples + normals * rng.normal(0.0, sigma_px, size=(len(samples), 1)))


def samples_with_normals(
    exact: Float[NDArray[np.float64], "n 2"], *, spacing_px: float, phase: float
) -> tuple[Float[NDArray[np.float64], "m 2"], Float[NDArray[np.float64], "m 2"]]:
    """Points at equal steps along ``exact``, the first at ``phase`` of a step, and unit outward normals.

    A normal is that of the chord between the two neighbouring samples, so it belongs to the scale of the sampling
    and not to single facets of the mesh.
    """
    closed = np.vstack([exact, exact[:1]])
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(closed, axis=0), axis=1))])
    count = max(8, round(travelled[-1] / spacing_px))
    stops = (np.arange(count) + phase) * travelled[-1] / count
    samples = np.column_stack([np.interp(stops, travelled, closed[:, 0]), np.interp(stops, travelled, closed[:, 1])])
    chord = np.roll(samples, -1, axis=0) - np.roll(samples, 1, axis=0)
    normals = np.column_stack([chord[:, 1], -chord[:, 0]])
    return samples, normals / np.linalg.norm(normals, axis=1, keepdims=True)
