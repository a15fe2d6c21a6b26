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

from estimator.outlines.pictures.background import Background

Picture = Float[NDArray[np.float32], "height width"]
Mask = Bool[NDArray[np.bool_], "height width"]


_BAND_PX = 2.0
"""Width of the band inside the edge's blur in which the particle's own level is read. By judgement."""
_CEILING = 1.1
"""Share of a pixel that counts as covered at most: glints do not pull the edge. By judgement."""
_LEAK_PX = 1.2
"""Depth, beside 1.3 blurs, from which a picture still less than half covered shows a leak of light. By judgement."""
_LEAK_REACH_PX = 5
"""Square over which a leak's own level is a mean."""
_FAINTEST = 0.2
"""Least level of a leak over the particle's: fainter ones are noise. By judgement."""
ROUNDING_DN = 0.3
"""Standard deviation of rounding to whole numbers."""


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
    return max(1.4826 * float(np.median(np.abs(amount))), ROUNDING_DN)


def plain_occupancy(departure: Departure, filled: Mask) -> Picture:
    """Occupancy for one level all over the particle: that of its darker (before a dark background, brighter) inside."""
    depth = cv2.distanceTransform(filled.astype(np.uint8), cv2.DIST_L2, 5)
    inside = departure.amount[depth > 0.3 * depth.max()]
    near = cv2.dilate(filled.astype(np.uint8), np.ones((5, 5), np.uint8)) > 0
    full = max(float(np.percentile(inside, 75)), ROUNDING_DN)  # a bubble is as bright inside as what is behind it
    return np.where(near, departure.amount / np.float32(full), np.float32(0))


def occupancy_of(departure: Departure, filled: Mask, blur_px: float) -> tuple[Picture, float]:
    """Occupancy inside and around the ``filled`` particle, 0 far from it, and the particle's typical departure (DN).

    The particle's level is read in a band just beyond the reach of the edge's blur (``blur_px``), and along the rim it may
    vary. Where the picture is still less than half covered as deep inside as an opaque body would be dark, light leaks through
    a facet at the rim, and the level is the leak's own. Deeper than the band the particle is taken as opaque (a diamond, a
    glossy ball shine through).
    """
    amount = departure.amount
    depth = cv2.distanceTransform(filled.astype(np.uint8), cv2.DIST_L2, 5)
    reach = min(0.8 + 3.2 * blur_px, 0.5 * float(depth.max()))
    band = reach + _BAND_PX
    rim = (depth > reach) & (depth <= band)
    typical = float(np.median(amount[rim])) if rim.any() else departure.peak
    leak = (depth > _LEAK_PX + 1.3 * blur_px) & (depth <= band) & (amount < 0.5 * typical)
    own = _mean_over(amount, rim, 2 * int(band) + 1, np.float32(typical))
    own = _mean_over(amount, leak, _LEAK_REACH_PX, own) if leak.any() else own
    occupancy = amount / np.maximum(own, _FAINTEST * typical)
    beyond = cv2.distanceTransform((~filled).astype(np.uint8), cv2.DIST_L2, 5)
    occupancy = np.where(depth > band, 1.0, np.where(beyond > band, 0.0, occupancy))
    return np.minimum(occupancy, _CEILING).astype(np.float32), typical


def _mean_over(amount: Picture, part: Mask, size: int, otherwise: Picture | np.float32) -> Picture:
    """Mean of ``amount`` over ``part`` in a square of ``size`` px around each pixel; ``otherwise`` where none of it is near."""
    weight = part.astype(np.float32)
    faint = np.float32(1e-3)
    near = cv2.blur(weight, (size, size)) + faint
    return np.asarray((cv2.blur(amount * weight, (size, size)) + faint * otherwise) / near, dtype=np.float32)
