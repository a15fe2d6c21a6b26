"""Blurred edges seen through a threshold other than one half: the faster an edge moves along its normal, the further it is displaced.

An edge blurred by optics and pixels with the standard deviation ``s`` and moved by ``l = |u . w| T`` during the exposure is as dark as
``C(d) = s / l (G((l/2 - d) / s) - G((-l/2 - d) / s))``, ``G(z) = z Phi(z) + phi(z)``, at the distance ``d`` from where it is in the
middle of the exposure; ``delta`` is where that is ``0.5 - bias``. Outlines given as such have no ``s`` that is known: ``delta = bias l``.

The half level of pictures is another level of darkness only where the sensor's response is bent, ``light^gamma``, and such a sensor shows
edges with another width than they have: ``s`` is the width measured times ``gamma 2^-1 / (0.5 + bias) exp(-Phi^-1(0.5 + bias)^2 / 2)``.

Corners that are narrow across the motion recede by more, at the half level, too: that is tabled by the level from the outlines that the
body casts (:mod:`estimator.geometry.outline_smear`). A bias of zero stands for outlines of the exposure's middle, as they are without the
effect.

Motion blur as in [Potmesil and Chakravarty, Comput. Graph. 17 (1983) 389]. Valid where edges move evenly during the exposure.
"""

import numpy as np
from scipy.optimize.elementwise import find_root
from scipy.special import ndtr, ndtri

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel, Places, Setting
from estimator.effects.receding import tabled
from estimator.geometry.outline_smear import LEVELS

MOVED = np.concatenate([np.linspace(0.0, 4.0, 33), np.linspace(4.5, 12.0, 16)])
"""Movements during the exposure, over the standard deviation of the static blur, between which displacements are interpolated."""
LEAST_MOVED = 1e-3
"""Movement over the static blur below which it counts as this: the formula divides by it."""
REACH = 8.0
"""Standard deviations beyond half the movement within which any level is found."""
ROOT_TWO_PI = np.sqrt(2.0 * np.pi)
"""What a normal density is divided by."""


class MotionBlurThreshold(EffectModel):
    """Where the edge is as dark as ``0.5 - bias``, less what corners lose."""

    entry = EFFECTS["motion_blur_threshold"]
    accuracy = 0.1
    accuracy_at_spikes = 0.3

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """Outline displacement by the blur."""
        bias = float(theta[0])
        if bias == 0.0:
            return np.zeros(places.radius_px.shape)
        moved = np.abs(np.sum(places.normal * places.velocity_px, axis=-1)) * setting.exposures_s(places.seen)[:, None, None]
        lost = tabled(places.smear, np.full(moved.shape, 0.5 - bias), LEVELS)
        return np.asarray(displaced(bias, moved, np.reshape(setting.edge_px, (-1, 1, 1))) - lost)


def displaced(bias: float, moved_px: Array, edge_px: Array | float) -> Array:
    """Displacement (px) of edges that move by ``moved_px`` during the exposure; ``edge_px`` the width measured of edges that do not.

    ``moved_px`` (n, k, 2), ``edge_px`` (n, 1, 1) or one number.
    """
    if not np.any(edge_px):
        return bias * moved_px
    static = edge_px * _widened(bias)
    over = moved_px / static
    return np.asarray(static * np.where(over <= MOVED[-1], np.interp(over, MOVED, _displaced(bias)), bias * over))


def _displaced(bias: float) -> Array:
    """At :data:`MOVED`, in units of the static blur."""
    moved = np.maximum(MOVED, LEAST_MOVED)

    def short(d: Array, moved: Array) -> Array:
        return np.asarray((_integral(0.5 * moved - d) - _integral(-0.5 * moved - d)) / moved - (0.5 - bias))

    return np.asarray(find_root(short, (-0.5 * moved - REACH, 0.5 * moved + REACH), args=(moved,)).x)


def _integral(z: Array) -> Array:
    """Of the normal distribution function from minus infinity."""
    return np.asarray(z * ndtr(z) + np.exp(-(z**2) / 2.0) / ROOT_TWO_PI)


def _widened(bias: float) -> float:
    """The width of an edge over the one that a sensor shows whose response puts the level ``0.5 - bias`` at the half."""
    gamma = np.log(0.5) / np.log(0.5 + bias)
    return float(gamma * 0.5 / (0.5 + bias) * np.exp(-0.5 * ndtri(0.5 + bias) ** 2))
