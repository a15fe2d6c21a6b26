"""A frame rate other than the nominal one: ``t = t_nominal / (1 + r)``, counted from the first frame.

Without a known force it is degenerate with v and omega, which scale with it; gravity, whose 0.5 g t² does not, breaks that.

Valid for a steady clock; scales of time and length as in [Landau and Lifshitz, Mechanics (1976), § 10].
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting


class FrameRate(EffectModel):
    """The clock runs fast or slow by a constant factor."""

    entry = EFFECTS["frame_rate"]

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """Times stretched about the first frame."""
        first = setting.times_s[0]
        return first + (times_s - first) / (1.0 + theta[0])
