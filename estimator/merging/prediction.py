"""The check without truth: every view's outline predicted from the other views, and from where further views would tell most.

The polytope of the other views' tangent planes holds the body, so it casts an outline that holds the one seen. By how much it is larger
says what the view tells that the others do not; where the outline seen reaches out of it, the view contradicts them. Convex hulls of
outlines are compared; hollows are not.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.geometry.cast_outline import cast_convex
from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.silhouettes import silhouettes
from estimator.geometry.sphere import fibonacci_sphere
from estimator.geometry.support import support
from estimator.particle.particle import MINIMUM_VIEWS, view_poses
from estimator.particle.tangent_polytope import tangent_polytope

Array = NDArray[np.float64]
DIRECTIONS, SPHERE = 180, 2000
"""Of tangents that are compared, and of viewing directions that are looked at for a gap."""


@dataclass(frozen=True)
class Predicted:
    """Of k views: mean ``excess_px`` (k,) of the predicted outline over the one seen, and ``outside_px`` (k,), how far that reaches out."""

    excess_px: Array
    outside_px: Array


@dataclass(frozen=True)
class Coverage:
    """The viewing ``direction`` (3,), particle frame, farthest from all views (or their opposites), and by how many degrees."""

    direction: Array
    gap_deg: float


def predicted_views(outlines: Sequence[Outline], views: Sequence[CalibratedView], inside: Array) -> Predicted | None:
    """Every view predicted from the others; none where the others are too few. ``inside`` (3,) m: a point within the body."""
    if len(views) <= MINIMUM_VIEWS:
        return None
    seen, poses, u = silhouettes(outlines, [v.intrinsics for v in views]), view_poses(views), unit_circle(DIRECTIONS)
    excess, outside = np.full(len(views), np.nan), np.full(len(views), np.nan)
    for k, view in enumerate(views):
        rest = [i for i in range(len(views)) if i != k]
        others = view_poses([views[i] for i in rest])
        try:
            vertices = tangent_polytope(seen.take(rest), others, inside)
        except InputError:
            continue
        cast = cast_convex(vertices, view.intrinsics, poses.R[k], poses.t[k])
        more = support(cast, u) - support(seen.points_px[seen.slice_of(k)], u)
        excess[k], outside[k] = float(more.mean()), max(float(-more.min()), 0.0)
    return Predicted(excess, outside)


def largest_gap(views: Sequence[CalibratedView]) -> Coverage:
    """Where no view looks from; opposite directions show the same outline, mirrored."""
    looking = np.stack([v.R_cam_particle[2] for v in views])
    directions = fibonacci_sphere(SPHERE)
    nearest = np.abs(directions @ looking.T).max(axis=1)
    worst = int(np.argmin(nearest))
    return Coverage(directions[worst], float(np.rad2deg(np.arccos(min(nearest[worst], 1.0)))))
