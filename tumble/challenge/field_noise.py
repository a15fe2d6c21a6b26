"""Noise as the field has it: heavy tails, alike over a few rows or frames, and a few that are far off."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
TAIL = 3
"""Degrees of freedom of Student's t, of which half of the noise is; the other half is Gaussian."""
FAR_OFF = (5.0, 20.0)
"""How many standard deviations an outlier is off."""


def heavy_tailed(rng: np.random.Generator, n: int, width: int, repeats: int) -> Array:
    """Noise (n, width) of standard deviation one with heavy tails, alike over ``repeats`` rows."""
    shape = (n + repeats - 1, width)
    tailed = rng.standard_t(TAIL, size=shape) / np.sqrt(TAIL / (TAIL - 2.0))
    drawn = np.where(rng.random(shape) < 0.5, tailed, rng.normal(size=shape))
    return np.asarray(sum(drawn[k : k + n] for k in range(repeats)) / np.sqrt(repeats))


def far_off(rng: np.random.Generator, far: NDArray[np.bool_], width: int) -> Array:
    """What is added (n, width) to rows that are ``far`` off, in standard deviations; zero elsewhere."""
    direction = rng.normal(size=(len(far), width))
    direction *= rng.uniform(*FAR_OFF, size=(len(far), 1)) / np.linalg.norm(direction, axis=1, keepdims=True)
    return np.asarray(far[:, None] * direction)
