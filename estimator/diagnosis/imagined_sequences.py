"""Sequences that have not been recorded, of whatever kind: the drops behind them, and what a kind has to do to imagine them.

Only what decides how well parameters could be seen is imagined: which rows or tangencies there would be, and how noisy.
"""

from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera, Intrinsics
from estimator.fitting.campaigns.campaign import SequenceEquations
from estimator.motion.flight import Flight

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Drop:
    """What would be recorded: a flight at the time stamps ``times_s`` (f,) by ``cameras`` (none for a trajectory).

    ``known_start``: the flight's own ``v`` is that at the first frame and known beforehand.
    """

    flight: Flight
    times_s: Array
    cameras: tuple[HsvCamera, ...]
    known_start: bool = False


def lasting(drop: Drop, ratio: float) -> Drop:
    """The drop with ``ratio`` times as many frames."""
    interval = float(np.median(np.diff(drop.times_s)))
    return replace(drop, times_s=about(drop.flight.time_s, round(ratio * len(drop.times_s)), interval))


def about(time_s: float, frames: int, interval_s: float) -> Array:
    """Time stamps (f,) with ``time_s`` in their middle."""
    return np.asarray(time_s + interval_s * (np.arange(frames) - (frames - 1) // 2))


def at_pixel(drop: Drop, place: tuple[float, float] = (0.5, 0.5)) -> Drop:
    """The drop with its reference state at ``place``, in shares of the first picture's width and height, as deep as before.

    Without a place it is the picture's middle; without a camera the drop stays where it is.
    """
    if not drop.cameras:
        return drop
    camera = drop.cameras[0]
    lens = camera.intrinsics
    pixel = np.array([[place[0] * (lens.width_px - 1), place[1] * (lens.height_px - 1)]])
    depth = float((camera.R_cam_world @ drop.flight.x + camera.t_cam_world)[2])
    x_cam = depth * np.append(lens.normalise(pixel)[0], 1.0)
    return replace(drop, flight=replace(drop.flight, x=camera.R_cam_world.T @ (x_cam - camera.t_cam_world)))


class Imagination(Protocol):
    """How sequences of one kind are imagined, in the likeness of a recorded one."""

    @property
    def theta(self) -> Array:
        """Parameters (q,) of the fit's effects in a new sequence."""

    @property
    def camera(self) -> Intrinsics | None:
        """The first camera's lens, where there is one."""

    @property
    def recorded(self) -> Drop:
        """The recorded drop itself."""

    def imagined(self, drop: Drop) -> "Imagined":
        """What a drop would give."""

    def thinned(self, sequence: Any, most: int) -> tuple[Any, float]:
        """A sequence with fewer sightings, and how many each of those stands for."""

    def silent(self, equations: SequenceEquations) -> SequenceEquations:
        """Equations of an imagined sequence, whose errors shall not count where noise is measured."""

    def more_views(self, sequence: Any, particle: Any) -> Any:
        """A sequence with twice the calibrated views of its particle, where a kind has any."""


@dataclass(frozen=True)
class Imagined:
    """A sequence that was not recorded, the drop behind it (perhaps aimed anew), and in how many frames something is seen."""

    drop: Drop
    sequence: Any
    frames: int


def counted(equations: SequenceEquations, times: float) -> SequenceEquations:
    """Equations of sightings that each stand for ``times`` as many with noise of their own."""
    frames = equations.frames
    return replace(
        equations,
        frames=replace(
            frames, H=times * frames.H, g=times * frames.g, weighted=times * frames.weighted, noise=None, known=times * frames.meat
        ),
    )
