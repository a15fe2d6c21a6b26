"""What a laboratory has on its first day, drawn: boards before a rig and a high-speed camera, drops of a stone in the rig, a film.

Pictures are painted from exact outlines and boards (each pixel's covered area, blur, sensor noise;
:func:`scripts.benchmarks.bench_estimate.painted`, :mod:`synth.targets.board_pictures`), not traced by a renderer: seconds instead of an
hour. Lenses of the rig are distorted and its cameras mounted to 3 degrees, both unknown to whoever measures; so is how the stone lies in
each drop.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial.transform import Rotation

from datasets.recipes.recipe import MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe
from datasets.truth_files import write_truth
from datasets.video.writing import Recorded, write_cine
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline
from scripts.benchmarks.bench_estimate import BIT_DEPTH, painted
from scripts.trials.study_calibration import BOARD, FIELD_M, SIZE, STEEPEST, drawn_cameras, drawn_placement
from synth.plan import SequencePlan
from synth.sequence import hsv_outlines, plan_sequence, truth_of
from synth.silhouette import exact_outline, outline_mesh
from synth.targets.board_pictures import FULL_DN, GROUND, Look, board_picture

Array = NDArray[np.float64]
Pose = tuple[Array, Array]
NAME = "drop"
"""Of the film, and so of the sequence."""
SPREAD_M = 1e-3
"""Standard deviation of a drop's place in the rig along each axis."""
TILT_RAD = 0.8
"""By which the board is tilted before the high-speed camera at most: a lens this long shows its focal length by tilts alone."""


def recipe_of(*, frames: int, seed: int) -> Recipe:
    """A cut stone of 12 mm that falls past the camera."""
    return Recipe(
        seed=seed,
        particle=ParticleRecipe(irregularity=0.6, size_mm=(12.0, 12.0)),
        motion=MotionRecipe(frames=frames, speed_ms=(0.3, 1.0), spin_rads=(100.0, 200.0)),
        noise=NoiseRecipe(hsv_boundary_px=0.0),
    )


def draw_everything(folder: Path, *, placements: int, drops: int, frames: int, seed: int) -> None:
    """Write ``boards/cam0`` to ``cam5``, ``boards/hsv``, ``drops/01`` and so on, ``drop.cine`` and, apart, ``truth``."""
    rng = np.random.default_rng(seed)
    recipe = recipe_of(frames=frames, seed=seed)
    plan = plan_sequence(recipe, 0)
    rig = drawn_cameras(rng)
    poses = [drawn_placement(rig, rng) for _ in range(placements)]
    for camera in rig:
        draw_boards(folder / "boards" / camera.name, camera, poses, rng)
    distance_m = recipe.hsv.distance_m
    draw_boards(folder / "boards" / "hsv", plan.hsv, [before_camera(distance_m, rng) for _ in range(placements)], rng)
    for number in range(1, drops + 1):
        draw_drop(folder / "drops" / f"{number:02d}", plan, rig, rng)
    draw_film(folder / f"{NAME}.cine", plan, recipe, rng)
    truth = truth_of(plan)
    write_truth(type(truth)(**{**vars(truth), "name": NAME}), folder / "truth" / NAME)


def draw_boards(folder: Path, camera: HsvCamera, poses: Sequence[Pose], rng: np.random.Generator) -> None:
    """A picture for each place of the board; of empty ground where the camera does not see it from within 60 degrees."""
    folder.mkdir(parents=True)
    size = (camera.intrinsics.height_px, camera.intrinsics.width_px)
    for number, (R, t) in enumerate(poses):
        R_cam, t_cam = camera.R_cam_world @ R, camera.R_cam_world @ t + camera.t_cam_world
        empty = np.clip(GROUND * FULL_DN + rng.normal(0.0, Look().noise_dn, size), 0, 255).astype(np.uint8)
        shown = R_cam[2, 2] > STEEPEST
        picture = board_picture(BOARD, camera.intrinsics, (R_cam, t_cam), Look(), rng) if shown else empty
        Image.fromarray(picture).save(folder / f"{number:02d}.png")


def before_camera(distance_m: float, rng: np.random.Generator) -> Pose:
    """A place of the board before a camera at the origin, tilted about both of its sides."""
    R = Rotation.from_euler("zxy", [rng.uniform(0, 2 * np.pi), *rng.uniform(-TILT_RAD, TILT_RAD, 2)]).as_matrix()
    middle = np.array([*rng.normal(0, 0.2 * BOARD.size_m[0], 2), distance_m * rng.uniform(0.9, 1.1)])
    return R, middle - R @ np.array([*(0.5 * np.array(BOARD.size_m)), 0.0])


def draw_drop(folder: Path, plan: SequencePlan, rig: Sequence[HsvCamera], rng: np.random.Generator) -> None:
    """The stone in the middle of the rig, as every camera sees it, however it came to lie."""
    folder.mkdir(parents=True)
    mesh = outline_mesh(plan.view_vertices, plan.faces)
    R = Rotation.random(rng=rng).as_matrix()
    middle = np.array([0.0, 0.0, rig[0].intrinsics.fx_px * FIELD_M / SIZE[0]]) + rng.normal(0.0, SPREAD_M, 3)
    t = middle - R @ plan.body.com_particle
    for camera in rig:
        pose = camera.R_cam_world @ R, camera.R_cam_world @ t + camera.t_cam_world
        picture = painted(Outline(exact_outline(mesh, camera.intrinsics, *pose)), SIZE[::-1], rng)
        Image.fromarray((picture >> (BIT_DEPTH - 8)).astype(np.uint8)).save(folder / f"{camera.name}.png")


def draw_film(path: Path, plan: SequencePlan, recipe: Recipe, rng: np.random.Generator) -> None:
    """The flight as a Phantom camera writes it: packed 12 bit, stamps at the start of each exposure, of which times are the middle."""
    size = (recipe.hsv.height_px, recipe.hsv.width_px)
    pictures = [painted(outline, size, rng) for outline in hsv_outlines(plan, recipe.noise, rng)]
    how = Recorded(recipe.motion.frame_rate_hz, recipe.hsv.exposure_us * 1e-6, depth=BIT_DEPTH)
    write_cine(path, pictures, how, bits=BIT_DEPTH, stamps_s=plan.clock.times_s - 0.5 * how.exposure_s)
