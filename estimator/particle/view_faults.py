"""Usual mistakes in calibrated views, told by how well the views agree with one another once a mistake is taken back.

Rotations given the other way round, pictures whose rows are counted upwards, mirrored pictures. A mistake is only named, never corrected.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline, oriented
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.geometry.silhouettes import silhouettes
from estimator.geometry.visual_hull import bounding_ball
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
    """What is likely wrong with views that disagree; empty where taking back no mistake makes them agree. Outlines are not empty."""
    given = _disagreement_px(outlines, views)
    transposed = [replace(v, R_cam_particle=v.R_cam_particle.T) for v in views]
    turned = [upside_down(o, v.intrinsics.height_px) for o, v in zip(outlines, views, strict=True)]
    flipped = [mirrored(o, v.intrinsics.width_px) for o, v in zip(outlines, views, strict=True)]
    for seen, stated, said in (
        (outlines, transposed, "their rotations are transposed: R_cam_particle maps particle to camera axes"),
        (turned, views, "the rows of their pictures are counted upwards: pixel y runs downwards"),
        (flipped, views, "their pictures are mirrored: pixel x runs to the right"),
    ):
        if BETTER * _disagreement_px(seen, stated) < given:
            return f"The calibrated views agree if {said}."
    return ""


def _disagreement_px(outlines: Sequence[Outline], views: Sequence[CalibratedView]) -> float:
    """Median over the views of the RMS error of each against the others; infinite where they do not see one body."""
    seen = silhouettes(outlines, [v.intrinsics for v in views])
    R = np.ascontiguousarray([v.R_cam_particle for v in views], dtype=np.float64)  # of transposed ones the kernel would be compiled anew
    poses = PoseSet(R, np.array([v.t_cam_particle for v in views], dtype=np.float64))
    among = disagreement(seen, poses, bounding_ball(outlines, views)[0])
    return float(np.median(among.view_rms_px)) if among.seen_share >= LEAST_PAIRS else float("inf")
