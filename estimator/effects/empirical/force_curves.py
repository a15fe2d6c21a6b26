"""A force and a torque of each sequence's own, over time: what is fitted to see the shape of something that no effect of the catalogue is.

``dv/dt = g + sum a_j P_j(t)`` and ``dL/dt = sum m_j P_j(t)``, world axes, P_j the Legendre polynomials of the time within the sequence. Ten
of each follow a force that is fixed to a body through one and a half turns. A prior holds coefficient j within ``LARGEST / (1 + j)``:
curves without evidence are small and smooth [Wahba, Spline Models for Observational Data (1990), ch. 1], so the fit is well posed. Its
size is several times what any force of the catalogue does, and is no information where the data have some.
"""

import numpy as np
from numpy.polynomial import legendre

from datasets.vocabulary.effects import EffectEntry, Scope, Stage
from estimator.effects.empirical.families import REFERENCE, SmoothForce, SmoothTorque, curves, phase
from estimator.effects.link import Array, Setting

DEGREES = range(10)
LARGEST_MS2, LARGEST_RADS2 = 30.0, 3000.0


def _held(largest: float) -> tuple[float, ...]:
    return tuple(largest / (1.0 + j) for j in DEGREES for _ in "xyz")


class ForceCurve(SmoothForce):
    """A force of its own in every sequence."""

    held: tuple[float, ...] | None = _held(LARGEST_MS2)
    entry = EffectEntry(
        "force_curve", Stage.DYNAMICS, Scope.SEQUENCE, curves("a", "m/s2", DEGREES, 1e-2), "dv/dt = g + sum a_j P_j(t)", REFERENCE
    )


class TorqueCurve(SmoothTorque):
    """A torque of its own in every sequence, per largest moment."""

    held: tuple[float, ...] | None = _held(LARGEST_RADS2)
    entry = EffectEntry(
        "torque_curve", Stage.DYNAMICS, Scope.SEQUENCE, curves("m", "rad/s2", DEGREES, 10.0), "dL/dt = sum m_j P_j(t)", REFERENCE
    )


class FreeForceCurve(ForceCurve):
    """The same without the prior, for scores."""

    held = None


class FreeTorqueCurve(TorqueCurve):
    """The same without the prior, for scores."""

    held = None


class StandingForceCurve(FreeForceCurve):
    """A curve that a fit leaves as it is."""

    frozen = ForceCurve.entry.names


class StandingTorqueCurve(FreeTorqueCurve):
    """A curve that a fit leaves as it is."""

    frozen = TorqueCurve.entry.names


def basis(times_s: Array, setting: Setting) -> Array:
    """Polynomials (n, 10) at times (n,) s since the first frame."""
    return np.asarray(legendre.legvander(phase(times_s, setting), DEGREES[-1]))
