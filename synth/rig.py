"""The calibration rig: six cameras with long lenses on icosahedral axes, and placements ("drops") of the particle in it.

Six of the twelve vertices of an icosahedron, one per axis, so that any two optical axes enclose 63.4° or 116.6°. The defaults follow
the real rig of Forbes (PhD thesis, University of Cape Town, 2007): focal lengths of 65,000 to 88,000 px, 0.017 mm per pixel, principal
point at the centre of the picture. Cameras are mounted with small errors, which the calibration knows; every drop lies within about a
millimetre of the middle.
"""

from dataclasses import replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.observation import CalibratedView
from datasets.recipes.recipe import RigRecipe
from datasets.vocabulary.camera import Intrinsics

Array = NDArray[np.float64]

GOLDEN = (1 + 5**0.5) / 2
AXES = np.array([[0, 1, GOLDEN], [0, -1, GOLDEN], [1, GOLDEN, 0], [-1, GOLDEN, 0], [GOLDEN, 0, 1], [GOLDEN, 0, -1]]) / np.hypot(1, GOLDEN)
POINTING_ERROR_M = 0.5e-3
"""Standard deviation of the sideways offset of an optical axis from the middle."""
MOUNTING_ERROR_RAD = np.deg2rad(0.5)
DROP_SPREAD_M = 0.5e-3
"""Standard deviation of a drop's place along each axis."""


def rig_views(recipe: RigRecipe, centre_particle: Float[NDArray[np.float64], "3"], rng: np.random.Generator) -> tuple[CalibratedView, ...]:
    """The calibrated views of all drops: drop 0 seen by cameras 0 to 5, drop 1, and so on.

    ``centre_particle`` is the point of the particle (particle frame, m) that comes to lie near the middle of the rig. The optical
    axis passes through the centre of the picture.
    """
    cameras = [_camera(recipe, axis, rng) for axis in AXES]
    return tuple(
        CalibratedView(intrinsics, R_cam_rig @ R_rig_particle, R_cam_rig @ t_rig_particle + t_cam_rig, drop=drop, camera=camera)
        for drop in range(recipe.drops)
        for R_rig_particle, t_rig_particle in [_drop(centre_particle, rng)]
        for camera, (intrinsics, R_cam_rig, t_cam_rig) in enumerate(cameras)
    )


def stated_views(
    recipe: RigRecipe, views: tuple[CalibratedView, ...], vertices: Float[NDArray[np.float64], "v 3"], rng: np.random.Generator
) -> tuple[CalibratedView, ...]:
    """What a calibration says of ``views``, each off by ``recipe.calibration_px``; ``vertices`` of the particle, particle frame, m."""
    if not recipe.calibration_px:
        return views
    centre, radius = 0.5 * (vertices.min(axis=0) + vertices.max(axis=0)), 0.5 * float(np.ptp(vertices, axis=0).max())
    return tuple(miscalibrated(view, centre, radius, recipe.calibration_px, rng) for view in views)


def miscalibrated(
    view: CalibratedView, centre: Float[NDArray[np.float64], "3"], radius: float, off_px: float, rng: np.random.Generator
) -> CalibratedView:
    """A view whose stated pose is off by ``off_px`` in its picture: moved, and turned about ``centre`` (3,) m of a body of ``radius`` (m).

    ``centre`` in the particle frame.
    """
    metre_per_px = float((view.R_cam_particle @ centre + view.t_cam_particle)[2]) / view.intrinsics.fx_px
    turn = Rotation.from_rotvec(rng.normal(0.0, off_px * metre_per_px / radius, 3)).as_matrix()
    shift = np.append(rng.normal(0.0, off_px * metre_per_px, 2), 0.0)
    R = turn @ view.R_cam_particle
    centre_cam = view.R_cam_particle @ centre + view.t_cam_particle + shift
    return replace(view, R_cam_particle=R, t_cam_particle=centre_cam - R @ centre)


def _camera(recipe: RigRecipe, axis: Array, rng: np.random.Generator) -> tuple[Intrinsics, Array, Array]:
    focal = rng.uniform(*recipe.focal_px)
    centre = ((recipe.width_px - 1) / 2, (recipe.height_px - 1) / 2)
    intrinsics = Intrinsics(recipe.width_px, recipe.height_px, focal, focal, *centre)
    roll = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi))
    mounting = Rotation.from_rotvec(rng.normal(0, MOUNTING_ERROR_RAD, size=3))
    R_cam_rig = (mounting * roll * _looking_along(-axis)).as_matrix()
    sideways = rng.normal(0, POINTING_ERROR_M, size=2)
    return intrinsics, R_cam_rig, np.array([*sideways, focal * recipe.mm_per_px * 1e-3])


def _looking_along(direction: Array) -> Rotation:
    """The rotation to a camera frame whose z axis is ``direction`` (unit); which way is up does not matter."""
    x = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    x /= np.linalg.norm(x)
    return Rotation.from_matrix(np.array([x, np.cross(direction, x), direction]))


def _drop(centre_particle: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    R_rig_particle = Rotation.random(rng=rng).as_matrix()
    return R_rig_particle, rng.normal(0, DROP_SPREAD_M, size=3) - R_rig_particle @ centre_particle
