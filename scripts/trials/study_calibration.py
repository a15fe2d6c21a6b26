"""How well `tumble calibrate` finds rigs of six cameras from drawn pictures of a ChArUco board, and whether it knows how well.

    python -m scripts.trials.study_calibration --rigs 20

Six cameras of 1024 x 768 px around one place, as in `synth.rig` (axes of an icosahedron, mounted to 3 degrees), lenses of 1800 to 3000 px
with distortion; 60 placements of a board of 12 x 9 squares of 4 mm, each in front of two cameras or more. Pictures are blurred (0.7 px) and
noisy (3 DN of 255). Prints the figures of acceptance and writes them; a stopped run goes on where it was. About a minute a rig.
"""

import argparse
import json
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from datasets.atomic_files import written_whole
from datasets.vocabulary.board import Board
from datasets.vocabulary.calibration import LENS, POSE
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from estimator.calibration.bundle import Rig
from estimator.calibration.fitting import cross_validate, difference, fit_rig
from estimator.calibration.sighting import BoardSighting, find_board
from studies.reporting.words import write_page
from synth.rig import AXES
from synth.targets.board_pictures import Look, board_picture

Array = NDArray[np.float64]
ROOT = Path(__file__).resolve().parents[2]
RESULT = ROOT / "docs" / "results" / "study_calibration.json"
PAGE = ROOT / "docs" / "studies" / "study_calibration.md"
BOARD = Board(12, 9, 4e-3, 2.9e-3, "DICT_5X5_250")
SIZE = (1024, 768)
PLACEMENTS = 60
FOCAL_PX = (1800.0, 3000.0)
FIELD_M = 0.06
"""Width that a camera sees where the board is; the board is 48 mm wide."""
MOUNTING_RAD = np.deg2rad(3.0)
STEEPEST = np.cos(np.deg2rad(60.0))
"""A board turned farther away from a camera is not drawn for it."""


def main() -> None:
    """Run what is missing, write, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rigs", type=int, default=20)
    parser.add_argument("--seed", type=int, default=33)
    parser.add_argument("--result", type=Path, default=RESULT)
    parser.add_argument("--page", type=Path, default=PAGE)
    arguments = parser.parse_args()
    rigs: list[dict[str, Any]] = []
    if arguments.result.exists():
        kept = json.loads(arguments.result.read_text(encoding="utf-8"))
        rigs = kept["rigs"][: arguments.rigs] if kept["seed"] == arguments.seed else []
    for number in range(len(rigs), arguments.rigs):
        rigs.append(one_rig(arguments.seed, number))
        document = {"seed": arguments.seed, "figures": figures(rigs), "rigs": rigs}
        with written_whole(arguments.result) as temporary:
            temporary.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    write_page(page({"seed": arguments.seed, "figures": figures(rigs), "rigs": rigs}), arguments.page)
    print("\n".join(f"{name}: {value}" for name, value in lines(figures(rigs), len(rigs))))


def one_rig(seed: int, number: int) -> dict[str, Any]:
    """Draw a rig and its pictures, calibrate it, and compare."""
    rng = np.random.default_rng([seed, number])
    cameras = drawn_cameras(rng)
    poses = [drawn_placement(cameras, rng) for _ in range(PLACEMENTS)]
    began = time.process_time()
    sightings = tuple(s for c in range(len(cameras)) for s in looked(cameras[c], c, poses, rng))
    drawn = time.process_time()
    fit = fit_rig(sightings, BOARD, (SIZE,) * len(cameras))
    check = cross_validate(fit, BOARD, (SIZE,) * len(cameras))
    off = difference(fit.rig, true_rig(cameras, poses))
    factor = 1.0 if check is None else check.factor
    sigma = np.sqrt(np.diag(fit.covariance)) * factor
    starts = [fit.rig.pose_slice(c).start for c in range(1, len(cameras))]
    turns = [slice(first, first + 3) for first in starts]
    return {
        "pictures": len(sightings),
        "sigma_px": fit.rms_px,
        "left_out": fit.left_out,
        "cross_validation": None if check is None else vars(check),
        "seconds": {"pictures": drawn - began, "fit": time.process_time() - drawn},
        "focal_px": [lens.fx_px for lens in fit.rig.lenses],
        "off": off.tolist(),
        "sigma": sigma.tolist(),
        "rotation_chi_square": [float(off[s] @ np.linalg.solve(fit.covariance[s, s] * factor**2, off[s])) for s in turns],
    }


def drawn_cameras(rng: np.random.Generator) -> list[HsvCamera]:
    """Six cameras in the first one's frame."""
    cameras = []
    for c, axis in enumerate(AXES):
        focal = rng.uniform(*FOCAL_PX)
        centre = 0.5 * (np.array(SIZE) - 1) + rng.normal(0, 10, 2)
        bend = (rng.uniform(-0.25, 0.1), rng.uniform(-0.2, 0.2), *rng.normal(0, 5e-4, 2), 0.0)
        lens = Intrinsics(*SIZE, focal, focal * (1 + rng.normal(0, 1e-3)), *centre, bend)
        z = -axis
        x = np.cross(z, np.eye(3)[np.argmin(np.abs(z))])
        looking = np.array([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z])
        R = Rotation.from_rotvec(rng.normal(0, MOUNTING_RAD, 3)).as_matrix() @ looking
        cameras.append(HsvCamera(f"cam{c}", lens, R, np.array([0.0, 0.0, focal * FIELD_M / SIZE[0]]) + rng.normal(0, 2e-3, 3)))
    first = cameras[0]
    return [
        HsvCamera(c.name, c.intrinsics, R, c.t_cam_world - R @ first.t_cam_world)
        for c in cameras
        for R in [c.R_cam_world @ first.R_cam_world.T]
    ]


