"""Quantities as people write them: ``51.3mm±0.3mm``, ``9.81±0.01 m/s2``, ``0 +- 1e-5``, ``±0.2%``."""

import math
import re
from dataclasses import dataclass

UNITS: dict[str, tuple[str, float]] = {
    "": ("1", 1.0),
    "1": ("1", 1.0),
    "%": ("1", 1e-2),
    "ppm": ("1", 1e-6),
    "m": ("m", 1.0),
    "cm": ("m", 1e-2),
    "mm": ("m", 1e-3),
    "um": ("m", 1e-6),
    "µm": ("m", 1e-6),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "µs": ("s", 1e-6),
    "Hz": ("Hz", 1.0),
    "kHz": ("Hz", 1e3),
    "fps": ("Hz", 1.0),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "m/s2": ("m/s2", 1.0),
    "m/s^2": ("m/s2", 1.0),
    "m/s²": ("m/s2", 1.0),
    "rad/s": ("rad/s", 1.0),
    "1/s": ("1/s", 1.0),
    "1/m": ("1/m", 1.0),
    "px": ("px", 1.0),
}
"""What a unit measures, as parameters of effects name it, and its size in that."""
_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_UNIT = r"1/s|1/m|1|[^\d\s+±.-][^\s+±]*"
_QUANTITY = re.compile(rf"(?:({_NUMBER})\s*({_UNIT})?)?\s*(?:(?:±|\+/-|\+-)\s*({_NUMBER})\s*({_UNIT})?)?")


@dataclass(frozen=True)
class Quantity:
    """``value`` and standard deviation ``sigma``, in ``unit`` (one of those that parameters of effects have)."""

    value: float
    sigma: float
    unit: str


def quantity(text: str) -> Quantity:
    """A number with its standard deviation and unit; without a deviation it is exact, without a value it is zero.

    A deviation in per cent of a value that is not in per cent is a share of it. A unit that only one of both has is that of both.

    Raises
    ------
    ValueError
        With what was expected.
    """
    found = _QUANTITY.fullmatch(text.strip().replace("\u03bc", "µ"))  # a Greek mu for the micro sign
    if found is None or not text.strip():
        raise ValueError(f"expected a number with its standard deviation and unit, as in 51.3mm±0.3mm, got {text.strip() or 'nothing'}")
    value, unit, sigma, sigma_unit = found.groups()
    size, of = _size(unit if unit is not None else sigma_unit or "")
    number = float(value or 0.0) * size
    if not math.isfinite(number):
        raise ValueError(f"expected a number that a double holds, got {text.strip()}")
    if sigma is None:
        return Quantity(number, 0.0, of)
    if sigma_unit == "%" and unit not in ("%", None):
        return Quantity(number, _positive(float(sigma), text) * 1e-2 * abs(number), of)
    sigma_size, sigma_of = _size(sigma_unit if sigma_unit is not None else unit or "")
    if sigma_of != of:
        raise ValueError(f"expected one kind of unit for a value and its standard deviation, got {text.strip()}")
    return Quantity(number, _positive(float(sigma), text) * sigma_size, of)


def _positive(sigma: float, text: str) -> float:
    if not 0.0 < sigma < math.inf:
        raise ValueError(f"expected a standard deviation above 0, got {text.strip()}")
    return sigma


def _size(unit: str) -> tuple[float, str]:
    """Size of a unit in that of parameters, and what that is called."""
    if unit not in UNITS:
        raise ValueError(f"expected one of the units {', '.join(dict.fromkeys(u for u in UNITS if u))}, got {unit}")
    of, size = UNITS[unit]
    return size, of
