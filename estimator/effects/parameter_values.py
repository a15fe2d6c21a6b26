"""Values of effects' parameters with their error bars, and whether nature produces such values."""

import numpy as np

from datasets.vocabulary.effects import Parameter

Z95 = 1.959964


class WithInterval:
    """What a value of a ``parameter`` with a standard deviation ``sigma`` says of itself."""

    parameter: Parameter
    value: float
    sigma: float

    @property
    def interval(self) -> tuple[float, float]:
        """95% interval."""
        return self.value - Z95 * self.sigma, self.value + Z95 * self.sigma

    @property
    def plausible(self) -> bool:
        """Whether the interval reaches into the plausible range."""
        return is_plausible(self.interval, self.parameter)


IMPOSSIBLE = 30.0
"""Surprise at a value that nature cannot produce, like a negative drag."""


def surprise(interval: tuple[float, float], parameter: Parameter) -> float:
    """How much less is expected of an interval than of the plausible range, minus twice the logarithm.

    A range that ends at zero ends there; any other end is a laboratory's habit, beyond which a density falls as Cauchy's does [Gelman,
    Jakulin, Pittau and Su 2008].
    """
    low, high = parameter.plausible
    if is_plausible(interval, parameter):
        return 0.0
    if (high <= 0.0 < interval[0]) or (low >= 0.0 > interval[1]):
        return IMPOSSIBLE
    nearest = min(interval, key=abs)
    end = high if nearest > 0.0 else -low
    return float(2.0 * np.log(0.5 + 0.5 * (nearest / end) ** 2)) if end > 0.0 else IMPOSSIBLE


def is_plausible(interval: tuple[float, float], parameter: Parameter) -> bool:
    """Whether an interval reaches into what nature or a laboratory is expected to produce."""
    low, high = parameter.plausible
    return bool(interval[1] >= low and interval[0] <= high)
