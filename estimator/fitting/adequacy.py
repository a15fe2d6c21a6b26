"""Do the residuals of a fitted flight look like noise? A score test of a slow error of the poses, with a calibrated p-value.

What a free flight lacks (a force, a torque, a wrong clock, a wrong axis of the picture) moves the fitted poses away from the outlines
slowly; an outline's noise is drawn anew in every frame. So the flight is given more freedom: a translation (world axes) and a rotation that
are polynomials of time of the orders 2, 3 and 4 along every axis, ``S' = [S, P_j(t) E_a]``; orders 0 and 1 are the flight's own. One step
from the refined flight gives their coefficients ``b`` and, by the sandwich formula that gives the error bars, their covariance ``C``: own
noise of the outlines, noise of the calibrated views and the body-fixed error, which both come back from frame to frame and are not misfit.
``bᵀ C⁻¹ b`` is compared with chi² of 18 degrees of freedom [Rao 1948; White 1982].

Blind to what changes from frame to frame (jitter of the clock, vibration): that raises the noise itself, which :class:`Misfit` tells as
``noise_ratio``, the residuals' standard deviation over the one that the outlines' neighbouring samples let expect.
"""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray
from scipy.special import chdtrc

from estimator.fitting.problem import alone, prior_of, with_more
from estimator.fitting.refinement import Refined, sandwich
from estimator.fitting.stable_inverse import NothingSeen, scaled_inverse
from estimator.fitting.weighed_tangencies import linearise
from estimator.likelihood.rows import noise_scales
from estimator.motion.flight import OMEGA, THETA, Motion, V, X

Array = NDArray[np.float64]
ORDERS = (2, 3, 4)
"""Degrees of the polynomials in time on which a flight's residuals are tested: 0 and 1 are taken up by the flight itself."""
AXES = ("path along x", "path along y", "path along z", "rotation about x", "rotation about y", "rotation about z")
PATH, ROTATION = range(3), range(3, 6)
"""Which of the axes are of the path, which of the rotation."""
INADEQUATE_P = 1e-3
"""Below it the residuals are said not to be noise; the rate of false alarms at this level is in docs/studies/wrong_poses.md."""
NOISY = 3.0
"""Residuals so many times the standard deviation that outlines let expect are said to be too large: 0.7 to 1.4 where nothing is missing."""


@dataclass(frozen=True)
class Misfit:
    """``p`` of residuals that are as far from noise, from ``statistic`` with ``freedom`` degrees of freedom.

    ``component``: index into :data:`AXES` of the slow error that shows most, ``size`` its RMS over the sequence (m or rad) and
    ``component_p`` its own p-value. ``noise_ratio``: standard deviation of the residuals over the expected one. ``scales`` (2, 3, 3),
    world axes, any unit: see :func:`slow_scales`; ``moved`` (p,): by what the flight's parameters change where slow errors are allowed.
    """

    p: float
    statistic: float
    freedom: int
    component: int
    size: float
    component_p: float
    noise_ratio: float
    scales: Array
    moved: Array

    @property
    def adequate(self) -> bool:
        """Whether the residuals look like noise."""
        return self.p >= INADEQUATE_P and self.noise_ratio <= NOISY


def misfit(refined: Refined[Motion]) -> Misfit | None:
    """The test of a refined motion; ``None`` where the sightings do not determine the slow errors."""
    basis, task, motion = slow_errors(refined.sightings.times_s), refined.at.task, refined.flight
    at, own = linearise(task, motion, refined.at.settings, basis), motion.layout.size
    try:
        system = with_more(at, prior_of(alone(task, motion), motion))
        step, C = system.solved().step, sandwich(system)[own:, own:]
    except NothingSeen:
        return None
    return misfit_of(step, C, basis, float(np.sqrt(refined.noise.mean_square)))