def drawn_placement(cameras: Sequence[HsvCamera], rng: np.random.Generator) -> tuple[Array, Array]:
    """A place of the board (world) that at least two cameras see from within 60 degrees."""
    middle = np.array([0.0, 0.0, cameras[0].intrinsics.fx_px * FIELD_M / SIZE[0]])
    while True:
        R = Rotation.random(rng=rng).as_matrix()
        if sum(float((c.R_cam_world @ R)[2, 2]) > STEEPEST for c in cameras) >= 2:
            break
    centre = middle + rng.normal(0, 5e-3, 3)
    return R, centre - R @ np.array([*(0.5 * np.array(BOARD.size_m)), 0.0])


def looked(camera: HsvCamera, number: int, poses: Sequence[tuple[Array, Array]], rng: np.random.Generator) -> list[BoardSighting]:
    """What a camera's pictures show of the board, as `tumble calibrate rig` finds it."""
    found = []
    for p, (R, t) in enumerate(poses):
        R_cam = camera.R_cam_world @ R
        if R_cam[2, 2] > STEEPEST:
            pose = (R_cam, camera.R_cam_world @ t + camera.t_cam_world)
            ids, points = find_board(board_picture(BOARD, camera.intrinsics, pose, Look(), rng), BOARD)
            if len(ids):
                found.append(BoardSighting(number, p, ids, points))
    return found


def true_rig(cameras: Sequence[HsvCamera], poses: Sequence[tuple[Array, Array]]) -> Rig:
    """The truth as a fit has it."""
    R, t = (np.stack([getattr(c, name) for c in cameras]) for name in ("R_cam_world", "t_cam_world"))
    return Rig(tuple(c.intrinsics for c in cameras), R, t, np.stack([R for R, _ in poses]), np.stack([t for _, t in poses]))


