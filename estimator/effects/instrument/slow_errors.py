"""Slow errors of a tracker: positions that wander within a flight beside the noise from row to row, differently in every flight.

``x + curves a``: an integrated Wiener process, whose most probable path through rows is a smoothing spline [Wahba 1978]. Its curves are
those of Karhunen and Loève, beside what a flight's start takes. Not an effect that is asked for but noise of the instrument, in the model
where a campaign's residuals show it: a force of every flight's own is smoother, what flights share is alike in them. Valid for errors that
are small against the path.
"""

import numpy as np

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.instrument.surface_amplitudes import STEP, WIDEST
from estimator.effects.link import Array, EffectModel, Setting

CURVES = 6
"""Of the process: the next one is less than a hundredth of the first."""


def curves(times_s: Array) -> Array:
    """The curves (n, ``CURVES``) s^1.5 at ``times_s`` (n,) s, each as large as a standard deviation of the process of one m/s^1.5."""
    span = float(np.ptp(times_s))
    turns = np.pi * (np.arange(CURVES) + 0.5)
    return np.asarray(np.sqrt(2.0) * span**1.5 / turns**2 * np.cos(np.outer((times_s - times_s[0]) / max(span, 1e-300), turns)))


class SlowErrors(EffectModel):
    """Amplitudes of curves along each axis, over their standard deviations; ``size`` (3,) m/s^1.5 of the process along them."""

    instrument = True

    def __init__(self, size: Array) -> None:
        self.size = size
        names = [f"{axis}_{k}" for axis in "xyz" for k in range(CURVES)]
        self.held: tuple[float, ...] = (1.0,) * len(names)
        self.entry = EffectEntry(
            "slow_errors",
            Stage.TRACKING,
            Scope.SEQUENCE,
            tuple(Parameter(name, "1", (-WIDEST, WIDEST), STEP, "amplitude of a slow error of positions") for name in names),
            "position = true one + integrated Wiener process, another one in every flight",
            "Wahba, J. R. Stat. Soc. B 40 (1978) 364",
        )

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        """Positions (n, 3) m with the curves."""
        return np.asarray(x + self.size * (curves(setting.times_s) @ theta.reshape(3, CURVES).T))

    def tracked_by(self, theta: Array, x: Array, setting: Setting) -> Array:
        """The curves themselves (n, 3, q) m."""
        del theta, x
        made = np.einsum("a,ab,nk->nabk", self.size, np.eye(3), curves(setting.times_s))
        return np.asarray(made.reshape(len(made), 3, -1))
