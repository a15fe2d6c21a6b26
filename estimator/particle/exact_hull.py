"""The visual hull of a body as a polyhedron: the solid that all silhouette cones of its calibrated views have in common.

Every view's outline, spread from the camera's centre, is a cone that holds the body; what lies within all of them is the visual hull
[Laurentini, IEEE Trans. PAMI 16 (1994) 150], here intersected as polyhedra [Franco and Boyer, Exact polyhedral visual hulls, BMVC 2003]
by the Manifold library. Unlike a grid of voxels it keeps spikes as sharp and as thin as the views show them. Hollows that no view looks
into stay filled.

Outlines are smoothed as their tangents are (:mod:`estimator.geometry.tangent_hull`) and drawn with fewer corners, within a tolerance:
of forty views of a jagged body, 0.4 px of a view leave some 17 000 corners and take five seconds, half of it twice as many.
"""

from collections.abc import Sequence

import manifold3d
import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.closed_curves import largest_part
from estimator.geometry.tangent_hull import smoothed
from estimator.geometry.visual_hull import bounding_ball

Array = NDArray[np.float64]
REACH = 1.2
"""How far in front of the ball around the body and behind it a cone is cut off, in radii of that ball."""


def exact_hull(outlines: Sequence[Outline], views: Sequence[CalibratedView], *, tolerance_px: float) -> SurfaceMesh:
    """The largest part of what the views' cones have in common; ``tolerance_px``: by how much an outline may be simplified.

    Raises
    ------
    InputError
        Where the cones have nothing in common.
    """
    centre, radius = bounding_ball(outlines, views)
    cones = [_cone(_drawn(outline, tolerance_px), view, centre, radius) for outline, view in zip(outlines, views, strict=True)]
    parts = manifold3d.Manifold.batch_boolean(cones, manifold3d.OpType.Intersect).decompose()
    if not parts:
        raise InputError("calibrated views: expected cones that have a body in common, got none; a view may not belong")
    mesh = max(parts, key=lambda part: part.volume()).to_mesh64()
    vertices = np.asarray(mesh.vert_properties[:, :3], dtype=np.float64)
    return SurfaceMesh(vertices=vertices * radius + centre, faces=np.asarray(mesh.tri_verts, dtype=np.int64))


def _drawn(outline: Outline, tolerance_px: float) -> Float[NDArray[np.float64], "n 2"]:
    """The outline's corners (px) once smoothed and simplified."""
    polygon = largest_part(shapely.make_valid(shapely.Polygon(smoothed(outline.points_px))).simplify(tolerance_px))
    return np.asarray(shapely.get_coordinates(polygon.exterior)[:-1])


def _cone(corners_px: Array, view: CalibratedView, centre: Array, radius: float) -> manifold3d.Manifold:
    """The frustum of a view's cone around the body, in radii of the ball around it and from its centre, axes of the particle.

    A cross section at the near end grows in proportion to its distance from the camera; the shear puts it back on its oblique axis.
    """
    xy = view.intrinsics.normalise(corners_px)
    middle = xy.mean(axis=0)
    ball = (view.R_cam_particle @ centre + view.t_cam_particle) / radius
    near, far = float(ball[2]) - REACH, float(ball[2]) + REACH
    section = manifold3d.CrossSection([(xy - middle) * near], manifold3d.FillRule.EvenOdd)
    frustum = section.extrude(far - near, scale_top=(far / near, far / near))
    oblique = np.array([[1.0, 0.0, middle[0]], [0.0, 1.0, middle[1]], [0.0, 0.0, 1.0]])
    start = near * np.array([middle[0], middle[1], 1.0]) - ball
    to_particle = view.R_cam_particle.T @ np.column_stack([oblique, start])
    return frustum.transform(to_particle)
