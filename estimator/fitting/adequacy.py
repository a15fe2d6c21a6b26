"""Do the residuals of a fitted flight look like noise? A score test of a slow error of the poses, with a calibrated p-value.

What a free flight lacks (a force, a torque, a wrong clock, a wrong axis of the picture) moves the fitted poses away from the outlines
slowly; an outline's noise is drawn anew in every frame. So the flight is given more freedom: a translation (world axes) and a rotation that
are polynomials of time of the orders 2, 3 and 4 along every axis, ``S' = [S, P_j(t) E_a]``. Orders 0 and 1 of the path and order 0 of the
rotation are the flight's own; order 1 of the rotation it takes up the less, the more the body tumbles, and it is not tested. One step
from the refined flight gives the coefficients ``b`` and, by the sandwich formula that gives the error bars, their covariance ``C``: own
noise of the outlines, noise of the calibrated views and the body-fixed error, which both come back from frame to frame and are not misfit.
Of a flight with impacts each segment between them has slow errors of its own: ``bᵀ C⁻¹ b`` is compared with chi² of 18 degrees of freedom
for each [Rao 1948; White 1982]. What is made of slow errors where they show: decision 72.

Blind to what changes from frame to frame (jitter of the clock, vibration): that raises the noise itself, which :class:`Misfit` tells as
``noise_ratio``, the residuals' standard deviation over the one that the outlines' neighbouring samples let expect.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from estimator.fitting.problem import Fact, M, alone, prior_of, with_facts, with_more
from estimator.fitting.refinement import Refined, sandwich
from estimator.fitting.stable_inverse import NothingSeen, scaled_inverse
from estimator.fitting.weighed_tangencies import linearise
from estimator.likelihood.rows import noise_scales
from estimator.motion.blocks import Layout
from estimator.motion.piecewise import named
from estimator.motion.slow_errors import AXES, ORDERS, PATH, ROTATION, SlowErrors, slow_errors

Array = NDArray[np.float64]
INADEQUATE_P = 1e-3
"""Below it the residuals are said not to be noise; the rate of false alarms at this level is in docs/studies/wrong_poses.md."""
NOISY = 3.0
"""Residuals so many times the standard deviation that outlines let expect are said to be too large: 0.7 to 1.4 where nothing is missing."""


@dataclass(frozen=True)
class Misfit:
    """``p`` of residuals that are as far from noise, from ``statistic`` with ``freedom`` degrees of freedom.

    ``component``: index into :data:`AXES` of the slow error that shows most, in the ``segment`` after so many impacts, ``size`` its RMS
    there (m or rad) and ``component_p`` its own p-value. ``noise_ratio``: standard deviation of the residuals over the expected one.
    ``scales`` of path and rotation (2, 3, 3), any unit, world axes, see :func:`slow_scales`, by segment, of those in which they show;
    ``moved`` (p,): by what the motion's parameters change where slow errors are allowed, ``velocity_shift`` (6,) m/s and rad/s, world
    frame, the velocities that ``segment`` begins with among them; these errors are ``slow`` with coefficients ``b`` (k,).
    """

    p: float
    statistic: float
    freedom: int
    component: int
    size: float
    component_p: float
    noise_ratio: float
    scales: Mapping[int, Array]
    moved: Array
    velocity_shift: Array
    segment: int
    slow: SlowErrors
    b: Array

    @property
    def adequate(self) -> bool:
        """Whether the residuals look like noise."""
        return not self.slowly_off and self.noise_ratio <= NOISY

    @property
    def slowly_off(self) -> bool:
        """Whether slow errors show."""
        return self.p < INADEQUATE_P


def misfit(refined: Refined[M], facts: Sequence[Fact[M]] = ()) -> Misfit | None:
    """The test of a refined motion, with what ``facts`` say of it; ``None`` where the sightings do not determine the slow errors."""
    task, motion, slow = refined.at.task, refined.flight, slow_errors(refined.sightings.times_s, refined.flight)
    at, own = linearise(task, motion, refined.at.settings, slow.basis), motion.layout.size
    try:
        system = with_more(at, with_facts(prior_of(alone(task, motion), motion), facts, motion))
        solved, C = system.solved(), sandwich(system)[own:, own:]
    except NothingSeen:
        return None
    return misfit_of((solved.step[own:], C), solved.shared, slow, motion.layout, noise_ratio=float(np.sqrt(refined.noise.mean_square)))


def misfit_of(found: tuple[Array, Array], inverse: Array, slow: SlowErrors, layout: Layout, *, noise_ratio: float) -> Misfit | None:
    """The test of ``slow`` errors with k coefficients beside the p parameters of a motion's ``layout``.

    ``found``: the coefficients (k,) and their covariance (k, k); ``inverse`` (p + k, p + k) of the normal matrix.
    ``None`` where the sightings do not determine them.
    """
    b, C = found
    if not slow.segments:
        return None
    try:
        statistic, moved = _square(b, C), inverse[: -len(b), -len(b) :] @ scaled_inverse(inverse[-len(b) :, -len(b) :]) @ b
        of_segments = {k: chdtrc(len(AXES) * len(ORDERS), _square(b, C, slow.of_segment(k))) for k in slow.segments}
        each = {(axis, k): _square(b, C, slow.columns(axis, k)) for k in slow.segments for axis in range(len(AXES))}
    except NothingSeen:
        return None
    component, segment = most = max(each, key=lambda at: each[at])
    columns = slow.columns(*most)
    error = slow.basis[:, component, columns]
    size = float(np.sqrt(np.mean((error[error.any(axis=1)] @ b[columns]) ** 2)))
    shown = [k for k in slow.segments if k == segment or of_segments[k] < INADEQUATE_P]
    scales = {k: np.array([slow_scales(found, slow, axes, k) for axes in (PATH, ROTATION)]) for k in shown}
    shift = np.concatenate([moved[layout[name]] for name in velocity_blocks(segment)])
    p, own_p = float(chdtrc(len(b), statistic)), float(chdtrc(len(ORDERS), each[most]))
    return Misfit(p, statistic, len(b), component, size, own_p, noise_ratio, scales, moved, shift, segment, slow, b)


def slow_scales(found: tuple[Array, Array], slow: SlowErrors, axes: Sequence[int], segment: int) -> Array:
    """How much further from none ``slow`` errors along three ``axes`` are than their covariance says: symmetric (3, 3), one at least.

    ``found``: coefficients (k,) and their covariance (k, k).

    Place and velocity are what polynomials of the orders 0 and 1 are of, and what made those of the orders above made these: their standard
    deviations are larger by that, as in averages of measurements that disagree [Rosenfeld et al. 1975, Particle Data Group]. In units of
    the standard deviations ``C_j^(1/2)`` of each order, so that the axes of the world do not matter.
    """
    b, C = found
    squares = np.zeros((len(axes), len(axes)))
    for order in range(len(ORDERS)):
        at = [slow.columns(axis, segment).start + order for axis in axes]
        told = np.linalg.solve(_root(C[np.ix_(at, at)]), b[at])
        squares += np.outer(told, told)
    size, along = np.linalg.eigh(squares)
    return np.asarray(along * np.maximum(noise_scales(size, np.asarray(len(ORDERS))), 1.0) @ along.T)


def widened(refined: Refined[M], tested: Misfit | None) -> Refined[M]:
    """A motion whose covariance has the slow errors in it where its residuals show them beside the noise."""
    if tested is None or not tested.slowly_off:
        return refined
    covariance = with_slow_errors(refined.covariance, refined.flight.layout, tested)
    return replace(refined, covariance=covariance, drift=partial(drifting, tested))


def drifting(tested: Misfit, time_s: float, segment: int, omega: Array) -> Array:
    """What slow errors add to the covariance (6, 6) of velocities at a time, were they the motion's and not the poses'.

    ``omega`` (3,) rad/s, world frame, there.
    """
    if segment not in tested.scales:
        return np.zeros((len(AXES), len(AXES)))
    moved = tested.slow.velocities(tested.b, time_s, segment, omega)
    return np.outer(moved, moved)


def with_slow_errors(covariance: Array, layout: Layout, tested: Misfit) -> Array:
    """The ``covariance`` (p, p) of parameters with what slow errors make of it (p, p).

    That has two parts: what the polynomials that show move the motion by, in full (a drag that nobody named), and what their like of the
    orders 0 and 1, which do not show, must be expected to do.
    """
    spread = np.eye(len(covariance))
    for segment, scales in tested.scales.items():
        names = (*(("x", "theta") if segment == 0 else ()), *velocity_blocks(segment))
        for number, name in enumerate(names):
            place = layout[name]
            root = _root(covariance[place, place])
            spread[place, place] = root @ scales[number % 2] @ np.linalg.inv(root)
    return np.asarray(spread @ covariance @ spread.T + np.outer(tested.moved, tested.moved))


def velocity_blocks(segment: int) -> tuple[str, str]:
    """Names of the blocks of the velocities that a segment begins with."""
    return ("v", "omega") if segment == 0 else (named("v", segment - 1), named("omega", segment - 1))


def _root(C: Array) -> Array:
    """The symmetric root of a covariance (n, n)."""
    size, along = np.linalg.eigh(C)
    return np.asarray(along * np.sqrt(size) @ along.T)


def _square(b: Array, C: Array, columns: slice = slice(None)) -> float:
    return float(b[columns] @ scaled_inverse(C[columns, columns]) @ b[columns])
