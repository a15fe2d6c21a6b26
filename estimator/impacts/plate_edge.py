"""The edge of a plate in the background, and whether a stated plane is turned against it.

A plate seen from its side shows an edge that lies in its plane and across the viewing direction. One impact tells little of a plane that is
turned about the very point of contact: of 10° turns, 5% show by the gap and 2% by friction that would do work. The edge tells turns
about the viewing direction to 0.6°; a lean towards the camera it does not show.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline

Array = NDArray[np.float64]
EDGE_RAD = 0.01
"""Standard deviation of an outline's edge from the direction of the plane's own, in the picture."""
YAW_RAD = 0.2
"""How far the edge may be off the picture's plane; it shows as a tilt where the plate is seen from above."""
MOST_SIGMAS = 3.5
"""Standard deviations by which a stated plate may be off its seen edge: chance exceeds it once in two thousand."""


def edge_direction(cameras: Sequence[HsvCamera], outlines: Sequence[Outline | None], place_world: Array) -> Array | None:
    """Direction (3,), unit, world frame, of the plate's edge nearest to where the particle is seen; ``None`` where no camera sees a plate.

    The edge is taken to lie across the viewing direction, as that of a plate seen from its side does.
    ``place_world`` (3,) m.
    """
    for camera, outline in zip(cameras, outlines, strict=False):
        if outline is None or len(outline.points_px) < 3:
            continue
        points = camera.intrinsics.normalise(outline.points_px)
        seen = camera.R_cam_world @ place_world + camera.t_cam_world
        a, b = points, np.roll(points, -1, axis=0)
        along = b - a
        length = np.linalg.norm(along, axis=1)
        share = np.clip(np.sum((seen[:2] / seen[2] - a) * along, axis=1) / np.maximum(length, 1e-12) ** 2, 0.0, 1.0)
        away = np.linalg.norm(a + share[:, None] * along - seen[:2] / seen[2], axis=1)
        nearest = int(np.argmin(np.where(length > 0.0, away, np.inf)))
        return np.asarray(camera.R_cam_world.T @ np.append(along[nearest] / length[nearest], 0.0))
    return None


def edge_sentence(observation: Observation, place_world: Array) -> str | None:
    """What to say of a stated plate that is turned against its edge near ``place_world`` (3,) m; ``None`` where it is not."""
    plate, edge = observation.plate, edge_direction(observation.cameras, observation.plate_outlines, place_world)
    if plate is None or edge is None:
        return None
    camera = next(c for c, o in zip(observation.cameras, observation.plate_outlines, strict=False) if o is not None)
    elevation = abs(float(plate.normal_world @ camera.R_cam_world[2]))
    turn, sigma = abs(float(plate.normal_world @ edge)), float(np.hypot(np.hypot(EDGE_RAD, plate.normal_sigma_rad), YAW_RAD * elevation))
    if turn <= MOST_SIGMAS * sigma:
        return None
    return (
        f"the stated plate contradicts the picture: its plane is turned by {np.degrees(np.arcsin(min(turn, 1.0))):.1f} ± "
        f"{np.degrees(sigma):.1f}° against the edge of the plate's outline."
    )
