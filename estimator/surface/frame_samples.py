"""Distances of the samples of the high-speed cameras' outlines from those that surface and motion cast, with their derivatives."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from estimator.appearance.flight_errors import flown_in, particle_poses, sensitivity_in
from estimator.data.fit_task import Sightings
from estimator.geometry.epipolar_tangency import PoseSet
from estimator.motion.flight import OFFSET, Motion
from estimator.motion.slow_errors import slow_errors
from estimator.surface.contact import Picture, contacts_of, turned
from estimator.surface.samples import Samples, samples_at
from estimator.surface.star_surface import Seen, Surface, crossed


def samples_of_frames(surface: Surface, sightings: Sightings, motion: Motion) -> Samples:
    """Those of the high-speed cameras' pictures under a motion.

    Outlines move along their normals over a pixel: edges are no longer than that and turn with the noise that drew them, which is no
    information of a turn about the optical axis.
    """
    predicted, sensitivity = sensitivity_in(motion, sightings)
    placed = particle_poses(motion.first, predicted, sightings)
    pictures = pictures_of(sightings, placed)
    met = contacts_of(surface, pictures)
    across, R = met.across(pictures, met.outward), sightings.R_cam_world
    world = turned(across, met.starts, R)
    nearer = np.array([camera.t_cam_world for camera in sightings.cameras])[sightings.camera]
    centre = np.einsum("nij,nj->ni", R, predicted.centre[:, 0]) + nearer
    arm = turned(met.point - np.repeat(centre, np.diff(met.starts), axis=0), met.starts, R)
    by_pose = np.concatenate([-world, crossed(world, arm)], axis=1)
    by_motion = moved_by(by_pose, met.starts, sensitivity)
    by_motion[:, OFFSET] = -1.0
    samples = samples_at(surface, met, turned(across, met.starts, placed.R), by_motion, motion.first.offset_px)
    slow = slow_errors(sightings.times_s, motion).basis
    return replace(samples, by_pose=by_pose, by_slow=moved_by(by_pose, met.starts, slow))


def moved_by(by_pose: NDArray[np.float64], starts: NDArray[np.int64], poses: NDArray[np.float64]) -> NDArray[np.float64]:
    """By how much k parameters move samples (m, k).

    ``by_pose`` (m, 6): derivatives of samples by the pose of their picture, where those of each begin at ``starts`` (n + 1,); ``poses``
    (n, 6, k): those of poses by the parameters.
    """
    parts = zip(pairwise(starts.tolist()), poses, strict=True)
    return np.concatenate([by_pose[a:b] @ each for (a, b), each in parts])


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
