"""Usual mistakes in calibrated views, told by how well the views agree with one another once a mistake is taken back.

Poses or rotations given the other way round, pictures whose rows are counted upwards, mirrored, turned or in reverse. A mistake is
only named, never corrected. Rotations and poses are turned back in the frame that is given: where a rig was moved into another frame since
(that of its first camera), they are products of two cameras' and only found if that camera's frame was the world before, too.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from datasets.errors import InputError
from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline, oriented
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import silhouettes
from estimator.geometry.visual_hull import bounding_ball, visual_hull
from estimator.particle.view_disagreement import disagreement

BETTER = 5.0
"""How many times smaller the views' disagreement must become for a mistake to be named."""
LEAST_PAIRS = 0.5
"""Share of pairs of views with common tangents, without which views do not see one body."""


def upside_down(outline: Outline, height_px: int) -> Outline:
    """The outline in a picture whose rows are counted from the other end."""
    return Outline(oriented(outline.points_px * [1.0, -1.0] + [0.0, height_px - 1.0]))


def mirrored(outline: Outline, width_px: int) -> Outline:
    """The outline in a picture whose columns are counted from the other end."""
    return Outline(oriented(outline.points_px * [-1.0, 1.0] + [width_px - 1.0, 0.0]))


def view_fault(outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> str:
    """What is likely wrong with views that disagree; empty where taking back no mistake makes them agree. Outlines are not empty.

    Views that do not see one body disagree by the size of their outlines. Of a ring of cameras, mirrored pictures are those of a mirrored
    body in the reverse order: all mistakes that do as well are named.
    """
    left = {said: _disagreement_px(*taken_back) for said, taken_back in _taken_back(outlines, views).items()}
    given = min(_disagreement_px(outlines, views), float(np.median([np.ptp(o.points_px, axis=0).max() for o in outlines])) / 2.0)
    named = [said for said, px in left.items() if BETTER * px < given and px <= BETTER * min(left.values())]
    return f"The calibrated views agree if {', or if '.join(named)}." if named else ""


def agreed_hull(outlines: Sequence[Outline], views: Sequence[CalibratedView], *, resolution: int) -> SurfaceMesh:
    """The visual hull (m, the views' frame) in a grid of ``resolution``³ voxels; outlines are not empty.

    Raises
    ------
    InputError
        Where the views leave nothing, with what is likely wrong with them.
    """
    try:
        return visual_hull(outlines, views, resolution=resolution)
    except InputError as error:
        fault = view_fault(outlines, views)
        raise InputError(f"{error}. {fault}".removesuffix(".") if fault else str(error)) from error


def _taken_back(
    outlines: Sequence[Outline], views: Sequence[CalibratedView]
) -> dict[str, tuple[Sequence[Outline], Sequence[CalibratedView]]]:
    """Outlines and views without a mistake, by what the mistake is."""
    transposed = [replace(v, R_cam_particle=v.R_cam_particle.T) for v in views]
    inverted = [replace(v, t_cam_particle=-v.R_cam_particle @ v.t_cam_particle) for v in transposed]
    upwards = [upside_down(o, v.intrinsics.height_px) for o, v in zip(outlines, views, strict=True)]
    flipped = [mirrored(o, v.intrinsics.width_px) for o, v in zip(outlines, views, strict=True)]
    turned = [mirrored(o, v.intrinsics.width_px) for o, v in zip(upwards, views, strict=True)]
    return {
        "their rotations are transposed: R_cam_particle maps particle to camera axes": (outlines, transposed),
        "their poses are inverted: R_cam_particle, t_cam_particle map particle to camera": (outlines, inverted),
        "the rows of their pictures are counted upwards: pixel y runs downwards": (upwards, views),
        "their pictures are mirrored: pixel x runs to the right": (flipped, views),
        "their pictures are turned by 180 degrees": (turned, views),
        "their pictures are in the reverse order": (outlines[::-1], views),
    }


def _disagreement_px(outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> float:
    """Median over the views of the RMS error of each against the others; infinite where they do not see one body."""
    seen = silhouettes(outlines, [v.intrinsics for v in views])
    R = np.ascontiguousarray([v.R_cam_particle for v in views], dtype=np.float64)  # of transposed ones the kernel would be compiled anew
    poses = PoseSet(R, np.array([v.t_cam_particle for v in views], dtype=np.float64))
    among = disagreement(seen, poses, bounding_ball(outlines, views)[0])
    return float(np.median(among.view_rms_px)) if among.seen_share >= LEAST_PAIRS else float("inf")
