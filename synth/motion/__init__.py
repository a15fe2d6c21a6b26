"""Motion of rigid bodies, integrated to rounding level, and random flights that stay in the picture."""

from synth.motion.free_flight import FreeFlight, Start, fly
from synth.motion.random_flight import random_start

__all__ = ["FreeFlight", "Start", "fly", "random_start"]
