"""How well the likeness of neighbouring rows is found: the variance of long means of noise that is made, over the true one.

``python -m scripts.trials.study_alike_noise`` prints a Markdown table: for each kind of noise and each length of flights the mean and the
standard deviation, over campaigns, of ``sigma² repeats`` over its true value, and of ``repeats`` where sigma is stated.
"""

from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from estimator.likelihood.alike_noise import channel_noise

Array = NDArray[np.float64]
Rng = np.random.Generator
CAMPAIGNS = 40
WARM_UP = 100
"""Rows that are thrown away, until a process has forgotten its start."""
LENGTHS: Mapping[str, tuple[int, int, int]] = {"20 of 8 to 29": (20, 8, 30), "10 of 30 to 119": (10, 30, 120), "3 of 20 to 24": (3, 20, 25)}
"""Flights of a campaign, and their rows: from, below."""


def fading(rho: float) -> Callable[[Rng, int], Array]:
    """An autoregressive process of first order and variance 1."""
    return lambda rng, n: np.asarray(lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], rng.normal(size=n + WARM_UP))[WARM_UP:])


def moving_mean(width: int) -> Callable[[Rng, int], Array]:
    """Means of ``width`` rows of white noise, of variance 1."""
    return lambda rng, n: np.convolve(rng.normal(size=n + width - 1), np.ones(width) / np.sqrt(width), "valid")


def blocks(width: int) -> Callable[[Rng, int], Array]:
    """Every value ``width`` times, from anywhere in a block."""
    return lambda rng, n: np.repeat(rng.normal(size=n // width + 2), width)[rng.integers(width) :][:n]


KINDS: Mapping[str, tuple[Callable[[Rng, int], Array], float]] = {
    "white": (fading(0.0), 1.0),
    "AR(1), 0.5": (fading(0.5), 3.0),
    "AR(1), 0.8": (fading(0.8), 9.0),
    "mean of 2": (moving_mean(2), 2.0),
    "mean of 3": (moving_mean(3), 3.0),
    "blocks of 2": (blocks(2), 2.0),
    "blocks of 3": (blocks(3), 3.0),
}
"""Noise of variance 1, and the variance of its long means over that of independent rows."""


def ratios(kind: str, lengths: str) -> Array:
    """Long-run variance found over the true one (c, 2) of campaigns: nothing stated, sigma stated."""
    (draw, true), (flights, low, high), rng = KINDS[kind], LENGTHS[lengths], np.random.default_rng(0)
    found = []
    for _ in range(CAMPAIGNS):
        rows = [draw(rng, int(rng.integers(low, high))) for _ in range(flights)]
        each = [channel_noise(rows, stated=stated) for stated in (False, True)]
        found.append([noise.sigma**2 * noise.repeats / true for noise in each if noise is not None])
    return np.array(found)


def main() -> None:
    """Print the table."""
    print("| noise | flights | nothing stated | sigma stated |\n| --- | --- | --- | --- |")
    for kind in KINDS:
        for lengths in LENGTHS:
            mean, spread = (of(ratios(kind, lengths), axis=0) for of in (np.mean, np.std))
            print(f"| {kind} | {lengths} | {mean[0]:.2f} ± {spread[0]:.2f} | {mean[1]:.2f} ± {spread[1]:.2f} |")


if __name__ == "__main__":
    main()
