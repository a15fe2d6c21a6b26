"""Motion of rigid bodies, integrated to rounding level, and random flights that stay in the picture."""

from synth.motion.free_flight import FreeFlight, Start, fly
from synth.motion.pushed_flight import PushedFlight, fly_pushed
from synth.motion.random_flight import random_start

__all__ = ["FreeFlight", "PushedFlight", "Start", "fly", "fly_pushed", "random_start"]