def figures(rigs: Sequence[Mapping[str, Any]]) -> dict[str, float]:
    """The figures of acceptance over all rigs."""
    step = len(LENS) + len(POSE)
    lens = [[c * step - (len(POSE) if c else 0) + k for c in range(6)] for k in range(4)]
    off, sigma = (np.array([rig[key] for rig in rigs]) for key in ("off", "sigma"))
    focal = np.array([rig["focal_px"] for rig in rigs])
    share = np.abs(off[:, lens[0] + lens[1]]) / np.tile(focal, 2)
    centre = np.abs(off[:, lens[2] + lens[3]])
    poses = np.array([[c * step + k + len(LENS) - len(POSE) for k in range(6)] for c in range(1, 6)])
    turn = np.rad2deg(np.linalg.norm(off[:, poses[:, :3]], axis=-1))
    place = 1e3 * np.linalg.norm(off[:, poses[:, 3:]], axis=-1)
    inside = np.abs(off) <= 1.959964 * sigma
    joint = np.array([rig["rotation_chi_square"] for rig in rigs]) <= chi2.ppf(0.95, 3)
    checks = [rig["cross_validation"] for rig in rigs if rig["cross_validation"]]
    return {
        "focal_median_percent": 100 * float(np.median(share)),
        "focal_largest_percent": 100 * float(share.max()),
        "focal_share_within": float(np.mean(share < 1e-3)),
        "centre_median_px": float(np.median(centre)),
        "centre_largest_px": float(centre.max()),
        "centre_share_within": float(np.mean(centre < 1.0)),
        "rotation_median_deg": float(np.median(turn)),
        "rotation_largest_deg": float(turn.max()),
        "place_median_mm": float(np.median(place)),
        "inside_focal": float(inside[:, lens[0] + lens[1]].mean()),
        "inside_centre": float(inside[:, lens[2] + lens[3]].mean()),
        "inside_rotation_component": float(inside[:, poses[:, :3]].mean()),
        "inside_place_component": float(inside[:, poses[:, 3:]].mean()),
        "inside_rotation_ellipsoid": float(joint.mean()),
        "honest_share": float(np.mean([check["honest"] for check in checks])) if checks else float("nan"),
        "noise_px": float(np.median([rig["sigma_px"] for rig in rigs])),
        "fit_seconds": float(np.median([rig["seconds"]["fit"] for rig in rigs])),
    }


def lines(found: Mapping[str, float], rigs: int) -> list[tuple[str, str]]:
    """What is printed and stands on the page."""
    focal, centre, turn = (
        f"{found[f'{name}_median_{unit}']:.{digits}f}{shown} in the median, {found[f'{name}_largest_{unit}']:.3g}{shown} at most"
        for name, unit, digits, shown in (("focal", "percent", 4, "%"), ("centre", "px", 3, " px"), ("rotation", "deg", 5, "°"))
    )
    inside = (
        f"focal length {found['inside_focal']:.1%}, principal point {found['inside_centre']:.1%}, "
        f"rotation {found['inside_rotation_component']:.1%} of components and {found['inside_rotation_ellipsoid']:.1%} of ellipsoids, "
        f"place {found['inside_place_component']:.1%}"
    )
    return [
        ("rigs", f"{rigs}, of six cameras each"),
        ("focal length off", f"{focal} ({found['focal_share_within']:.1%} within 0.1%)"),
        ("principal point off (a coordinate)", f"{centre} ({found['centre_share_within']:.1%} within 1 px)"),
        ("relative rotation off", turn),
        ("relative place off", f"{found['place_median_mm']:.4f} mm in the median"),
        ("inside of the own 95% interval", inside),
        ("called honest by the check of two halves, not widened", f"{found['honest_share']:.1%}"),
        ("noise of corners", f"{found['noise_px']:.4f} px"),
        ("CPU time of fit and check", f"{found['fit_seconds']:.1f} s"),
    ]


def page(document: Mapping[str, Any]) -> list[str]:
    """The page's lines."""
    rigs = document["rigs"]
    pictures = int(np.median([rig["pictures"] for rig in rigs]))
    return [
        "# Calibration of six cameras from drawn pictures",
        "",
        f"Rigs of six cameras (1024 x 768 px, focal lengths of {FOCAL_PX[0]:.0f} to {FOCAL_PX[1]:.0f} px, distortion of some pixels)",
        f"on the axes of an icosahedron, {PLACEMENTS} placements of a ChArUco board of 12 x 9 squares of 4 mm, each seen by two",
        f"cameras or more ({pictures} pictures of a rig show it, in the median). They are exact, blurred (0.7 px) and noisy (3 DN).",
        "Not in it: a board that is bent, motion blur, defocus, a lens that Brown-Conrady distortion does not describe. Long lenses",
        "(65,000 px, as the default rig of recipes) show no perspective: no board tells their focal length from their distance.",
        "",
        "| | |",
        "| --- | --- |",
        *(f"| {name} | {value} |" for name, value in lines(document["figures"], len(rigs))),
        "",
        "## Again",
        "",
        "```sh",
        f"python -m scripts.trials.study_calibration --rigs {len(rigs)} --seed {document['seed']}",
        "```",
        "",
        "Results: [every rig](../results/study_calibration.json). A stopped run goes on where it was; this page is written by the command.",
        "",
    ]


if __name__ == "__main__":
    main()
