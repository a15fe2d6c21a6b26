"""What the test of a fit's residuals says to a person, and what of it is kept in the estimate."""

from typing import Any

import numpy as np

from estimator.fitting.adequacy import Misfit
from estimator.motion.slow_errors import AXES

LEAST_P, PLAIN_P = 1e-16, 1e-3
"""Below which a p-value is told as below it: rounding; and from which on it is written without a power of ten."""


def p_value(p: float) -> str:
    """A p-value as people write it, as a bound where it is smaller than an approximation can know."""
    if p <= LEAST_P:
        return f"< {LEAST_P:.0e}"
    return f"{p:.2g}" if p >= PLAIN_P else f"{p:.1e}"


def p_words(p: float) -> str:
    """The same in a sentence."""
    return f"p {p_value(p)}" if p <= LEAST_P else f"p = {p_value(p)}"


def adequacy_statistics(tested: Misfit | None) -> dict[str, Any]:
    """What is kept of the test; nothing where there was none."""
    if tested is None:
        return {}
    return {
        "adequacy": {
            "adequate": tested.adequate,
            "p": tested.p,
            "statistic": tested.statistic,
            "freedom": tested.freedom,
            "component": AXES[tested.component],
            "after_impacts": tested.segment,
            "component_rms": tested.size,
            "component_p": tested.component_p,
            "noise_ratio": tested.noise_ratio,
            **(_shifts(tested) if tested.slowly_off else {}),
        }
    }


def misfit_sentence(tested: Misfit) -> str:
    """Converged, but: what says that the residuals are not noise."""
    return f"converged, but {_missed(tested)}"


def misfit_remark(tested: Misfit) -> str:
    """The same beside what else is said; nothing where the residuals are noise."""
    return "" if tested.adequate else f"T{_missed(tested)[1:]}"


def _shifts(tested: Misfit) -> dict[str, list[float]]:
    v, omega = np.split(tested.velocity_shift, 2)
    return {"velocity_shift_ms": v.tolist(), "angular_velocity_shift_rads": omega.tolist()}


def _missed(tested: Misfit) -> str:
    if not tested.slowly_off:
        return (
            f"the model misses something: the residuals are {tested.noise_ratio:.1f} times the noise that the outlines show, "
            "new in every frame. The uncertainties contain that as noise."
        )
    size = f"{np.degrees(tested.size):.2g}°" if tested.component >= len(AXES) // 2 else f"{1e3 * tested.size:.2g} mm"
    v, omega = (float(np.linalg.norm(part)) for part in np.split(tested.velocity_shift, 2))
    where = f" after impact {tested.segment}" if tested.segment else ""
    return (
        f"the model misses something ({p_words(tested.p)}): the residuals are not noise; most of all the "
        f"{AXES[tested.component]} is off by {size} RMS{where} in a way that changes slowly with time. "
        f"What that moves the velocities by ({v:.2g} m/s, {omega:.2g} rad/s) is in their uncertainties; its cause may move them by more."
    )
