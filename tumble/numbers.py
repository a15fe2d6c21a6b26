"""Numbers for people: a value is written as finely as its uncertainty deserves."""

import math


def decimals(sigma: float) -> int:
    """Digits after the point that show ``sigma`` with two significant digits; at most 9."""
    if not math.isfinite(sigma) or sigma <= 0:
        return 4
    return min(max(1 - math.floor(math.log10(sigma)), 0), 9)


def rounded(value: float, sigma: float) -> str:
    """``value`` with as many digits as ``sigma`` deserves."""
    return f"{value:.{decimals(sigma)}f}" if math.isfinite(value) else "unknown"


def compact(value: float, sigma: float) -> str:
    """``value ± sigma``, in powers of ten where that is shorter; ``value`` alone where it has no uncertainty (it was searched for)."""
    if sigma == 0:
        return f"{value:.6g}"
    if not (math.isfinite(sigma) and 0 < sigma < 1e-3):
        return with_sigma(value, sigma)
    power = math.floor(math.log10(max(abs(value), sigma)))
    return f"({with_sigma(value / 10.0**power, sigma / 10.0**power)})e{power:+03d}"


def with_sigma(value: float, sigma: float) -> str:
    """``value ± sigma``; ``± unknown`` where there is no finite uncertainty."""
    spread = f"{sigma:.{decimals(sigma)}f}" if math.isfinite(sigma) else "unknown"
    return f"{rounded(value, sigma)} ± {spread}"
