"""Distances of the samples of the high-speed cameras' outlines from those that surface and motion cast, with their derivatives."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.appearance.flight_errors import flown_in, particle_poses, sensitivity_in
from estimator.data.fit_task import Sightings
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.motion.flight import OFFSET, Motion
from estimator.surface.contact import Picture, contacts_of
from estimator.surface.samples import Samples, across_of, stacked
from estimator.surface.star_surface import Seen, Surface


def samples_of_frames(surface: Surface, sightings: Sightings, motion: Motion, further: NDArray[np.float64] | None = None) -> Samples:
    """Those of the high-speed cameras' pictures under a motion.

    ``further`` (n, 6, k): what k more parameters do to the poses, translation (m) and left rotation vector, world frame. Outlines move
    along their normals over a pixel: edges are no longer than that and turn with the noise that drew them, which is no information of a
    turn about the optical axis.
    """
    predicted, sensitivity = sensitivity_in(motion, sightings)
    sensitivity = sensitivity if further is None else np.concatenate([sensitivity, further], axis=2)
    placed = particle_poses(motion.first, predicted, sightings)
    parts = []
    for k, met in enumerate(contacts_of(surface, pictures_of(sightings, placed))):
        camera = sightings.cameras[int(sightings.camera[k])]
        across = across_of(replace(met, normal=met.outward), camera.intrinsics)
        world = across @ camera.R_cam_world
        arm = (met.point - camera.t_cam_world) @ camera.R_cam_world - predicted.centre[k, 0]
        by_motion = -np.concatenate([world, np.cross(arm, world)], axis=1) @ sensitivity[k]
        by_motion[:, OFFSET] = -1.0
        parts.append((met, across @ placed.R[k], by_motion))
    return stacked(surface, parts, motion.first.offset_px)


def pictures_of(sightings: Sightings, placed: PoseSet) -> list[Picture]:
    """The samples that are the particle's edge in every sighting, and the camera that sees the particle ``placed``."""
    lenses = [sightings.cameras[int(k)].intrinsics for k in sightings.camera]
    return [Picture(lens, placed.R[k], placed.t[k], sightings.sure_px(k)) for k, lens in enumerate(lenses)]


def seen_under(motion: Motion, sightings: Sightings) -> list[Seen]:
    """The outlines that are whole, and cameras that see the particle at rest as a motion shows it."""
    placed = particle_poses(motion.first, flown_in(motion, sightings), sightings)
    return [
        (
            Outline(sightings.outlines_px[k]),
            CalibratedView(sightings.cameras[int(sightings.camera[k])].intrinsics, placed.R[k], placed.t[k]),
        )
        for k in range(len(sightings))
        if not (sightings.unsure and sightings.unsure[k].any())
    ]
