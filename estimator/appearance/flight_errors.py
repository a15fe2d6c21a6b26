"""Tangency errors of all sightings under a flight, and where on the body they lie."""

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import FitTask, Sightings
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.outline_bias import without_bias
from estimator.motion.clocked import frames_and_sensitivity, true_times
from estimator.motion.flight import Flight, FlightPoses, Motion, flown

Array = NDArray[np.float64]


def flown_in(motion: Motion, sightings: Sightings) -> FlightPoses:
    """Poses (m = 1) in the sightings' frames."""
    return flown(motion, true_times(motion, sightings.camera, sightings.times_s))


def sensitivity_in(motion: Motion, sightings: Sightings) -> tuple[FlightPoses, Array]:
    """Poses (m = 1) in the sightings' frames and their sensitivity (n, 6, p)."""
    return frames_and_sensitivity(motion, sightings.camera, sightings.times_s)


def particle_poses(flight: Flight, predicted: FlightPoses, sightings: Sightings, *, scale: float = 1.0) -> PoseSet:
    """Particle to camera coordinates for each sighting, of the first of the predicted flights; ``scale``: its size over that calibrated."""
    R_world_particle = predicted.R[:, 0] @ flight.body.R_particle_body.T
    R_cw = sightings.R_cam_world
    R = R_cw @ R_world_particle
    centre = np.einsum("nij,nj->ni", R_cw, predicted.centre[:, 0]) + sightings.t_cam_world
    centre = centre / scale
    return PoseSet(np.ascontiguousarray(R), np.ascontiguousarray(centre - R @ flight.body.com_particle))


def body_normals(sightings: Sightings, R_cam_body: Array, errors: TangencyErrors) -> Array:
    """Outward normals (n, k, 2, 3) of the tangent planes in body axes: where on the body each tangency lies.

    The plane through the camera's centre and the image line ``u . (p - p0) = 0`` has the normal ``(f u, -f u . xy)``, ``xy`` the
    normalised tangency point [Hartley and Zisserman 2004, eq. 8.2].
    ``R_cam_body`` (n, 3, 3).
    """
    silhouettes = sightings.silhouettes
    across = errors.direction[:, :, :2] * silhouettes.focal_px[:, None, None, :]
    xy = silhouettes.xy[np.maximum(silhouettes.offsets[:-1, None, None] + errors.tangency[:, :, :2], 0)]
    plane = np.concatenate([across, -np.sum(across * xy, axis=3, keepdims=True)], axis=3)
    plane /= np.maximum(np.linalg.norm(plane, axis=3, keepdims=True), 1e-12)
    return np.asarray(np.einsum("nij,nkmi->nkmj", R_cam_body, plane))


def errors_of(task: FitTask, flight: Flight, predicted: FlightPoses) -> TangencyErrors:
    """ETE of every sighting with every view under a flight, its outline offset taken off the variance-weighted errors."""
    errors = tangency_errors(
        task.sightings.silhouettes,
        particle_poses(flight, predicted, task.sightings),
        task.views.silhouettes,
        task.views.poses,
        pivot_particle=flight.body.com_particle,
        axes=task.sightings.R_cam_world,
        weight=task.weight,
        huber=task.huber,
        offset_px=-flight.offset_px,
    )
    return errors


def unbiased_errors(task: FitTask, flight: Flight, predicted: FlightPoses) -> TangencyErrors:
    """Those errors less the outlines' predicted bias; the whitened sums ``normal``, ``gradient`` and ``cost`` still contain it."""
    return without_bias(errors_of(task, flight, predicted), task.bias)
