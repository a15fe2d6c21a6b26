"""Frames in which a plate hides a part of the particle: their outline runs along that of the plate, and is not the particle's there.

What lies within the plate's outline in the background is not told from it, so a particle seen in front of a plate is cut there as one
behind it is. A frame is left out where more than :data:`LEAST_ALONG_PX` of its outline lie within :data:`BESIDE_PX` of the plate: a
corner that touches the plate's edge has less, and loses less than outlines are unsure of.
"""

from dataclasses import replace

import numpy as np
import shapely
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.plate import Plate
from estimator.outlines.result import FrameStatus, OutlineTrack

BESIDE_PX, LEAST_ALONG_PX = 1.0, 20.0
"""Of particles 40 to 70 px across, that a plate seen from 0.5° hides by less than a pixel, 6 to 18 px lie beside it."""


def beside_plate(track: OutlineTrack, observation: Observation, number: int) -> OutlineTrack:
    """The outlines of camera ``number`` without frames of which the plate hides a part."""
    plate = observation.plate_outlines[number] if observation.plate_outlines else None
    if plate is None or len(plate.points_px) < 3:
        return track
    times, frames = observation.clock.times_s, []
    for frame, time_s in zip(track.frames, times, strict=True):
        there = plate.points_px + moved_px(observation.plate, observation.cameras[number], float(time_s - times[0]))
        hidden = frame.used and along_px(frame.outline, there) > LEAST_ALONG_PX
        frames.append(replace(frame, status=FrameStatus.HIDDEN) if hidden else frame)
    return OutlineTrack(tuple(frames))


def moved_px(plate: Plate | None, camera: HsvCamera, gone_s: float) -> Float[NDArray[np.float64], "2"]:
    """How far (2,) px a plate that moves has moved in the picture since the first frame."""
    if plate is None or not plate.velocity_world.any():
        return np.zeros(2)
    places = plate.point_world + np.outer([0.0, gone_s], plate.velocity_world)
    seen = camera.intrinsics.project(places @ camera.R_cam_world.T + camera.t_cam_world)
    return np.asarray(seen[1] - seen[0])


def along_px(outline: Outline, plate_px: Float[NDArray[np.float64], "n 2"]) -> float:
    """Length (px) of an outline that lies within or beside the plate's."""
    points = outline.points_px
    beside = shapely.distance(shapely.points(points), shapely.make_valid(shapely.Polygon(plate_px))) <= BESIDE_PX
    lengths = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    return float(lengths[beside & np.roll(beside, -1)].sum())
