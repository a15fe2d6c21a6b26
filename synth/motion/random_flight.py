"""Random free flights during which the whole particle stays in the picture.

Speed and spin are uniform over their ranges; the directions of velocity and spin axis and the orientation are isotropic. The middle
frame lies in the focal plane, and no frame nearer or farther than ``DEPTH`` of its distance. The place in the picture is uniform over
all that keep a ball around the particle within the margin in every frame. A direction for which there is no such place is drawn
again, and after ``DIRECTIONS`` of them the speed too. So the fastest flights run along the picture's diagonal or the optical axis, and
speeds that fit in no direction do not occur. Where the recipe sets the out-of-plane speed apart, the rest of the speed lies in the plane.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.recipes.recipe import MotionRecipe
from datasets.vocabulary.camera import Intrinsics
from synth.motion.free_flight import Start

Array = NDArray[np.float64]

DIRECTIONS = 200
SPEEDS = 50
MARGIN_PX = 8.0
DEPTH = 0.3
"""Share of the focal plane's distance that the particle may be nearer or farther."""


@dataclass(frozen=True)
class Stage:
    """Where flights take place: the camera's picture, the ``distance_m`` of the focal plane and a ball of ``radius_m`` around the particle.

    The world frame is the camera's.
    """

    intrinsics: Intrinsics
    distance_m: float
    radius_m: float
    times_s: Array


def random_start(recipe: MotionRecipe, stage: Stage, rng: np.random.Generator) -> Start:
    """Draw the state at time zero of a flight that stays in the picture at ``stage.times_s``.

    Raises
    ------
    InputError
        Where no flight in the recipe's ranges fits.
    """
    q = Rotation.random(rng=rng).as_quat()
    omega = isotropic(rng) * rng.uniform(*recipe.spin_rads)
    gravity = np.array(recipe.gravity_ms2)
    for _ in range(SPEEDS):
        speed = rng.uniform(*recipe.speed_ms)
        for _ in range(DIRECTIONS):
            v = random_velocity(recipe, speed, rng)
            if v is None:
                continue
            path = v * stage.times_s[:, None] + 0.5 * gravity * stage.times_s[:, None] ** 2
            x = place_in_view(path, stage, rng)
            if x is not None:
                return Start(x, q, v, omega)
    raise InputError(_does_not_fit(recipe, stage))


def isotropic(rng: np.random.Generator) -> Array:
    """A unit vector (3,) uniform on the sphere."""
    v = rng.normal(size=3)
    return np.asarray(v / np.linalg.norm(v), dtype=np.float64)


def random_velocity(recipe: MotionRecipe, speed_ms: float, rng: np.random.Generator) -> Array | None:
    """A velocity (3,) m/s at time zero of that speed; ``None`` where the part of it along the axis that was drawn is larger."""
    if recipe.out_of_plane_ms is None:
        return isotropic(rng) * speed_ms
    angle = rng.uniform(0, 2 * np.pi)
    v_z = rng.uniform(*recipe.out_of_plane_ms) * rng.choice([-1.0, 1.0])
    if abs(v_z) > speed_ms:
        return None
    across = np.sqrt(speed_ms**2 - v_z**2)
    return np.array([across * np.cos(angle), across * np.sin(angle), v_z])


def place_in_view(path: Array, stage: Stage, rng: np.random.Generator) -> Array | None:
    """A start (3,) m, uniform over those with which ``path`` (frame, 3) m stays in view; ``None`` where there is none."""
    camera, r = stage.intrinsics, stage.radius_m
    z = stage.distance_m + path[:, 2] - path[len(path) // 2, 2]
    if np.abs(z - stage.distance_m).max() + r > DEPTH * stage.distance_m:
        return None
    start = np.array([0.0, 0.0, z[0] - path[0, 2]])
    for axis, (focal, centre, size) in enumerate(
        ((camera.fx_px, camera.cx_px, camera.width_px), (camera.fy_px, camera.cy_px, camera.height_px))
    ):
        lowest = np.max((MARGIN_PX - centre) / focal * (z - r) + r - path[:, axis])
        highest = np.min((size - 1 - MARGIN_PX - centre) / focal * (z - r) - r - path[:, axis])
        if lowest > highest:
            return None
        start[axis] = rng.uniform(lowest, highest)
    return start if ball_in_view(start + path, stage) else None


def ball_in_view(centres: Array, stage: Stage) -> bool:
    """Whether the corners of a cube about the ball are projected, with distortion, into the picture in every frame."""
    corners = stage.radius_m * np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    px = stage.intrinsics.project((centres[:, None] + corners).reshape(-1, 3))
    size = np.array([stage.intrinsics.width_px, stage.intrinsics.height_px])
    return bool(np.all(px > 0) and np.all(px < size - 1))


def _does_not_fit(recipe: MotionRecipe, stage: Stage) -> str:
    width_mm = 1e3 * stage.intrinsics.width_px / stage.intrinsics.fx_px * stage.distance_m
    seconds = float(np.ptp(stage.times_s))
    return (
        f"no flight stays in the picture for {len(stage.times_s)} frames ({1e3 * seconds:.1f} ms): the picture shows {width_mm:.0f} mm, "
        f"the particle measures up to {2e3 * stage.radius_m:.1f} mm, motion.speed_ms is {list(recipe.speed_ms)}; "
        "expected a flight that fits: lower motion.speed_ms or motion.frames, or raise motion.frame_rate_hz or hsv.distance_m"
    )
