"""Independent random streams of one sequence, so that a change of one part leaves the others as they were."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Streams:
    """One seed sequence per part of nature; a new part is appended, never inserted."""

    particle: np.random.SeedSequence
    rig: np.random.SeedSequence
    motion: np.random.SeedSequence
    hsv_noise: np.random.SeedSequence
    rig_noise: np.random.SeedSequence
    rendering: np.random.SeedSequence


def streams(seed: int, index: int) -> Streams:
    """The streams of sequence ``index`` of a benchmark with ``seed``."""
    return Streams(*np.random.SeedSequence([seed, index]).spawn(6))
