"""What the tangents of a smeared outline recede beyond what their own movement says: at corners that are narrow across the motion.

A picture that moves by ``w`` during its exposure is dark, at a point, for the share of it during which the body is there. The points that
are dark for the share ``L`` at least are the outline eroded by a segment ``L w`` and dilated by one ``(1 - L) w`` [Serra 1982, ch. 2]. A
smooth stretch with the outward normal ``u`` thus moves by ``(1/2 - L) |u . w|``. A corner that is narrower across the motion than
``L w`` is gone, and its tangents recede by more; that more is tabled, from the outline where it is at several instants.

Valid where the outline moves by little more than an affine map during the exposure, and hollows are wider than the smear.
"""

from collections.abc import Callable

import manifold3d
import numpy as np
from numpy.typing import NDArray

from estimator.geometry.closed_curves import largest_ring
from estimator.geometry.support import support

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LEVELS = np.array([0.1, 0.3, 0.5, 0.7, 0.9])
"""Shares (L,) of the exposure that are tabled (notebook 23)."""
INSTANTS = (-0.5, 0.5)
"""Where the eroded outline has to lie in each, and where it is in the middle, in units of the share."""


def smear_losses(points: Array, motion: Array, outward: Array) -> Array:
    """Recession (a, L) px of the tangents with normals ``outward`` (a, 2) of a smeared outline ``points`` (v, 2) px, either way round.

    ``motion`` (3, 2) maps ``x, y, 1`` (px) to the displacement (px) during the exposure. The last level's where nothing is left.
    """
    furthest = (points @ outward.T).argmax(axis=0)
    return losses_of_smear(points, motion, lambda curve: support(curve, outward), (furthest, outward))


def losses_of_smear(points: Array, motion: Array, reach: Callable[[Array], Array], of: tuple[Index, Array]) -> Array:
    """The same where curves (m, 2) px ``reach`` (a,) px at places of the outline, its corners (a,) and their outward normals (a, 2).

    ``points`` (v, 2) px, ``motion`` (3, 2).
    """
    moved = np.column_stack([points, np.ones(len(points))]) @ motion
    along = np.abs(np.sum(moved[of[0]] * of[1], axis=1))
    losses, whole = np.zeros((len(along), len(LEVELS))), reach(points)
    where, middle = np.array(INSTANTS)[:, None, None] * moved, manifold3d.CrossSection([points], manifold3d.FillRule.NonZero)
    for i, level in enumerate(LEVELS):
        first, last = (manifold3d.CrossSection([ring], manifold3d.FillRule.NonZero) for ring in points + level * where)
        left = (first ^ middle ^ last).to_polygons()
        if not left:
            losses[:, i:] = losses[:, max(i - 1, 0)][:, None]
            break
        losses[:, i] = whole - reach(largest_ring(left)) - 0.5 * level * along
    return np.asarray(np.maximum(losses, 0.0))
