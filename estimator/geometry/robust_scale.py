"""The standard deviation of normal errors about zero, from the median of their sizes, which few wrong ones do not change."""

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

MEDIAN = float(ndtri(0.75))
"""Median size of a standard normal number [Hampel 1974]."""


def robust_sigma(errors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Of every column of ``errors`` (n, ...): an array (...)."""
    return np.asarray(np.median(np.abs(errors), axis=0) / MEDIAN)
