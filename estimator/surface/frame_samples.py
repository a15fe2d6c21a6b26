"""Distances of the samples of the high-speed cameras' outlines from those that surface and motion cast, with their derivatives."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.appearance.flight_errors import flown_in, particle_poses, sensitivity_in
from estimator.data.fit_task import Sightings
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.motion.flight import OFFSET, Motion
from estimator.surface.contact import Picture, contacts_of, turned
from estimator.surface.samples import Samples, samples_at
from estimator.surface.star_surface import Seen, Surface, crossed


def samples_of_frames(surface: Surface, sightings: Sightings, motion: Motion, further: NDArray[np.float64] | None = None) -> Samples:
    """Those of the high-speed cameras' pictures under a motion.

    ``further`` (n, 6, k): what k more parameters do to the poses, translation (m) and left rotation vector, world frame. Outlines move
    along their normals over a pixel: edges are no longer than that and turn with the noise that drew them, which is no information of a
    turn about the optical axis.
    """
    predicted, sensitivity = sensitivity_in(motion, sightings)
    sensitivity = sensitivity if further is None else np.concatenate([sensitivity, further], axis=2)
    placed = particle_poses(motion.first, predicted, sightings)
    pictures = pictures_of(sightings, placed)
    met = contacts_of(surface, pictures)
    across, R = met.across(pictures, met.outward), sightings.R_cam_world
    world = turned(across, met.starts, R)
    nearer = np.array([camera.t_cam_world for camera in sightings.cameras])[sightings.camera]
    centre = np.einsum("nij,nj->ni", R, predicted.centre[:, 0]) + nearer
    arm = turned(met.point - np.repeat(centre, np.diff(met.starts), axis=0), met.starts, R)
    by_pose = np.concatenate([-world, crossed(world, arm)], axis=1)
    parts = zip(pairwise(met.starts.tolist()), sensitivity, strict=True)
    by_motion = np.concatenate([by_pose[a:b] @ each for (a, b), each in parts])
    by_motion[:, OFFSET] = -1.0
    return samples_at(surface, met, turned(across, met.starts, placed.R), by_motion, motion.first.offset_px)


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
