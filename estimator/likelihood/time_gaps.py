"""A jump of the particle between two frames, as when the recorder lost some in between and its time stamps do not say so.

A gap of k frames moves everything after it by k steps along the flight. A joint fit cannot follow, and of the wrong flights that remain the
one that fits best may spin several times too fast; the stretch on one side of the jump fits by itself.
"""

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Array = NDArray[np.float64]
AROUND = 6
"""Steps to either side that say what a step is like there."""
LEAST_SHARE, LEAST_PX, LEAST_MADS, LEAST_ALONG = 0.5, 1.0, 8.0, 0.9
"""A jump is longer than half a step more, a pixel and eight typical departures, and goes along the flight."""
LEAST_STEPS = 8
"""Steps below which no jump is looked for."""


def longest_stretch(centres_px: Float[NDArray[np.float64], "n 2"], times_s: Float[NDArray[np.float64], " n"]) -> slice:
    """The rows on the longer side of the jump of a particle seen at ``centres_px`` at ascending times; all of them where it has none."""
    after = _jump_after(centres_px, times_s)
    if after is None:
        return slice(0, len(times_s))
    return slice(0, after + 1) if after + 1 >= len(times_s) - after - 1 else slice(after + 1, len(times_s))


def _jump_after(centres_px: Array, times_s: Array) -> int | None:
    """The row after which the particle jumps."""
    if len(times_s) < LEAST_STEPS + 1:
        return None
    duration = np.diff(times_s)
    steps = np.diff(centres_px, axis=0) * (np.median(duration) / duration)[:, None]
    usual = np.array([_usual(steps, i) for i in range(len(steps))])
    excess = steps - usual
    size = np.linalg.norm(excess, axis=1)
    i = int(np.argmax(size))
    length = float(np.linalg.norm(usual[i]))
    far = size[i] > max(LEAST_SHARE * length, LEAST_PX, LEAST_MADS * float(np.median(size)))
    along = float(excess[i] @ usual[i]) > LEAST_ALONG * size[i] * length
    return i if far and along else None


def _usual(steps: Array, i: int) -> Array:
    around = [k for k in range(max(0, i - AROUND), min(len(steps), i + AROUND + 1)) if k != i]
    return np.asarray(np.median(steps[around], axis=0))
