"""Frames that leave a pulse as they are read, so that one long recording has a time left."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Frames, Recording
from tumble.progress import write_pulse

EVERY = 20
"""Pictures between two pulses: at most a second or two of work."""


@dataclass
class Pulse:
    """The share that is done: ``count`` of ``total`` pictures read, written to ``path`` now and then."""

    path: Path
    total: int
    count: int = field(default=0)

    def beat(self) -> None:
        """One picture more."""
        self.count += 1
        if self.count % EVERY == 0:
            write_pulse(self.path, min(self.count, self.total), self.total)


@dataclass(frozen=True)
class Pulsed:
    """Frames whose reading is counted; implements :class:`datasets.observation.Frames`."""

    frames: Frames
    pulse: Pulse

    @property
    def bit_depth(self) -> int:
        """That of the frames."""
        return self.frames.bit_depth

    def __len__(self) -> int:
        return len(self.frames)

    def read(self, index: int) -> NDArray[np.uint16]:
        """Picture ``index``, (height, width) DN."""
        self.pulse.beat()
        return self.frames.read(index)

    def background(self) -> NDArray[np.uint16] | None:
        """That of the frames."""
        return self.frames.background()

    def background_of(self, index: int) -> NDArray[np.uint16] | None:
        """That of the frames."""
        return self.frames.background_of(index)


def pulsed(recording: Recording, pulse: Pulse) -> Recording:
    """Frames that are counted; outlines as they are."""
    return Pulsed(recording, pulse) if isinstance(recording, Frames) else recording
