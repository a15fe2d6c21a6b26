"""From brightness to occupancy: 0 where the background is seen, 1 where the particle is.

Before a dark particle light is a ratio, ``I = s B (1 - o) + P o``; before a dark background it adds up, ``I = B + b + (P - B - b) o``.
``s`` (or ``b``) is fitted around the particle, so that a flickering lamp does no harm. ``P``, the particle's own level,
is taken from just inside of its rim, and varies smoothly along it. Valid where the particle is wider than its edge.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from estimator.outlines.background import Background

Picture = Float[NDArray[np.float32], "height width"]
Mask = Bool[NDArray[np.bool_], "height width"]


@dataclass(frozen=True)
class Departure:
    """How far each pixel departs from the background (DN, positive towards the particle), and the noise of one pixel (DN)."""

    amount: Picture
    noise_dn: float

    @property
    def peak(self) -> float:
        """The strongest departure (DN) that is not one single noisy pixel's."""
        return float(cv2.blur(self.amount, (3, 3)).max())


def departure_from(picture: Picture, background: Background, level: Picture, ring: Mask) -> Departure:
    """Departure of ``picture`` from ``level`` (the background's cut-out, DN), matched on the pixels in ``ring``.

    What lies on the ring and is not background (the particle itself) is rejected once, so that it biases neither level nor noise.
    """
    lit = ring & (level > background.dim)
    lit = lit if lit.any() else ring
    amount = _matched(picture, background, level, lit)
    noise = _spread(amount[lit])
    plain = lit & (np.abs(amount) < 4 * noise)
    amount = _matched(picture, background, level, plain)
    return Departure(amount, _spread(amount[plain]))


def _matched(picture: Picture, background: Background, level: Picture, plain: Mask) -> Picture:
    """Departure from the background, scaled (bright) or shifted (dark) to agree on the ``plain`` pixels."""
    if background.bright:
        lamp = np.float32(np.median(picture[plain] / np.maximum(level[plain], 1.0)))
        return np.where(level > background.dim, lamp * level - picture, np.float32(0))
    return picture - level - np.float32(np.median(picture[plain] - level[plain]))


def _spread(amount: Float[NDArray[np.float32], " n"]) -> float:
    """Robust standard deviation (DN), at least that of rounding to whole numbers."""
    return max(1.4826 * float(np.median(np.abs(amount))), 0.3)


def occupancy_of(departure: Departure, filled: Mask, reach_px: float) -> tuple[Picture, float]:
    """Occupancy inside and around the ``filled`` particle, 0 far from it, and the particle's typical departure (DN).

    The particle's level is read at ``reach_px`` to ``2 reach_px + 2`` inside of the rim, beyond the edge's blur;
    deeper than that the particle is taken as opaque (it may shine through: a diamond, a glossy ball).
    """
    depth = cv2.distanceTransform(filled.astype(np.uint8), cv2.DIST_L2, 5)
    reach = min(reach_px, 0.5 * float(depth.max()))
    rim = (depth > reach) & (depth <= 2 * reach + 2)
    typical = float(np.median(departure.amount[rim])) if rim.any() else departure.peak
    own = _smooth_level(departure.amount, rim, 2 * int(2 * reach + 2) + 1, typical)
    occupancy = departure.amount / np.maximum(own, 0.2 * typical)
    beyond = cv2.distanceTransform((~filled).astype(np.uint8), cv2.DIST_L2, 5)
    occupancy = np.where(depth > 2 * reach + 2, 1.0, np.where(beyond > 2 * reach + 2, 0.0, occupancy))
    return occupancy.astype(np.float32), typical


def _smooth_level(amount: Picture, rim: Mask, size: int, typical: float) -> Picture:
    """Mean of ``amount`` over ``rim`` in a square of ``size`` px around each pixel; ``typical`` far away."""
    weight = rim.astype(np.float32)
    faint = np.float32(1e-3)
    near = cv2.blur(weight, (size, size)) + faint
    return np.asarray((cv2.blur(amount * weight, (size, size)) + faint * typical) / near, dtype=np.float32)
