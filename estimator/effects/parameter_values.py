"""Values of effects' parameters with their error bars, and whether nature produces such values."""

from datasets.vocabulary.effects import Parameter

Z95 = 1.959964
"""Standard deviations that hold 95% of a normal density."""


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


def is_plausible(interval: tuple[float, float], parameter: Parameter) -> bool:
    """Whether an interval reaches into what nature or a laboratory is expected to produce."""
    low, high = parameter.plausible
    return bool(interval[1] >= low and interval[0] <= high)
