"""The trajectory fit: one flight to all silhouettes of a sequence.

Each silhouette contributes an 8x8 normal matrix in its own pose and outline offset; with ``S_i = d pose_i / d parameters`` the whole
fit's is ``sum S_iᵀ H_i S_i``. The cost of a step is thus independent of the number of parameters.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera
from estimator.fitting.levenberg_marquardt import NormalEquations, Outcome, Problem, Solution, minimise
from estimator.fitting.pose_refinement import Views
from estimator.geometry.closed_curves import unit_circle
from estimator.geometry.epipolar_tangency import N_COLUMNS, PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.outline_bias import OutlineBias, without_bias
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.flight import COM, INERTIA, N_PARAMETERS, OFFSET, Flight, FlightPoses, moved, poses, poses_and_sensitivity
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
OUTWARD: Array = unit_circle(720)
"""Directions (720, 2) in the picture, half a degree apart, from the x axis on: an arc of 100 px is known to 0.001 px."""


@dataclass(frozen=True)
class Sightings:
    """The silhouettes of a sequence that are used: hull ``n`` was seen by camera ``camera[n]`` in frame ``frame[n]`` at ``times_s[n]``.

    ``outlines_px`` (v, 2) of each with its hollows, as seen; none where they are not known.
    """

    silhouettes: Silhouettes
    camera: NDArray[np.int64]
    frame: NDArray[np.int64]
    times_s: Array
    cameras: tuple[HsvCamera, ...]
    outlines_px: tuple[Array, ...] = ()

    def __len__(self) -> int:
        return len(self.frame)

    @cached_property
    def furthest_px(self) -> Array:
        """Points (n, a, 2) px of the outlines that lie furthest along :data:`OUTWARD`."""
        outlines = (self.silhouettes.points_px[self.silhouettes.slice_of(i)] for i in range(len(self)))
        return np.stack([points[np.argmax(points @ OUTWARD.T, axis=0)] for points in outlines])

    @cached_property
    def rows_px(self) -> Array:
        """Middle (n,) of the rows that the outlines cover, px below the camera's middle row."""
        y = self.furthest_px[..., 1]
        middle = np.array([(c.intrinsics.height_px - 1) / 2 for c in self.cameras])[self.camera]
        return np.asarray(0.5 * (y.min(axis=1) + y.max(axis=1)) - middle)

    @property
    def R_cam_world(self) -> Array:
        """Rotation (n, 3, 3) from world to the camera of each sighting."""
        return np.stack([c.R_cam_world for c in self.cameras])[self.camera]

    @property
    def t_cam_world(self) -> Array:
        """Translation (n, 3) m from world to the camera of each sighting."""
        return np.stack([c.t_cam_world for c in self.cameras])[self.camera]

    def take(self, rows: NDArray[np.int64]) -> "Sightings":
        """The sightings ``rows`` alone."""
        outlines = tuple(self.outlines_px[i] for i in rows) if self.outlines_px else ()
        silhouettes = self.silhouettes.take(rows.tolist())
        return Sightings(silhouettes, self.camera[rows], self.frame[rows], self.times_s[rows], self.cameras, outlines)


@dataclass(frozen=True)
class Prior:
    """Standard deviations of what free flight alone would leave loose.

    ``com_m``: centre of mass (m); ``inertia`` and ``inertia_products``: inertia on and off the diagonal, relative; ``offset_px``: outline
    offset.
    """

    com_m: float
    inertia: float
    inertia_products: float
    offset_px: float

    @property
    def precision(self) -> Array:
        """Diagonal (21,) of the prior's information matrix."""
        diagonal = np.zeros(N_PARAMETERS)
        diagonal[COM] = self.com_m**-2
        diagonal[INERTIA] = [self.inertia**-2] * 2 + [self.inertia_products**-2] * 3
        diagonal[OFFSET] = self.offset_px**-2
        return diagonal


