"""The plate of an experiment: where it stands, what is stated of it, and its outline in the picture.

The plate's normal lies in the picture, tilted against the vertical to one side, and is then leaned towards the camera by the elevation from
which the camera sees the surface. The plate itself is a box whose upper face has the target in its middle; particles bounce as if it had no
edge.
"""

from dataclasses import dataclass, replace

import numpy as np
import shapely
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.recipes.recipe import PlateRecipe
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.outline import oriented
from datasets.vocabulary.plate import Plate
from synth.silhouette import exact_outline, outline_mesh

Array = NDArray[np.float64]


@dataclass(frozen=True)
class PlateSetting:
    """The true ``plate``; the ``stated`` one or ``None``; ``corners_world`` (8, 3) m of its box at time zero."""

    plate: Plate
    stated: Plate | None
    corners_world: Float[NDArray[np.float64], "8 3"]


@dataclass(frozen=True)
class Stand:
    """How the plate of one experiment stands: ``tilt_rad`` (signed) and the errors of what is stated, in standard deviations (3,)."""

    tilt_rad: float
    errors: Array


def random_stand(recipe: PlateRecipe, rng: np.random.Generator) -> Stand:
    """Draw the stand of an experiment."""
    tilt = np.deg2rad(rng.uniform(*recipe.tilt_deg)) * rng.choice([-1.0, 1.0])
    return Stand(float(tilt), rng.normal(size=3))


def plate_setting(recipe: PlateRecipe, stand: Stand, up: Array, target: Array, tilt_hidden: dict[str, float]) -> PlateSetting:
    """The plate through ``target`` (3,) m, world frame, which is the camera's; ``up`` (3,) unit, across the viewing direction z.

    ``tilt_hidden``: ``angle`` and ``angle_across`` (rad) by which the true plate stands otherwise than the nominal one.
    """
    normal, across, along = nominal_axes(recipe, stand, up, target)
    hidden = Rotation.from_rotvec(tilt_hidden.get("angle", 0.0) * along) * Rotation.from_rotvec(
        tilt_hidden.get("angle_across", 0.0) * across
    )
    true = Plate(target, hidden.apply(normal), np.array(recipe.velocity_ms))
    width, depth, thickness = np.array(recipe.size_mm) * 1e-3
    signs = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-1.0, 0.0)])
    box = hidden.apply(signs * [width, depth, thickness] @ np.array([across, along, normal]))
    stated = _stated(recipe, replace(true, normal_world=normal), stand, (across, along)) if recipe.stated else None
    return PlateSetting(true, stated, target + box)


def moved(setting: PlateSetting, shift: Array) -> PlateSetting:
    """The setting with everything shifted by ``shift`` (3,) m, world frame."""
    true = replace(setting.plate, point_world=setting.plate.point_world + shift)
    stated = None if setting.stated is None else replace(setting.stated, point_world=setting.stated.point_world + shift)
    return PlateSetting(true, stated, setting.corners_world + shift)


def nominal_axes(recipe: PlateRecipe, stand: Stand, up: Array, target: Array) -> tuple[Array, Array, Array]:
    """Normal, direction across the picture and direction away from the camera of the nominal plate, unit (3,), world frame."""
    view = target / np.linalg.norm(target)
    upright = Rotation.from_rotvec([0.0, 0.0, stand.tilt_rad]).apply(up)
    upright = upright - (upright @ view) * view
    upright /= np.linalg.norm(upright)
    elevation = np.deg2rad(recipe.elevation_deg)
    normal = np.cos(elevation) * upright - np.sin(elevation) * view
    across = np.cross(normal, view)
    across /= np.linalg.norm(across)
    return normal, across, np.cross(across, normal)


def plate_outline(setting: PlateSetting, camera: HsvCamera, intrinsics: Intrinsics, time_s: float) -> Float[NDArray[np.float64], "n 2"]:
    """The plate's outline (px) in the picture of ``camera`` with the true ``intrinsics`` at ``time_s``."""
    vertices, faces = plate_mesh(setting)
    mesh = outline_mesh(vertices + setting.plate.velocity_world * time_s, faces)
    return exact_outline(mesh, intrinsics, camera.R_cam_world, camera.t_cam_world)


def plate_mesh(setting: PlateSetting) -> tuple[Float[NDArray[np.float64], "8 3"], NDArray[np.int64]]:
    """The plate's box at time zero: vertices (m, world frame) and outward faces."""
    hull = trimesh.convex.convex_hull(setting.corners_world)
    return np.asarray(hull.vertices, dtype=np.float64), np.asarray(hull.faces, dtype=np.int64)


def beside_plate(outline_px: Array, plate_px: Array) -> Float[NDArray[np.float64], "n 2"]:
    """What of an outline is seen beside the plate's: its largest part, the same points where they do not meet; (0, 2) where nothing is."""
    outline, plate = shapely.make_valid(shapely.Polygon(outline_px)), shapely.Polygon(plate_px)
    if not shapely.intersects(outline, plate):
        return outline_px
    parts = [part for part in shapely.get_parts(shapely.difference(outline, plate)) if isinstance(part, shapely.Polygon)]
    if not parts:
        return np.zeros((0, 2))
    largest = max(parts, key=lambda part: float(part.area))
    return oriented(np.asarray(shapely.get_coordinates(largest.exterior)[:-1]))


def _stated(recipe: PlateRecipe, nominal: Plate, stand: Stand, axes: tuple[Array, Array]) -> Plate:
    """What was measured of the nominal plate."""
    angle, offset = np.deg2rad(recipe.normal_error_deg), recipe.offset_error_mm * 1e-3
    turn = Rotation.from_rotvec(angle * (stand.errors[0] * axes[0] + stand.errors[1] * axes[1]))
    point = nominal.point_world + offset * stand.errors[2] * nominal.normal_world
    return Plate(point, turn.apply(nominal.normal_world), nominal.velocity_world, float(angle), float(offset))
