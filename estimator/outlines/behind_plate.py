"""Frames in which a plate hides a part of the particle: their outline runs along that of the plate, and is not the particle's there.

What lies within the plate's outline in the background is not told from it, so a particle seen in front of a plate is cut there as one
behind it is. Where more than :data:`LEAST_ALONG_PX` of an outline lie within :data:`BESIDE_PX` of the plate, only the rest of it is
used, and none where that bounds the particle in less than half of all directions. A corner that touches the plate's edge has less, and
loses less than outlines are unsure of.
"""

import numpy as np
import shapely
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from datasets.observation import Observation
from datasets.vocabulary.camera import HsvCamera
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.plate import Plate
from estimator.outlines.result import FrameStatus, OutlineTrack, in_part

BESIDE_PX, LEAST_ALONG_PX = 1.0, 20.0
"""Of particles 40 to 70 px across, that a plate seen from 0.5° hides by less than a pixel, 6 to 18 px lie beside it."""


def beside_plate(track: OutlineTrack, observation: Observation, number: int) -> OutlineTrack:
    """The outlines of camera ``number`` without frames of which the plate hides a part."""
    plate = observation.plate_outlines[number] if observation.plate_outlines else None
    if plate is None or len(plate.points_px) < 3:
        return track
    times, frames = observation.clock_of(number).times_s, []
    for frame, time_s in zip(track.frames, times, strict=True):
        there = plate.points_px + moved_px(observation.plate, observation.cameras[number], float(time_s - observation.clock.times_s[0]))
        frames.append(in_part(frame, along(frame.outline, there), FrameStatus.HIDDEN, most_px=LEAST_ALONG_PX) if frame.seen else frame)
    return OutlineTrack(tuple(frames))


def moved_px(plate: Plate | None, camera: HsvCamera, gone_s: float) -> Float[NDArray[np.float64], "2"]:
    """How far (2,) px a plate that moves has moved in the picture since the first frame."""
    if plate is None or not plate.velocity_world.any():
        return np.zeros(2)
    places = plate.point_world + np.outer([0.0, gone_s], plate.velocity_world)
    seen = camera.intrinsics.project(places @ camera.R_cam_world.T + camera.t_cam_world)
    return np.asarray(seen[1] - seen[0])


def along(outline: Outline, plate_px: Float[NDArray[np.float64], "m 2"]) -> Bool[NDArray[np.bool_], " n"]:
    """Points (n,) of an outline from which it goes on within or beside the plate's."""
    beside = shapely.distance(shapely.points(outline.points_px), shapely.make_valid(shapely.Polygon(plate_px))) <= BESIDE_PX
    return np.asarray(beside & np.roll(beside, -1))
