"""Velocities of a report: each component with its interval, and beside it the truth where it is known."""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import VelocityEstimate
from datasets.truth import Truth
from tumble.numbers import rounded, with_sigma

Array = NDArray[np.float64]
LABELS = ("v x", "v y", "v z", "ω x", "ω y", "ω z")
UNITS = ("m/s",) * 3 + ("rad/s",) * 3
Z95 = 1.959964


def rows(velocity: VelocityEstimate, truth: Truth | None) -> list[dict[str, Any]]:
    """Six components, then speed and spin, beside the truth at that time."""
    return rows_beside(velocity, true_velocities(truth, velocity.time_s) if truth is not None else None)


def rows_beside(velocity: VelocityEstimate, true: Array | None) -> list[dict[str, Any]]:
    """Six components, then speed and spin, beside ``true`` (6,)."""
    values = np.concatenate([velocity.v_world, velocity.omega_world])
    sigma = np.sqrt(np.maximum(np.diag(velocity.covariance), 0.0))
    table = [_row(LABELS[k], UNITS[k], values[k], sigma[k], None if true is None else float(true[k])) for k in range(6)]
    for label, unit, part in (("speed", "m/s", slice(0, 3)), ("spin", "rad/s", slice(3, 6))):
        size, spread = _length(values[part], velocity.covariance[part, part])
        table.append(_row(label, unit, size, spread, None if true is None else float(np.linalg.norm(true[part]))))
    return table


def true_velocities(truth: Truth, time_s: float) -> Array:
    """True (v, ω) (6,) at ``time_s``, linear between frames."""
    columns = np.hstack([truth.motion.v_world, truth.motion.omega_world]).T
    return np.array([np.interp(time_s, truth.motion.times_s, column) for column in columns])


def _length(vector: Array, covariance: Array) -> tuple[float, float]:
    size = float(np.linalg.norm(vector))
    along = vector / size if size > 0 else np.zeros(3)
    return size, math.sqrt(max(float(along @ covariance @ along), 0.0))


def _signed(pull: float) -> str:
    """One digit with its sign; what rounds to nothing has none."""
    text = f"{pull:+.1f}"
    return "0.0" if text in {"+0.0", "-0.0"} else text


def _row(label: str, unit: str, value: float, sigma: float, true: float | None) -> dict[str, Any]:
    if not math.isfinite(value):
        nothing = {"value": None, "sigma": None, "true": true, "text": "not measured", "interval": "", "pull": "", "covered": None}
        return {"label": label, "unit": unit, **nothing, "true_text": "" if true is None else f"{true:.4g}"}
    low, high = value - Z95 * sigma, value + Z95 * sigma
    known = true is not None and sigma > 0
    return {
        "label": label,
        "unit": unit,
        "value": float(value),
        "sigma": float(sigma),
        "true": true,
        "text": with_sigma(value, sigma),
        "interval": f"{rounded(low, sigma)} to {rounded(high, sigma)}",
        "true_text": "" if true is None else rounded(true, sigma),
        "pull": _signed((value - true) / sigma) if known and true is not None else "",
        "covered": bool(low <= true <= high) if true is not None else None,
    }
