"""Tangency errors, hull and pose search on real outlines with calibrated cameras: a stone in a six-camera rig, a toy on a turntable.

``python -m scripts.real.real_outlines --silhouettes FOLDER --result docs/results/real_outlines.json``. FOLDER holds ``uct_stone6``
(Forbes 2007) and ``oxford_dino`` (Visual Geometry Group). An independent computation gave RMS errors of 0.71 px over 15 pairs and
0.43 px over 630.
"""

import argparse
import json
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from skimage.io import imread
from skimage.measure import find_contours

from datasets.estimate import Status
from datasets.observation import CalibratedView
from datasets.rig_files.handedness import in_front
from datasets.rig_files.matrices import decomposed
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline, oriented
from estimator.data.configuration import Configuration
from estimator.data.views import Poses, Views
from estimator.geometry.epipolar_tangency import PoseSet, tangency_errors
from estimator.geometry.silhouettes import Silhouettes, pack, silhouettes
from estimator.geometry.tangent_hull import TangentHull
from estimator.geometry.visual_hull import visual_hull
from estimator.particle.particle import particle_of, view_poses
from estimator.poses.pose_competition import Competition, compete, protrusion_px
from estimator.poses.pose_refinement import pose_errors
from estimator.poses.pose_search import SearchEffort, search_pose
from scripts.real.focal_poses import FocalPoses, FocalPrior, poses_with_focal

Array = NDArray[np.float64]
EFFORT = SearchEffort(starts=200, candidates=24)
CONFIGURATION = Configuration(foreign_view_ratio=1e9)
RIGHT_DEG, MINIMA_TOLD, SEED = 5.0, 6, 20261121
FEWER = (5, 8, 16)
INDEPENDENT = {"uct_stone6": 0.71, "oxford_dino": 0.43}


def outline_of(path: Path) -> tuple[Outline, tuple[int, int]]:
    """The longest half-level contour of a mask, and the mask's size (width, height)."""
    mask = imread(path, as_gray=True).astype(np.float64)
    mask = np.pad(mask / mask.max(), 1)
    contour = max(find_contours(mask, 0.5), key=len)[:-1, ::-1] - 1.0
    return Outline(oriented(contour)), (mask.shape[1] - 2, mask.shape[0] - 2)


def without_skew(P: Array, outline: Outline, size: tuple[int, int], name: str) -> tuple[Outline, HsvCamera]:
    """Camera and outline of a projection matrix (3, 4) for 0-based pixels; the skew is taken out of the pixels."""
    found = decomposed(P, size, name, name)
    middle = [found.camera.intrinsics.cx_px, found.camera.intrinsics.cy_px]
    return Outline((outline.points_px - middle) @ found.moved.T + middle), found.camera


def views_of(cameras: Iterable[HsvCamera]) -> list[CalibratedView]:
    """The cameras as views of a particle that is the world."""
    return [CalibratedView(camera.intrinsics, camera.R_cam_world, camera.t_cam_world) for camera in cameras]


def stone(folder: Path) -> tuple[list[Outline], list[CalibratedView]]:
    """The six views of the stone; millimetres become metres."""
    outlines, cameras = [], []
    for entry in json.loads((folder / "cameras.json").read_text()):
        outline, size = outline_of(folder / entry["image"])
        metres = np.array(entry["P_zero_based_pixels"]) @ np.diag([1.0, 1.0, 1.0, 1e-3])
        outline, camera = without_skew(metres, outline, size, entry["image"])
        outlines.append(outline)
        cameras.append(camera)
    return outlines, views_of(cameras)


def dinosaur(folder: Path) -> tuple[list[Outline], list[CalibratedView]]:
    """The 36 views of the turntable; the metric matrices are of the mirrored world."""
    matrices = np.load(folder / "P_metric_upgraded_36x3x4.npy")
    names = [f"mask.{i:03d}.png" for i in range(len(matrices))]
    pairs = [without_skew(P, *outline_of(folder / name), name) for P, name in zip(matrices, names, strict=True)]
    cameras, _ = in_front([camera for _, camera in pairs], str(folder))
    return [outline for outline, _ in pairs], views_of(cameras)


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


@dataclass(frozen=True)
class LeftOut:
    """A pose found from other views: ``angle_deg`` of every minimum to the given pose, ``rms_px`` of each, and which of them stand."""

    angle_deg: Array
    rms_px: Array
    given_rms_px: float
    given_protrusion_px: float
    competition: Competition
    focal: FocalPoses | None

    @property
    def by_tangency_deg(self) -> float:
        """Error of the minimum of least cost, containment aside."""
        return float(self.angle_deg[0]) if len(self.angle_deg) else 180.0

    @property
    def chosen_deg(self) -> float:
        """Error of the best minimum that stands; 180 where none does."""
        return float(self.angle_deg[self.competition.rows[0]]) if len(self.competition.rows) else 180.0


