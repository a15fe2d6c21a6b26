"""What a user asked of ``tumble import``, and the values of the observation with where each is from."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from pathlib import Path

from datasets.errors import InputError
from datasets.video import Moment, Origin

UNITS_S = {"": 0, "s": 0, "ms": -3, "us": -6, "µs": -6, "ns": -9}
UNITS_HZ = {"": 0, "Hz": 0, "fps": 0, "kHz": 3, "MHz": 6}
PARTS = {"": 0, "%": -2}
"""Units and their powers of ten."""


@dataclass(frozen=True)
class Request:
    """The options of ``tumble import``; ``None`` and empty: not given.

    ``frames``: first picture and the one after the last, counted from 0 in the file. ``background``: ``auto``, ``first:N`` or a file.
    ``cameras``: calibrations, one for all videos or one for each. ``gravity``: ``down``, three numbers or a file. ``masks``: the videos
    are masks of the particle. ``clock_sigma_s``: standard deviation of what the stamps of further cameras are off those of the first;
    ``length_sigma``, relative: that of the lengths of the particle's views; ``focal_sigma``, relative: that of the cameras' focal lengths.
    """

    frames: tuple[int | None, int | None] = (None, None)
    background: str = "auto"
    cameras: tuple[Path, ...] = ()
    particle: Path | None = None
    gravity: str | None = None
    rate_hz: float | None = None
    exposure_s: float | None = None
    bits: int | None = None
    stamped: Moment | None = None
    masks: bool = False
    clock_sigma_s: float = 0.0
    length_sigma: float | None = None
    focal_sigma: float | None = None


@dataclass(frozen=True)
class Value:
    """One value of a recording as text for people (``shown``) and as a TOML value (``plain``), and where it is from."""

    name: str
    shown: str
    plain: bool | int | float | str | list[float]
    origin: Origin
    note: str = ""


@dataclass(frozen=True)
class Missing:
    """A value that nobody has stated: ``why`` it is needed, and ``what_to_type``."""

    name: str
    why: str
    what_to_type: str


def frame_range(text: str) -> tuple[int | None, int | None]:
    """``120:340``, ``120:`` or ``:340`` as the first picture and the one after the last.

    Raises
    ------
    InputError
        Where it is none of these.
    """
    found = re.fullmatch(r"([0-9]{0,9}):([0-9]{0,9})", text)
    if found is None or (found[1] and found[2] and int(found[1]) >= int(found[2])):
        raise InputError(f"--frames {text}: expected FIRST:END (END is not taken any more), as in 120:340, 120: or :340, counted from 0.")
    return (int(found[1]) if found[1] else None, int(found[2]) if found[2] else None)


def quantity(option: str, text: str, units: Mapping[str, int]) -> float:
    """A number with one of ``units`` (SI where it has none), not negative.

    Raises
    ------
    InputError
        Naming the option.
    """
    found = re.fullmatch(r"\s*([0-9.]+(?:[eE][+-]?[0-9]+)?)\s*([A-Za-zµ%]*)\s*", text)
    try:
        return float(Decimal(found[1]).scaleb(units[found[2]]))  # type: ignore[index]
    except (TypeError, ArithmeticError, KeyError):
        raise InputError(f"{option} {text}: expected a number with {', '.join(unit for unit in units if unit)} or no unit.") from None
