"""A camera that shakes: the picture moves with one frequency.

Amplitudes enter linearly, the frequency is searched for on a grid as fine as a recording can resolve; below one period per recording a
vibration is a change of velocity and acceleration and is not looked for.

``shift = s sin(2 pi f t) + c cos(2 pi f t)``, found as a spectral line [Lomb, Astrophys. Space Sci. 39 (1976) 447]. Valid for one
frequency, and for turns of the camera so small that they are shifts of the picture.
"""

import numpy as np

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting

SLOWEST_PERIODS, STEPS_PER_RESOLUTION = 1.5, 3
"""Periods in a recording of the slowest vibration on trial: slower ones are a drift. Frequencies on trial in one over its length."""


class CameraVibration(EffectModel):
    """One frequency, any phase and direction."""

    entry = EFFECTS["camera_vibration"]

    def starts(self, setting: Setting) -> Array:
        """Frequencies from one and a half periods per recording to the largest plausible one."""
        length = float(setting.times_s[-1] - setting.times_s[0])
        largest = min(self.entry.parameters[4].plausible[1], 0.4 / setting.interval_s)
        frequency = np.arange(SLOWEST_PERIODS / length, largest, 1.0 / (STEPS_PER_RESOLUTION * length))
        return np.column_stack([np.zeros((len(frequency), 4)), frequency])

    def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
        """Points with the movement taken off."""
        del camera
        if not theta[:4].any():
            return points_px
        first = np.flatnonzero(np.diff(times_s, prepend=np.nan))  # points of one outline are seen at one time
        moves = self.picture_moves(theta, times_s[first])
        return np.asarray(points_px - np.repeat(moves, np.diff(first, append=len(times_s)), axis=0))

    def picture_moves(self, theta: Array, times_s: Array) -> Array:
        """The movement."""
        phase = 2.0 * np.pi * theta[4] * times_s
        return np.asarray(np.sin(phase)[:, None] * theta[:2] + np.cos(phase)[:, None] * theta[2:4])
