"""Tangency errors, hull and pose search on real outlines with calibrated cameras: a stone in a six-camera rig, a toy on a turntable.

``python -m scripts.real_outlines --silhouettes FOLDER --result docs/results/real_outlines.json``. FOLDER holds ``uct_stone6``
(Forbes 2007) and ``oxford_dino`` (Visual Geometry Group). An independent computation gave RMS errors of 0.71 px over 15 pairs and
0.43 px over 630.
"""

import argparse
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.linalg import rq
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from skimage.io import imread
from skimage.measure import find_contours

from datasets.observation import CalibratedView
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline, oriented
from estimator.configuration import Configuration
from estimator.fitting.pose_refinement import Views
from estimator.fitting.pose_search import SearchEffort, search_pose
from estimator.geometry.epipolar_tangency import PoseSet, tangency_errors
from estimator.geometry.silhouettes import Silhouettes, pack, silhouettes
from estimator.geometry.tangent_hull import TangentHull
from estimator.geometry.visual_hull import visual_hull
from estimator.particle import particle_of, view_poses

Array = NDArray[np.float64]
EFFORT = SearchEffort(starts=200, candidates=24)
INDEPENDENT = {"uct_stone6": 0.71, "oxford_dino": 0.43}


def outline_of(path: Path) -> tuple[Outline, tuple[int, int]]:
    """The longest half-level contour of a mask, and the mask's size (width, height)."""
    mask = imread(path, as_gray=True).astype(np.float64)
    mask = np.pad(mask / mask.max(), 1)
    contour = max(find_contours(mask, 0.5), key=len)[:-1, ::-1] - 1.0
    return Outline(oriented(contour)), (mask.shape[1] - 2, mask.shape[0] - 2)


def without_skew(P: Array, outline: Outline, size: tuple[int, int]) -> tuple[Outline, CalibratedView]:
    """View and outline of a projection matrix (3, 4) for 0-based pixels; the skew is taken out of the pixels: u - s (v - cy) / fy."""
    K, R = rq(P[:, :3])
    signs = np.diag(np.sign(np.diag(K)))
    K, R = K @ signs, signs @ R
    t = np.linalg.solve(K, P[:, 3])
    if np.linalg.det(R) < 0:
        R, t = -R, -t
    K = K / K[2, 2]
    points = outline.points_px.copy()
    points[:, 0] -= K[0, 1] * (points[:, 1] - K[1, 2]) / K[1, 1]
    return Outline(points), CalibratedView(Intrinsics(*size, K[0, 0], K[1, 1], K[0, 2], K[1, 2]), R, t)


def stone(folder: Path) -> tuple[list[Outline], list[CalibratedView]]:
    """The six views of the stone; millimetres become metres."""
    outlines, views = [], []
    for camera in json.loads((folder / "cameras.json").read_text()):
        outline, size = outline_of(folder / camera["image"])
        outline, view = without_skew(np.array(camera["P_zero_based_pixels"]) @ np.diag([1.0, 1.0, 1.0, 1e-3]), outline, size)
        outlines.append(outline)
        views.append(view)
    return outlines, views


def dinosaur(folder: Path) -> tuple[list[Outline], list[CalibratedView]]:
    """The 36 views of the turntable.

    The metric matrices leave the body behind the cameras: a metric upgrade is known up to a reflection of the world, which turns ``t``.
    """
    matrices = np.load(folder / "P_metric_upgraded_36x3x4.npy")
    seen = [outline_of(folder / f"mask.{i:03d}.png") for i in range(len(matrices))]
    pairs = [without_skew(P, outline, size) for P, (outline, size) in zip(matrices, seen, strict=True)]
    return [o for o, _ in pairs], [replace(v, t_cam_particle=-v.t_cam_particle) for _, v in pairs]


def pairwise_rms_px(seen: Silhouettes, poses: PoseSet, centre: Array) -> tuple[float, float, int]:
    """RMS and median of the absolute errors (px) over all pairs, and how many pairs have tangents."""
    upper = np.triu(np.ones((len(seen), len(seen))), 1)
    errors = tangency_errors(seen, poses, seen, poses, pivot_particle=centre, weight=upper)
    e = errors.error[errors.valid]
    return float(np.sqrt(np.mean(e**2))), float(np.median(np.abs(e))), int(errors.valid.sum())


def unsmoothed(outlines: list[Outline], views: list[CalibratedView]) -> Silhouettes:
    """Hulls of the outlines as they are: the convention of the independent computation."""
    hulls = []
    for outline in outlines:
        points = outline.points_px[ConvexHull(outline.points_px).vertices]
        hulls.append(TangentHull(points, np.full(len(points), 0.3), 0.1, 0.3, len(outline.points_px)))
    return pack(hulls, [v.intrinsics for v in views])


def left_out_errors_deg(outlines: list[Outline], views: list[CalibratedView]) -> list[float]:
    """Angle (degrees) between each view's given pose and the one found from the others, from nothing."""
    angles = []
    for left in range(len(views)):
        others = [i for i in range(len(views)) if i != left]
        particle = particle_of([outlines[i] for i in others], [views[i] for i in others], Configuration(foreign_view_ratio=1e9))
        known = Views(particle.seen, particle.poses, particle.body.com_particle)
        found = search_pose(silhouettes([outlines[left]], [views[left].intrinsics]), known, particle.catalogue, EFFORT)
        given = views[left].R_cam_particle
        angles.append(float(np.degrees(Rotation.from_matrix(found.poses.R[0] @ given.T).magnitude())) if len(found.rms_px) else 180.0)
    return angles


def study(name: str, outlines: list[Outline], views: list[CalibratedView]) -> dict[str, Any]:
    """All figures of one set."""
    hull = visual_hull(outlines, views, resolution=96)
    solid = trimesh.Trimesh(hull.vertices, hull.faces)
    poses, centre = view_poses(views), np.asarray(solid.center_mass)
    rms, median, pairs = pairwise_rms_px(unsmoothed(outlines, views), poses, centre)
    smooth_rms, smooth_median, _ = pairwise_rms_px(silhouettes(outlines, [v.intrinsics for v in views]), poses, centre)
    angles = left_out_errors_deg(outlines, views)
    return {
        "pairs": pairs,
        "rms_ete_px": rms,
        "median_ete_px": median,
        "independent_rms_px": INDEPENDENT[name],
        "rms_ete_smoothed_px": smooth_rms,
        "median_ete_smoothed_px": smooth_median,
        "hull_extent": np.ptp(hull.vertices, axis=0).tolist(),
        "hull_volume": float(abs(solid.volume)),
        "left_out_pose_error_deg": [round(a, 2) for a in angles],
        "left_out_within_5_deg": float(np.mean(np.array(angles) <= 5.0)),
    }


def main() -> int:
    """Both sets, printed and written."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--silhouettes", type=Path, required=True, help="folder with uct_stone6 and oxford_dino")
    parser.add_argument("--result", type=Path, default=Path("out/real_outlines.json"))
    arguments = parser.parse_args()
    sets = {"uct_stone6": stone(arguments.silhouettes / "uct_stone6"), "oxford_dino": dinosaur(arguments.silhouettes / "oxford_dino")}
    result = {name: study(name, *data) for name, data in sets.items()}
    text = json.dumps(result, indent=1)
    print(text)
    arguments.result.parent.mkdir(parents=True, exist_ok=True)
    arguments.result.write_text(text + "\n")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