def left_out_pose(outlines: list[Outline], views: list[CalibratedView], left: int, others: list[int]) -> LeftOut:
    """The pose of view ``left`` found from ``others``, from nothing; the given pose only judges it."""
    particle = particle_of([outlines[i] for i in others], [views[i] for i in others], CONFIGURATION)
    known = Views(particle.seen, particle.poses, particle.body.com_particle)
    one = silhouettes([outlines[left]], [views[left].intrinsics])
    found = search_pose(one, known, particle.catalogue, EFFORT)
    noise_px, _, _ = pairwise_rms_px(particle.seen, particle.poses, known.centre)
    competition = compete(found, one, known, particle.hull.vertices, noise_px=noise_px)
    R = views[left].R_cam_particle
    rows = competition.rows[:1]
    focal = poses_with_focal(one, found.poses.take(rows), known, FocalPrior(np.inf), floor_px=noise_px) if len(rows) else None
    given = Poses(R[None], (R @ known.centre + views[left].t_cam_particle)[None], np.zeros(1))
    return LeftOut(
        angle_deg=np.degrees(Rotation.from_matrix(found.poses.R @ R.T).magnitude()),
        rms_px=found.rms_px,
        given_rms_px=float(pose_errors(one, given, known).rms_of_each_px[0]),
        given_protrusion_px=float(protrusion_px(one, given, particle.hull.vertices - known.centre)[0]),
        competition=competition,
        focal=focal,
    )


def told(view: LeftOut, view_number: int) -> dict[str, Any]:
    """A left-out view as the result file lists it, with the minima that compete."""
    rows = range(min(MINIMA_TOLD, len(view.rms_px)))
    return {
        "view": view_number,
        "status": str(view.competition.status),
        "error_deg": round(view.chosen_deg, 2),
        "error_by_tangency_alone_deg": round(view.by_tangency_deg, 2),
        "given_pose": {"rms_ete_px": round(view.given_rms_px, 3), "protrusion_px": round(view.given_protrusion_px, 2)},
        "allowed": {"rms_ete_px": round(view.competition.allowed_rms_px, 3), "protrusion_px": round(view.competition.allowed_px, 2)},
        "focal_free": None if view.focal is None else free_focal(view.focal),
        "minima": [
            {
                "from_given_deg": round(float(view.angle_deg[i]), 2),
                "rms_ete_px": round(float(view.rms_px[i]), 3),
                "protrusion_px": round(float(view.competition.protrusion_px[i]), 2),
                "stands": bool(i in view.competition.rows),
            }
            for i in rows
        ],
    }


def free_focal(focal: FocalPoses) -> dict[str, Any]:
    """Focal length over the calibrated one, where it was fitted along with the pose, and its relative standard deviation."""
    return {"over_calibrated": round(float(np.exp(focal.log_factor)), 4), "sigma": round(focal.sigma, 4), "settled": focal.settled}


def focal_of_all(found: list[LeftOut]) -> dict[str, float]:
    """The left-out views' focal lengths over the calibrated ones together: weighted mean, its sigma, the pulls' RMS.

    Where no fit settled there is only their median sigma.
    """
    fitted = [f.focal for f in found if f.focal is not None]
    settled = [f for f in fitted if f.settled]
    if not settled:
        return {"views": 0, "median_sigma_of_one": float(np.median([f.sigma for f in fitted]))}
    logs, sigmas = np.array([f.log_factor for f in settled]), np.array([f.sigma for f in settled])
    weight = sigmas**-2
    mean = float(np.sum(weight * logs) / np.sum(weight))
    return {
        "views": len(settled),
        "over_calibrated": float(np.exp(mean)),
        "sigma": float(np.sum(weight) ** -0.5),
        "median_sigma_of_one": float(np.median(sigmas)),
        "pull_rms": float(np.sqrt(np.mean((logs / sigmas) ** 2))),
    }


def few_views(outlines: list[Outline], views: list[CalibratedView], count: int, rng: np.random.Generator) -> dict[str, float]:
    """Each view found from ``count`` others drawn at random: shares within 5°, by tangency alone and with containment."""
    every = range(len(views))
    found = [left_out_pose(outlines, views, i, sorted(rng.permutation([j for j in every if j != i])[:count].tolist())) for i in every]
    unique = [f for f in found if f.competition.status is Status.CONVERGED]
    return {
        "views": count,
        "within_5_deg_by_tangency_alone": float(np.mean([f.by_tangency_deg <= RIGHT_DEG for f in found])),
        "within_5_deg": float(np.mean([f.chosen_deg <= RIGHT_DEG for f in found])),
        "ambiguous": float(np.mean([f.competition.status is Status.AMBIGUOUS for f in found])),
        "none_stands": float(np.mean([f.competition.status is Status.NO_CONVERGENCE for f in found])),
        "within_5_deg_of_the_unique": float(np.mean([f.chosen_deg <= RIGHT_DEG for f in unique])) if unique else float("nan"),
    }


def study(name: str, outlines: list[Outline], views: list[CalibratedView]) -> dict[str, Any]:
    """All figures of one set."""
    hull = visual_hull(outlines, views, resolution=96)
    solid = trimesh.Trimesh(hull.vertices, hull.faces)
    poses, centre = view_poses(views), np.asarray(solid.center_mass)
    rms, median, pairs = pairwise_rms_px(unsmoothed(outlines, views), poses, centre)
    smooth_rms, smooth_median, _ = pairwise_rms_px(silhouettes(outlines, [v.intrinsics for v in views]), poses, centre)
    every = list(range(len(views)))
    found = [left_out_pose(outlines, views, i, [j for j in every if j != i]) for i in every]
    angles = [f.chosen_deg for f in found]
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
        "left_out_within_5_deg": float(np.mean(np.array(angles) <= RIGHT_DEG)),
        "left_out_by_tangency_alone_within_5_deg": float(np.mean([f.by_tangency_deg <= RIGHT_DEG for f in found])),
        "focal_free": focal_of_all(found),
        "left_out": [told(f, i + 1) for i, f in enumerate(found)],
        "fewer_views": [few_views(outlines, views, c, np.random.default_rng(SEED)) for c in FEWER if c < len(views) - 1],
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