@dataclass(frozen=True)
class FitTask:
    """What a trajectory fit needs besides a start; ``weight`` (sighting, view), 0 leaves a pair out.

    ``bias`` of the outlines, where predicted, is for the last refinement (:func:`unbiased_errors`); earlier fits do without.
    """

    sightings: Sightings
    views: Views
    prior: Prior
    huber: float
    weight: Array
    bias: OutlineBias | None = None


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


WINDOW_GROWTH = 2.5
FIRST_WINDOW = 9


def fit_growing(task: FitTask, start: Flight) -> Solution[Flight]:
    """Fit the sightings nearest the reference time, then more and more of them: a small error of the spin never gets a turn ahead."""
    order = np.argsort(np.abs(task.sightings.times_s - start.time_s), kind="stable")
    count, flight = FIRST_WINDOW * len(task.sightings.cameras), start
    while count < len(order):
        flight = fit(restricted(task, np.sort(order[:count])), flight, max_steps=10, tolerance=1e-3).state
        count = int(count * WINDOW_GROWTH)
    return fit(task, flight)


def restricted(task: FitTask, rows: NDArray[np.int64]) -> FitTask:
    """The same task with the sightings ``rows`` alone."""
    bias = task.bias.take(rows) if task.bias is not None else None
    return FitTask(task.sightings.take(rows), task.views, task.prior, task.huber, task.weight[rows], bias)


def fit(task: FitTask, start: Flight, *, max_steps: int = 25, tolerance: float = 1e-5) -> Solution[Flight]:
    """Levenberg-Marquardt from ``start``; of infinite cost where that cannot be flown."""
    problem = Problem(
        cost=lambda flight: _cost(task, flight),
        linearise=lambda flight: _linearise(task, flight),
        move=moved,
    )
    try:
        return minimise(problem, start, max_steps=max_steps, tolerance=tolerance)
    except RanAway:
        return Solution(start, NormalEquations(np.eye(N_PARAMETERS), np.zeros(N_PARAMETERS), np.inf), Outcome.STALLED, 0)


def pose_map(sensitivity: Array) -> Array:
    """``S`` (n, 8, p): pair columns (pose, offset of the sighting, offset of the view) by parameters, the first 21 those of a flight."""
    S = np.zeros((len(sensitivity), N_COLUMNS, sensitivity.shape[2]))
    S[:, :6] = sensitivity
    S[:, 6, OFFSET] = -1.0
    return S


def data_cost(task: FitTask, errors: TangencyErrors) -> float:
    """Cost scaled up for pairs without tangent planes, so that losing pairs never pays."""
    wanted = np.count_nonzero(task.weight)
    valid = np.count_nonzero(errors.valid)
    return float(errors.cost.sum()) * wanted / valid if valid else np.inf


def prior_cost(task: FitTask, flight: Flight) -> float:
    """Cost of the parameters that the prior holds near zero."""
    p = prior_values(flight)
    return 0.5 * float(p @ (task.prior.precision * p))


def prior_values(flight: Flight) -> Array:
    """Parameters (21,) of a flight that the prior holds near zero."""
    values = np.zeros(N_PARAMETERS)
    values[COM], values[INERTIA], values[OFFSET] = flight.com, flight.inertia, flight.offset_px
    return values


def _cost(task: FitTask, flight: Flight) -> float:
    try:
        predicted = poses(flight, np.zeros((1, N_PARAMETERS)), task.sightings.times_s)
    except RanAway:
        return np.inf
    return data_cost(task, errors_of(task, flight, predicted)) + prior_cost(task, flight)


def _linearise(task: FitTask, flight: Flight) -> NormalEquations:
    predicted, sensitivity = poses_and_sensitivity(flight, task.sightings.times_s)
    errors = errors_of(task, flight, predicted)
    S = pose_map(sensitivity)
    precision = task.prior.precision
    H = np.einsum("nap,nab,nbq->pq", S, errors.normal, S, optimize=True) + np.diag(precision)
    g = np.einsum("nap,na->p", S, errors.gradient) + precision * prior_values(flight)
    return NormalEquations(H=H, g=g, cost=data_cost(task, errors) + prior_cost(task, flight))
