"""Whether a particle broke at its first impact: pictures after it then fit the particle of the calibrated views worse than those before.

What is left of a particle has another outline, centre of mass and inertia, and a flight of the whole one does not describe it. An impact
that was overlooked after the first one looks the same.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, Status

Array = NDArray[np.float64]
CLEAR_FRAMES = 6
"""Frames next to an impact that do not count when pictures before and after are compared."""
BROKEN_RATIO = 1.5
"""RMS whitened error after the impacts over that before, from which on the particle counts as broken: 0.95 to 1.05 where it is whole,
1.6 to 3.7 where a tenth or a fifth of a corner was lost."""
BROKE = "the particle broke, or touched again unseen"
FITTING_MEAN_SQUARE = 2.0
"""Mean square of the errors over their variance up to which a flight is that of the particle in the calibrated views."""


def worse_after(estimate: Estimate, times_s: Array) -> str | None:
    """What to say of a run whose pictures after the first impact fit the particle worse than those before it.

    ``times_s`` (f,) of the frames.
    """
    frame_s = float(np.median(np.diff(times_s)))
    used = [f for f in estimate.frames if f.used and f.rms_whitened > 0.0]
    away = np.array([(times_s[f.frame] - estimate.impacts[0].time_s) / frame_s for f in used])
    squares = np.array([f.rms_whitened**2 for f in used])
    before, after = squares[away < -CLEAR_FRAMES], squares[away > CLEAR_FRAMES]
    if len(before) == 0 or len(after) == 0:
        return None
    ratio = float(np.sqrt(after.mean() / before.mean()))
    if ratio < BROKEN_RATIO:
        return None
    return f"{BROKE}: its pictures fit {ratio:.2f} times worse after the impact than before it"


def worse_part(before: Estimate, after: Estimate, frame: float) -> str | None:
    """What to say where the flights before and after an impact at ``frame`` were measured apart, and only the first fits the particle."""
    noise, other = (float(part.statistics.get("noise_mean_square", np.inf)) for part in (before, after))
    if before.status is not Status.CONVERGED or noise > FITTING_MEAN_SQUARE:
        return None
    if after.status not in (Status.CONVERGED, Status.NO_CONVERGENCE):
        return None
    if after.status is Status.CONVERGED and other < BROKEN_RATIO**2 * noise:
        return None
    told = f"{np.sqrt(other):.1f} times it" if np.isfinite(other) else "no flight fits"
    fits = f"its pictures fit within {np.sqrt(noise):.1f} times their noise"
    return f"{BROKE}: before the impact at frame {frame:.1f} {fits}, after it {told}"
