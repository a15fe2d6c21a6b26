"""What a calibration says of lengths and of gravity, as facts of a campaign: rows beside those of the data, considered where not fitted."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Observation
from estimator.fitting.campaigns.facts import Fact, length_fact

EXACT = 1e-3
"""Standard deviation, in that of the most uncertain direction of gravity, of a direction that is stated as exact."""


def stated_facts(observations: Sequence[Observation]) -> tuple[Fact, ...]:
    """Of the views' lengths and of gravity; where recordings are stated differently, the most uncertain counts."""
    lengths = [each.sigma_length_scale for each in observations if each.sigma_length_scale is not None]
    pulls = [each.gravity_covariance for each in observations if each.gravity_covariance is not None and each.gravity_covariance.any()]
    found = [length_fact(max(lengths))] if lengths else []
    return (*found, *(_of_gravity(max(pulls, key=np.trace)) if pulls else ()))


def _of_gravity(covariance: NDArray[np.float64]) -> list[Fact]:
    """Along the axes of a covariance (3, 3) m²/s⁴."""
    variances, axes = np.linalg.eigh(covariance)
    sigmas = np.sqrt(np.maximum(variances, EXACT**2 * variances[-1]))
    words = "gravity is off by 0 ± {:.2g} m/s2 along ({:.3f}, {:.3f}, {:.3f})"
    return [
        Fact(words.format(sigma, *(np.round(axis, 3) + 0.0)), (("gravity", tuple(axis.tolist())),), 0.0, float(sigma))
        for axis, sigma in zip(axes.T, sigmas, strict=True)
    ]
