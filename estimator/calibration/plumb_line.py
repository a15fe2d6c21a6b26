"""The direction of gravity from pictures of a plumb line.

A thread and a camera's centre span a plane; gravity lies in it. Two planes that are not alike (two cameras, or threads at two places of a
picture) give the direction: the unit vector g that minimises ``sum (n . g)^2 / var(n . g)`` over the planes' normals n.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.special import chdtrc

from datasets.errors import InputError
from datasets.vocabulary.camera import HsvCamera
from estimator.calibration.fitting import DISHONEST_P
from estimator.geometry.robust_scale import robust_sigma

Array = NDArray[np.float64]

FEWEST_POINTS = 10
"""Of a thread: a line has two parameters, and the rest says how noisy points are."""
STRAIGHT_SIGMAS = 4.0
"""Points of a thread farther off its line than this many robust standard deviations (a knot, dust) are left out."""
LEAST_CONTRAST = 6.0
"""How far a thread stands out of its row, in robust standard deviations of the row."""
HALF_WIDTH_PX = 6
"""Half the width around the strongest pixel of a row in which the thread's centre is taken."""
WORST_RAD = np.deg2rad(10.0)
"""Standard deviation of the direction beyond which it is refused: one camera alone sees no lean towards itself."""


@dataclass(frozen=True)
class Thread:
    """Points (n, 2) px of a plumb line in a picture of ``camera``, and a ``name`` for messages."""

    camera: int
    points_px: Float[NDArray[np.float64], "n 2"]
    name: str


@dataclass(frozen=True)
class Down:
    """The unit vector of gravity in the world and its covariance; by which ``factor`` that was widened since threads disagree."""

    direction_world: Float[NDArray[np.float64], "3"]
    covariance: Float[NDArray[np.float64], "3 3"]
    factor: float


def thread_in(grey: NDArray[np.uint8], camera: int, name: str) -> Thread:
    """The thread of a picture: a line darker or brighter than its surroundings all along the rows, or along the columns.

    ``grey`` (height, width).

    Raises
    ------
    InputError
        Where there is none.
    """
    ways = [_ridge(grey), _ridge(grey.T)[:, ::-1]]
    found = max(ways, key=len)
    if len(found) < max(FEWEST_POINTS, min(grey.shape) // 4):
        raise InputError(f"{name}: expected a plumb line across the picture, darker or brighter than what is behind it, got none.")
    return Thread(camera, found, name)


def _ridge(grey: NDArray[np.uint8]) -> Array:
    """Centres (n, 2) px of what stands out of each row most, where it stands out."""
    values = grey.astype(np.float64)
    off = values - np.median(values, axis=1, keepdims=True)
    noise = np.maximum(robust_sigma(off.T), 1.0)
    columns = np.arange(grey.shape[1])
    points = []
    for row in range(len(off)):
        peak = int(np.argmax(np.abs(off[row])))
        if abs(off[row, peak]) > LEAST_CONTRAST * noise[row]:
            part = slice(max(peak - HALF_WIDTH_PX, 0), peak + HALF_WIDTH_PX + 1)
            weight = np.maximum(off[row, part] * np.sign(off[row, peak]) - 2 * noise[row], 0.0)
            points.append([float((weight * columns[part]).sum() / weight.sum()), float(row)])
    return _on_one_line(np.array(points).reshape(-1, 2))


def _on_one_line(points: Array) -> Array:
    """Those points that lie on the line that most of them share."""
    for _ in range(5):
        if len(points) < FEWEST_POINTS:
            return points[:0]
        slope, offset = np.polyfit(points[:, 1], points[:, 0], 1)
        away = points[:, 0] - slope * points[:, 1] - offset
        away = away - np.median(away)
        kept = np.abs(away) <= STRAIGHT_SIGMAS * max(float(robust_sigma(away)), 0.05)
        if kept.all():
            break
        points = points[kept]
    return points


def gravity_direction(threads: Sequence[Thread], cameras: Sequence[HsvCamera], turns: Sequence[Array]) -> Down:
    """Gravity's direction in the world, towards the lower half of the first thread's picture.

    Parameters
    ----------
    threads
        Two or more.
    cameras
        That they were seen by.
    turns
        Of each camera the covariance (3, 3) rad^2 of its small turn in its own frame.

    Raises
    ------
    InputError
        Where threads do not fix the direction.
    """
    planes = [_plane(thread, cameras[thread.camera], turns[thread.camera]) for thread in threads]
    normals, covariances = np.stack([n for n, _ in planes]), np.stack([C for _, C in planes])
    g = np.linalg.eigh(normals.T @ normals)[1][:, 0]
    for _ in range(5):
        variances = np.einsum("i,kij,j->k", g, covariances, g)
        values, vectors = np.linalg.eigh((normals / variances[:, None]).T @ normals)
        g = vectors[:, 0]
    spread = float(1 / np.sqrt(max(values[1], 1e-300)))
    if len(threads) < 2 or not spread < WORST_RAD:
        raise InputError(
            f"{threads[0].name}: expected a plumb line seen from two directions (two cameras, or at two places of the picture), which "
            f"fixes gravity to {np.rad2deg(WORST_RAD):.0f} degrees, got {len(threads)} that leave it unknown by "
            f"{np.rad2deg(min(spread, np.pi)):.2g}."
        )
    rest = float(((normals @ g) ** 2 / variances).sum())
    free = len(threads) - 2
    widened = free > 0 and chdtrc(free, rest) < DISHONEST_P
    factor = float(np.sqrt(rest / free)) if widened else 1.0
    down = cameras[threads[0].camera].R_cam_world.T @ np.array([0.0, 1.0, 0.0])
    across = vectors[:, 1:]
    covariance = across @ np.diag(1 / values[1:]) @ across.T * factor**2
    return Down(g * (1.0 if g @ down >= 0 else -1.0), covariance, factor)


def _plane(thread: Thread, camera: HsvCamera, turn: Array) -> tuple[Array, Array]:
    """Normal of the plane of a thread in the world, and its covariance."""
    lens = camera.intrinsics
    if len(thread.points_px) < FEWEST_POINTS:
        raise InputError(f"{thread.name}: expected {FEWEST_POINTS} points of a plumb line or more, got {len(thread.points_px)}.")
    rays = np.column_stack([lens.normalise(thread.points_px), np.ones(len(thread.points_px))])
    values, vectors = np.linalg.eigh(rays.T @ rays)
    normal = vectors[:, 0]
    noise = max(values[0] / (len(rays) - 2), (1e-3 / lens.fx_px) ** 2)  # a thousandth of a pixel: points without noise, as tests have them
    across = vectors[:, 1:]
    own = across @ np.diag(noise / np.maximum(values[1:], 1e-300)) @ across.T
    x, y, z = normal
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    R = camera.R_cam_world
    return R.T @ normal, R.T @ (own + cross @ turn @ cross.T) @ R
