"""Frames that are missing though the time stamps do not show it: frames after ``after_frame`` are ``count`` intervals later.

The number of missing frames is fitted as a real number; that it comes out whole is a check, less than one is none, and the whole number is
reported. The place of the gap is searched for.

``t_true = t + count / rate`` after the gap, found as a change point [Page, Biometrika 41 (1954) 100]. Valid for one gap per sequence
and a steady nominal rate.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting

MARGIN = 3
"""Frames at either end after which no gap is looked for: it would shift no more than these."""


class DroppedFrames(EffectModel):
    """A gap in the recording."""

    entry = EFFECTS["dropped_frames"]
    frozen = ("after_frame",)
    whole = ("count",)

    def starts(self, setting: Setting) -> Array:
        """A gap after every frame but the outermost, which shift only a frame or two."""
        after = np.arange(MARGIN - 1, len(setting.times_s) - MARGIN)
        return np.column_stack([np.zeros(len(after)), after])

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """Times moved on after the gap."""
        gap = setting.times_s[0] + (theta[1] + 0.5) * setting.interval_s
        return times_s + theta[0] * setting.interval_s * (times_s > gap)