def misfit_of(step: Array, C: Array, basis: Array, noise_ratio: float) -> Misfit | None:
    """The test of :func:`slow_errors` ``basis`` (n, 6, 18).

    ``step`` (p + 18,): of the motion's parameters and of the coefficients, which have a covariance ``C`` (18, 18).
    ``None`` where the sightings do not determine them.
    """
    moved, b = np.split(step, [-basis.shape[2]])
    try:
        statistic = float(b @ scaled_inverse(C) @ b)
        each = [_component(b, C, axis) for axis in range(len(AXES))]
    except NothingSeen:
        return None
    component = int(np.argmax(each))
    columns = _columns(component)
    size = float(np.sqrt(np.mean((basis[:, component, columns] @ b[columns]) ** 2)))
    freedom, component_p = len(b), float(chdtrc(len(ORDERS), max(each)))
    scales = np.stack([slow_scales(b, C, axes) for axes in (PATH, ROTATION)])
    return Misfit(float(chdtrc(freedom, statistic)), statistic, freedom, component, size, component_p, noise_ratio, scales, moved)


def slow_scales(b: Array, C: Array, axes: range) -> Array:
    """How much further from none slow errors along three ``axes`` are than their covariance says: a symmetric matrix (3, 3), one at least.

    ``b`` (18,) are the coefficients of :func:`slow_errors`, ``C`` (18, 18) their covariance.

    Place and velocity are what polynomials of the orders 0 and 1 are of, and what made those of the orders above made these: their standard
    deviations are larger by that, as in averages of measurements that disagree [Rosenfeld et al. 1975, Particle Data Group]. In units of
    the standard deviations ``C_j^(1/2)`` of each order, so that the axes of the world do not matter.
    """
    squares = np.zeros((len(axes), len(axes)))
    for order in range(len(ORDERS)):
        at = [_columns(axis).start + order for axis in axes]
        told = np.linalg.solve(_root(C[np.ix_(at, at)]), b[at])
        squares += np.outer(told, told)
    size, along = np.linalg.eigh(squares)
    return np.asarray(along * np.maximum(noise_scales(size, np.asarray(len(ORDERS))), 1.0) @ along.T)


def widened(covariance: Array, tested: Misfit) -> Array:
    """A flight's ``covariance`` (p, p), with the slow errors in it where its residuals show them beside the noise.

    These have two parts: what the polynomials that show move the flight by, in full (a drag that nobody named), and what their like of
    the orders 0 and 1, which cannot show, must be expected to do.
    """
    if tested.p >= INADEQUATE_P:
        return covariance
    spread = np.eye(len(covariance))
    for place, scales in ((X, 0), (THETA, 1), (V, 0), (OMEGA, 1)):
        root = _root(covariance[place, place])
        spread[place, place] = root @ tested.scales[scales] @ np.linalg.inv(root)
    return np.asarray(spread @ covariance @ spread.T + np.outer(tested.moved, tested.moved))


def slow_errors(times_s: Array) -> Array:
    """Translations and rotations (n, 6, 18): Legendre polynomials of time over the sequence along each axis; ``times_s`` (n,)."""
    low, high = float(times_s.min()), float(times_s.max())
    P = legvander(2.0 * (times_s - low) / max(high - low, 1e-300) - 1.0, max(ORDERS))[:, list(ORDERS)]
    basis = np.zeros((len(times_s), len(AXES), len(AXES) * len(ORDERS)))
    for axis in range(len(AXES)):
        basis[:, axis, _columns(axis)] = P
    return basis


def _root(C: Array) -> Array:
    """The symmetric root of a covariance (n, n)."""
    size, along = np.linalg.eigh(C)
    return np.asarray(along * np.sqrt(size) @ along.T)


def _columns(axis: int) -> slice:
    return slice(axis * len(ORDERS), (axis + 1) * len(ORDERS))


def _component(b: Array, C: Array, axis: int) -> float:
    columns = _columns(axis)
    return float(b[columns] @ scaled_inverse(C[columns, columns]) @ b[columns])
