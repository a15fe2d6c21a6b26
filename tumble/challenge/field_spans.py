"""Ranges that trajectories and silhouettes of the field share."""

import numpy as np

ROUNDED_FROM_S = 4e-3
"""Time stamps are rounded to 1 ms where rows or frames are at least as far apart."""


def log_uniform(span: tuple[float, float], rng: np.random.Generator) -> float:
    """A number that is log-uniform over a span."""
    return float(np.exp(rng.uniform(*np.log(span))))
