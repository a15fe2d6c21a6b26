"""Pairs within the sequence: the body must cast all of its silhouettes, not only each one agree with the calibrated views.

Both poses of such a pair move. The derivative by the second's pose, or by its focal length, is that of the exchanged pair, in which upper
and lower tangency change places. Their noise is already in the pairs with views, so together they are given the weight of one pair per
sighting.

Silhouettes seen from nearly the same or opposite sides are no pair (:mod:`estimator.fitting.viewing_angles`): the fit would turn the
body until their noise agrees best. In sequences that turned by less than 7° this gave angular velocities up to 15 standard deviations off.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.flight_errors import particle_poses
from estimator.data.fit_task import FitTask, Sightings
from estimator.fitting.focal_flight import LOG_FOCAL
from estimator.fitting.viewing_angles import sines_between
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.focal_derivative import focal_derivative
from estimator.motion.flight import OFFSET, Flight, FlightPoses, Motion

Array = NDArray[np.float64]
MOST_SIGHTINGS = 40
"""Sightings, spread evenly, of which pairs within the sequence are made: 780 pairs, of which ``within_pairs`` are used. By judgement."""
LEAST_SINE = 0.17
"""Of the angle between the directions from which the body is seen in a pair; 0.09 to 0.5 measured nearly alike (notebook 7)."""


@dataclass(frozen=True)
class WithinEquations:
    """Weighted normal matrix ``H`` (p, p) and gradient ``g`` (p,) of the pairs within the sequence, their number and plain RMS (px)."""

    H: Array
    g: Array
    pairs: int
    rms_px: float


def within_equations(
    task: FitTask, motion: Motion, predicted: FlightPoses, S: Array, *, most_pairs: int, floor_px: float
) -> WithinEquations:
    """Equations of at most ``most_pairs`` pairs among evenly spread sightings; ``S`` (n, 8, p) as in :func:`pose_map`.

    Pairs seen from too nearly one line are left out and their weight with them.
    """
    p, flight = S.shape[2], motion.first
    rows = np.unique(np.linspace(0, len(task.sightings) - 1, min(MOST_SIGHTINGS, len(task.sightings))).round().astype(np.int64))
    chosen = _pairs(len(rows), most_pairs)
    sightings = task.sightings.take(rows)
    poses = particle_poses(flight, FlightPoses(predicted.centre[rows], predicted.R[rows]), sightings)
    weight = np.zeros((len(rows), len(rows)))
    weight[chosen[:, 0], chosen[:, 1]] = sines_between(poses, poses, flight.body.com_particle)[chosen[:, 0], chosen[:, 1]] >= LEAST_SINE
    forth = _errors(sightings, poses, weight, flight)
    back = _errors(sightings, poses, weight.T.copy(), flight)
    i, j = np.argwhere(forth.valid & back.valid.T).T
    if len(i) == 0:
        return WithinEquations(np.zeros((p, p)), np.zeros(p), 0, 0.0)
    map_i, map_j = S[rows[i]], S[rows[j]]
    J = np.einsum("rma,rap->rmp", forth.jacobian[i, j, :2, :6], map_i[:, :6])
    J += np.einsum("rma,rap->rmp", back.jacobian[j, i][:, [3, 2], :6], map_j[:, :6])
    J[..., OFFSET.start] -= forth.jacobian[i, j, :2, 6] + forth.jacobian[i, j, :2, 7]
    if LOG_FOCAL in motion.layout.places:
        by_first, by_second = (_by_focal(sightings, poses, errors) for errors in (forth, back))
        J[..., motion.layout[LOG_FOCAL]] += (by_first[i, j, :2] + by_second[j, i][:, [3, 2]])[..., None]
    e = forth.error[i, j, :2] - flight.offset_px * forth.jacobian[i, j, :2, 7]
    if task.bias is not None:
        e = e - task.bias.take(rows).within(forth)[i, j]
    w = (len(rows) / len(chosen)) / (forth.variance[i, j, :2] + floor_px**2)
    z = np.abs(e) / np.sqrt(forth.variance[i, j, :2] + floor_px**2)
    w = w * np.minimum(1.0, task.huber / np.maximum(z, 1e-12))
    H = np.einsum("rmp,rm,rmq->pq", J, w, J)
    return WithinEquations(H, np.einsum("rmp,rm->p", J, w * e), len(i), float(np.sqrt(np.mean(e**2))))


def _errors(sightings: Sightings, poses: PoseSet, weight: Array, flight: Flight) -> TangencyErrors:
    return tangency_errors(
        sightings.silhouettes,
        poses,
        sightings.silhouettes,
        poses,
        pivot_particle=flight.body.com_particle,
        axes=sightings.R_cam_world,
        weight=weight,
        offset_px=-flight.offset_px,
    )


def _by_focal(sightings: Sightings, poses: PoseSet, errors: TangencyErrors) -> Array:
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):  # of a sighting with itself
        return focal_derivative(sightings.silhouettes, poses, sightings.silhouettes, poses, errors)


def _pairs(n: int, most: int) -> NDArray[np.int64]:
    every = np.array([(i, j) for i in range(n) for j in range(i + 1, n)], dtype=np.int64).reshape(-1, 2)
    if len(every) <= most:
        return every
    return every[np.unique(np.linspace(0, len(every) - 1, most).round().astype(np.int64))] if most else every[:0]
