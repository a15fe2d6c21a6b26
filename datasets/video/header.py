"""What a recording's file says of itself, each value with where it is from."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Generic, Protocol, TypeVar

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.vocabulary.camera import LARGEST_PICTURE_PX, LARGEST_SIDE_PX

Array = NDArray[np.float64]
Picture = NDArray[np.uint16]
T_co = TypeVar("T_co", covariant=True)
MOST_FRAMES = 10**6
"""Pictures of a recording at most, as in a recipe."""


UNKNOWN_DEPTH = "stored in 16 bit; how many carry signal is not said"


class Origin(StrEnum):
    """Where a value is from: the file, the command line, or an assumption that is named."""

    READ = "read"
    GIVEN = "given"
    ASSUMED = "assumed"


class Moment(StrEnum):
    """Which moment of an exposure a time stamp names."""

    START = "start"
    MIDDLE = "middle"


@dataclass(frozen=True)
class Stated(Generic[T_co]):
    """A ``value``, where it is from (``origin``), and a ``note``: where in the file, or why it is assumed."""

    value: T_co
    origin: Origin
    note: str = ""


@dataclass(frozen=True)
class Header:
    """A recording of ``count`` pictures of ``width_px`` x ``height_px``; what a file does not say is ``None``.

    ``rate_hz``: pictures per second as stored. ``exposure_s``: of each picture (s). ``stamps_s`` (count,) s: a time stamp of each picture,
    from the trigger where that is known; without them pictures are evenly spaced by the rate, ``first`` being the number of the first one
    (the trigger's is 0). ``stamped``: which moment of an exposure stamps name. ``bit_depth``: bits that carry signal.
    ``lossy``: what compression took, in words; empty where nothing was lost. ``playback_hz``: at which a film is played, which says
    nothing of the camera. ``remark``: what is odd about the file, in words.
    """

    kind: str
    width_px: int
    height_px: int
    count: int
    bit_depth: Stated[int]
    rate_hz: Stated[float] | None = None
    exposure_s: Stated[float] | None = None
    stamps_s: Stated[Array] | None = None
    stamped: Stated[Moment] = Stated(Moment.MIDDLE, Origin.ASSUMED, "no stamps: pictures are counted, so it shifts all times alike")
    first: int = 0
    trigger: Stated[str] | None = None
    lossy: str = ""
    playback_hz: float | None = None
    remark: str = ""

    def stamps(self, rate_hz: float) -> Float[NDArray[np.float64], " frame"]:
        """Time stamps (s) of all pictures; evenly spaced by ``rate_hz`` where the file has none."""
        if self.stamps_s is not None:
            return self.stamps_s.value
        return (self.first + np.arange(self.count)) / rate_hz


class Video(Protocol):
    """A recording's pictures, read one at a time."""

    @property
    def path(self) -> Path:
        """The file or folder."""
        ...

    @property
    def header(self) -> Header:
        """What the file says of itself."""
        ...

    def read(self, index: int) -> Picture:
        """Picture ``index`` (height, width) in the sensor's numbers (DN), rows from the top.

        Raises
        ------
        InputError
            Naming the file and the frame where it is damaged.
        """
        ...


def check_size(path: Path, width_px: int, height_px: int, count: int) -> None:
    """Refuse sizes that no recording has, before memory is taken.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    sides = (width_px, height_px)
    if not 0 < min(sides) <= max(sides) <= LARGEST_SIDE_PX or width_px * height_px > LARGEST_PICTURE_PX:
        raise InputError(
            f"{path}: expected pictures of 1 to {LARGEST_SIDE_PX} px along each side and at most {LARGEST_PICTURE_PX:.0e} px, "
            f"got {width_px} x {height_px}."
        )
    if not 0 < count <= MOST_FRAMES:
        raise InputError(f"{path}: expected 1 to {MOST_FRAMES} pictures, got {count}.")


def read_rate(path: Path, rate_hz: float) -> float:
    """``rate_hz`` where a high-speed camera can have it.

    Raises
    ------
    InputError
        Naming the file.
    """
    if not SLOWEST_HZ <= rate_hz <= FASTEST_HZ:
        raise InputError(f"{path}: frame rate: expected {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz, got {rate_hz:g}.")
    return rate_hz


def read_positive(path: Path, name: str, value: float, unit: str, most: float) -> float:
    """``value`` where it can be one (positive, at most ``most``); an error that names the file otherwise.

    Raises
    ------
    InputError
        Naming the file and ``name``.
    """
    if not 0.0 < value <= most:
        raise InputError(f"{path}: {name}: expected more than 0 and at most {most:g} {unit}, got {value:g}.")
    return value


SLOWEST_HZ, FASTEST_HZ, LONGEST_S = 1.0, 1e8, 1.0
"""Rates and exposures beyond these are no high-speed camera's; those of a recipe and of an observation."""
