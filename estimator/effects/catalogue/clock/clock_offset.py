"""A further camera whose clock is off: its frames were taken later than stamped, by the first camera's clock, ``t = stamp + offset``.

One camera by itself knows no other clock than its own; of two, the flight that both see says by how much one is late [Caspi and Irani
2002]. Valid for an offset
that is the same in all recordings; one that changes from recording to recording is stated as the uncertainty of a clock (decision 68).
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Setting


class ClockOffset(EffectModel):
    """All frames of one camera later by a constant."""

    entry = EFFECTS["clock_offset"]

    def times(self, theta: Array, setting: Setting, times_s: Array) -> Array:
        """Times moved by the offset."""
        del setting
        return times_s + theta[0]
