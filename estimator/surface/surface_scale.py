"""By how much further a surface is from what views and prior prefer than they say, and what that makes of the motions.

The prior of surfaces draws edges and planes where it can, and which ones noise has drawn no covariance about the end says: outlines of
the surface were off by 1.6 to 3.5 times what it said. The frames show it. In the moves of the surface that they feel
(:mod:`estimator.surface.amplitudes`), each of standard deviation one under views and prior, the distance from what those prefer has a
standard deviation of its own: the scale at which the evidence is largest [MacKay, Neural Computation 4 (1992) 415], with the prior that
noise has [O'Hagan and Forster 2004, ch. 11].
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.sparse import csr_array, vstack

from estimator.fitting.stable_inverse import scaled_inverse
from estimator.likelihood.rows import noise_scales
from estimator.surface.amplitudes import independent, shown
from estimator.surface.arrow import Eliminated, Whole, filled

Array = NDArray[np.float64]
TURNS, CLOSE = 100, 1e-3
"""Of the fixed point at most, and the relative change that ends it."""


@dataclass(frozen=True)
class ScaledStep:
    """The ``scale`` of the surface's distance, and the motions' ``step`` (p,) and ``covariance`` (p, p) there."""

    scale: float
    step: Float[NDArray[np.float64], " p"]
    covariance: Float[NDArray[np.float64], "p p"]


def scaled_step(fitted: Eliminated, whole: Whole, known: Array, pull: Array) -> ScaledStep:
    """The step of all motions with the surface as uncertain as the frames show it to be.

    ``fitted``: views first, then what the motions move; ``whole`` rows of mass properties; ``known`` (p + k, p + k) and ``pull`` (p + k,):
    information and gradient of what is known of the motions and of the k shifts of views, which what views say is marginal over.
    """
    prior, views, frames = fitted.prior, fitted.groups[0], fitted.groups[1:]
    p = len(pull) - len(views.place)
    believed = shown(prior, views, known[p:, p:], pull[p:])
    every = csr_array(vstack([each.J for each in frames]))
    moves, felt = independent(fitted.solved[:, :-1], believed.information, csr_array(every.T @ every))
    here = moves.T @ believed.gradient
    by_motion, by_moves = whole.by_motion[:, :p], -whole.by_corner.T @ (prior.basis @ moves)
    both, g = by_motion.T @ by_moves, np.column_stack([by_motion, by_moves]).T @ whole.residual
    g[:p] += pull[:p]
    for each in frames:
        both[each.place] += filled(each.J.T @ each.F).T @ moves
        g[each.place] += each.F.T @ each.r
        g[p:] += moves.T @ (each.J.T @ each.r)
    of_motions = known[:p, :p] + fitted.of_motions(whole)[:p, :p]
    H = np.block([[of_motions, both], [both.T, np.diag(felt) + by_moves.T @ by_moves]])
    answer = scaled_inverse(H[:p, :p]) @ np.column_stack([H[:p, p:], g[:p]])
    information = H[p:, p:] - H[p:, :p] @ answer[:, :-1]
    scale = scale_of(information, information @ here - (g[p:] - H[p:, :p] @ answer[:, -1]))
    H[p:, p:] += np.eye(len(here)) / scale**2
    covariance = scaled_inverse(H)
    step = -covariance @ (g + np.concatenate([np.zeros(p), here / scale**2]))
    return ScaledStep(scale, step[:p], covariance[:p, :p])


def scale_of(information: Float[NDArray[np.float64], "m m"], pull: Float[NDArray[np.float64], " m"]) -> float:
    """Standard deviation of m amplitudes at which the evidence is largest, one before there are data.

    ``information`` and ``pull`` of the data alone: most likely amplitudes solve ``information a = pull``.
    """
    value, vector = np.linalg.eigh(0.5 * (information + information.T))
    value, pull, scale = np.maximum(value, 0.0), vector.T @ pull, 1.0
    for _ in range(TURNS):
        precision = value + 1.0 / scale**2
        square, told = np.sum((pull / precision) ** 2), np.sum(value / precision)
        new = float(noise_scales(square, told))
        done, scale = abs(new / scale - 1.0) < CLOSE, new
        if done:
            break
    return scale
