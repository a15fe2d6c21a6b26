"""All sets together: where the particle lies in every set, from the tangency errors of every pair of views of different sets.

Set ``i`` has the motion ``x_set = R_i x_particle + t_i``; the first set stays where it is, which fixes the gauge. A small motion ``xi_i``
moves the particle as set ``i`` sees it along the particle's axes about a pivot. Moving it in all sets alike changes nothing: the error of
a view of set ``i`` with a view of set ``j`` has the derivative ``J`` by ``xi_i`` and ``-J`` by ``xi_j``: one Jacobian serves both.

One outline's noise enters the pairs with all others. The covariance is therefore the sandwich ``H⁻¹ M H⁻¹`` [White 1982]: ``M`` adds up
what the noise of every tangent does to the gradient; it is alike at neighbouring tangents of one outline
(:mod:`estimator.likelihood.correlated_sums`).
"""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.levenberg_marquardt import Descent, NormalEquations, Outcome, minimise
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.silhouettes import Silhouettes
from estimator.likelihood.correlated_sums import AlongOutlines
from estimator.likelihood.noise_model import normal_angle
from estimator.motion.rotation import rotation_from_vector, rotation_vector

Array = NDArray[np.float64]
POSE = 6
"""Numbers of a pose."""


@dataclass(frozen=True)
class Placements:
    """Where the particle lies in s sets: ``R`` (s, 3, 3), ``t`` (s, 3) m map particle to set coordinates.

    ``rig_R`` (c, 3, 3) and ``rig_t`` (c, 3) m: by how much c cameras of the rig are turned and moved from where its calibration has them,
    along their own axes.
    """

    R: Array
    t: Array
    rig_R: Array = field(default_factory=lambda: np.zeros((0, 3, 3)))
    rig_t: Array = field(default_factory=lambda: np.zeros((0, 3)))

    def moved(self, steps: Array, pivot: Array) -> "Placements":
        """The particle moved by ``steps`` (s, 6), translation (m) and turn (rad) along its own axes about ``pivot`` (3,) m."""
        R = self.R @ rotation_from_vector(steps[:, 3:])
        return replace(self, R=R, t=self.t + np.einsum("sij,sj->si", self.R, pivot + steps[:, :3]) - R @ pivot)

    def with_cameras_moved(self, steps: Array) -> "Placements":
        """The cameras' corrections changed by ``steps`` (c, 6), translation (m) and turn (rad) along the cameras' axes."""
        return replace(self, rig_R=rotation_from_vector(steps[:, 3:]) @ self.rig_R, rig_t=self.rig_t + steps[:, :3])

    @property
    def corrections(self) -> Array:
        """The cameras' corrections (c, 6): m and rad."""
        return np.concatenate([self.rig_t, rotation_vector(self.rig_R)], axis=1)

    def take(self, rows: NDArray[np.int64]) -> "Placements":
        """The sets ``rows`` (k,) alone."""
        return replace(self, R=self.R[rows], t=self.t[rows])


@dataclass(frozen=True)
class RigErrors:
    """Cameras that several sets share and whose calibration may be off.

    ``camera_of`` (n,): which of c cameras a view is of, -1 where of none. Its correction turns about ``pivot`` (c, 3) m, camera
    coordinates, the middle of where the particle lay, and has the standard deviations ``sigma`` (c, 6), m and rad.
    """

    camera_of: NDArray[np.int64]
    pivot: Array
    sigma: Array


@dataclass(frozen=True)
class JointTask:
    """What is fitted: n views of s sets.

    ``seen`` and ``in_set`` (from set to camera coordinates) of every view, ``set_of`` (n,) which set it is of, ``pivot`` (3,) m in the
    particle's frame, ``used`` (n,) which views count; errors beyond ``huber`` standard deviations keep a constant influence. ``rig``: what
    may be off of it; then views of one set tell of it, too.
    """

    seen: Silhouettes
    in_set: PoseSet
    set_of: NDArray[np.int64]
    pivot: Array
    used: NDArray[np.bool_]
    huber: float
    rig: RigErrors | None = None

    @property
    def pairs(self) -> Array:
        """Weight (n, n) of pairs, each once: 1 for used views of different sets or, where the rig may be off, for all that are used."""
        across = (self.set_of[:, None] != self.set_of[None, :]) | (self.rig is not None)
        return np.triu(across & self.used[:, None] & self.used[None, :], 1).astype(np.float64)

    def poses(self, at: Placements) -> PoseSet:
        """From particle to camera coordinates, of every view."""
        R_set, t_set = at.R[self.set_of], at.t[self.set_of]
        R, t = self.in_set.R @ R_set, np.einsum("nij,nj->ni", self.in_set.R, t_set) + self.in_set.t
        if self.rig is not None:
            rows = np.flatnonzero(self.rig.camera_of >= 0)
            c = self.rig.camera_of[rows]
            about = self.rig.pivot[c]
            t[rows] = np.einsum("nij,nj->ni", at.rig_R[c], t[rows] - about) + about + at.rig_t[c]
            R[rows] = at.rig_R[c] @ R[rows]
        return PoseSet(np.ascontiguousarray(R), np.ascontiguousarray(t))

    def errors(self, at: Placements, pairs: Array | None = None) -> TangencyErrors:
        """Errors of all ``pairs`` (those of :attr:`pairs` where none are given), derivatives along the particle's axes.

        ``pairs`` (n, n): their weights.
        """
        poses = self.poses(at)
        weight = self.pairs if pairs is None else pairs
        return tangency_errors(self.seen, poses, self.seen, poses, pivot_particle=self.pivot, axes=poses.R, weight=weight)

    def moved(self, at: Placements, step: Array) -> Placements:
        """The placements of all sets but the first, and the cameras, moved by ``step``.

        ``step`` (p,): six numbers (m, rad) of each set but the first, and of each camera where the rig may be off.
        """
        own = POSE * (len(at.R) - 1)
        placed = at.moved(np.concatenate([np.zeros(POSE), step[:own]]).reshape(-1, POSE), self.pivot)
        return placed.with_cameras_moved(step[own:].reshape(-1, POSE)) if self.rig is not None else placed


@dataclass(frozen=True)
class Joint:
    """The fitted ``placements``; ``covariance`` (6 s, 6 s) of their steps (m, rad; zero for the first set, which is the frame).

    ``mean_square`` of the errors over their expected variance; ``settled``: whether the fit found its minimum.
    """

    placements: Placements
    covariance: Array
    mean_square: float
    settled: bool


@dataclass(frozen=True)
class _Linear:
    """The four errors ``e`` (m,) of all pairs, derivatives ``J`` (m, p), weights (m,), squares over variance, and where each is kept."""

    e: Array
    J: Array
    weight: Array
    z2: Array
    places: tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]


def fit_jointly(task: JointTask, start: Placements) -> Joint:
    """Refine the placements of all sets but the first, and the rig where it may be off, from ``start``; one set alone stays as it is."""
    sets = len(start.R)
    if sets == 1:
        return Joint(start, np.zeros((POSE, POSE)), 1.0, True)
    if task.rig is not None and len(start.rig_R) == 0:
        cameras = len(task.rig.pivot)
        start = replace(start, rig_R=np.tile(np.eye(3), (cameras, 1, 1)), rig_t=np.zeros((cameras, 3)))
    problem = Descent(
        cost=lambda at: _cost(task, at),
        linearise=lambda at: _equations(task, at, _linear(task, at)[1]),
        move=task.moved,
    )
    solution = minimise(problem, start)
    errors, linear = _linear(task, solution.state)
    mean_square = float(np.mean(linear.z2)) if len(linear.z2) else float("inf")
    covariance, own = np.zeros((POSE * sets,) * 2), POSE * (sets - 1)
    covariance[POSE:, POSE:] = _sandwich(task, (errors, linear), solution.state, max(mean_square, 1.0))[:own, :own]
    return Joint(solution.state, covariance, mean_square, solution.outcome is not Outcome.STALLED)


def _robust(z2: Array, huber: float) -> tuple[Array, Array]:
    """Cost and weight of squared standardised errors [Huber 1964]."""
    z = np.sqrt(z2)
    far = z > huber
    return np.where(far, huber * z - 0.5 * huber**2, 0.5 * z2), np.where(far, huber / np.maximum(z, huber), 1.0)


def _cost(task: JointTask, at: Placements) -> float:
    errors = task.errors(at)
    told = errors.told
    return _cost_of(errors.error[told] ** 2 / errors.variance[told], task, at)


def _cost_of(z2: Array, task: JointTask, at: Placements) -> float:
    """The same of squared standardised errors (m,). The linearisation has this cost, too: steps are judged by the fall from it."""
    cost = 0.5 * float(_robust(z2, task.huber)[0].sum())
    return cost if task.rig is None else cost + 0.5 * float(np.sum((at.corrections / task.rig.sigma) ** 2))


def _linear(task: JointTask, at: Placements) -> tuple[TangencyErrors, _Linear]:
    """The errors and their derivatives; the four of a pair are two measurements seen twice, so each has half a weight."""
    errors = task.errors(at)
    a, b, side = np.nonzero(errors.told)
    e, variance = errors.error[a, b, side], errors.variance[a, b, side]
    z2 = e**2 / variance
    m, sets = len(e), len(at.R)
    J = np.zeros((m, sets, POSE))
    own = errors.jacobian[a, b, side, :POSE]
    J[np.arange(m), task.set_of[a]] += own
    J[np.arange(m), task.set_of[b]] -= own
    columns = J.reshape(m, POSE * sets)[:, POSE:]
    if task.rig is not None:
        columns = np.hstack([columns, _by_cameras(task, at, own, (a, b))])
    weight = 0.5 * _robust(z2, task.huber)[1] / variance
    return errors, _Linear(e, columns, weight, z2, (a, b, side))


def _by_cameras(task: JointTask, at: Placements, own: Array, pairs: tuple[NDArray[np.int64], NDArray[np.int64]]) -> Array:
    """Derivatives (m, 6 c) by the cameras' corrections: a camera moved is the particle moved in its views, about another point."""
    assert task.rig is not None
    poses = task.poses(at)
    J = np.zeros((len(own), len(task.rig.pivot), POSE))
    for sign, views in zip((1.0, -1.0), pairs, strict=True):
        rows = np.flatnonzero(task.rig.camera_of[views] >= 0)
        view = views[rows]
        camera = task.rig.camera_of[view]
        back = poses.R[view].transpose(0, 2, 1)
        shift = np.einsum("mi,mij->mj", own[rows, :3], back)
        turn = np.einsum("mi,mij->mj", own[rows, 3:], back)
        arm = poses.R[view] @ task.pivot + poses.t[view] - task.rig.pivot[camera] - at.rig_t[camera]
        J[rows, camera] += sign * np.hstack([shift, turn + np.cross(arm, shift)])
    return J.reshape(len(own), -1)


def _equations(task: JointTask, at: Placements, linear: _Linear) -> NormalEquations:
    weighted = linear.J * linear.weight[:, None]
    H, g, cost = weighted.T @ linear.J, weighted.T @ linear.e, _cost_of(linear.z2, task, at)
    if task.rig is not None:
        own, known = POSE * (len(at.R) - 1), task.rig.sigma.ravel() ** -2.0
        H[own:, own:] += np.diag(known)
        g[own:] += known * at.corrections.ravel()
    return NormalEquations(H, g, cost)


def _sandwich(task: JointTask, fitted: tuple[TangencyErrors, _Linear], at: Placements, more: float) -> Array:
    """``H⁻¹ (more M + Λ) H⁻¹``: the noise of each tangency moves its own error and, with the other sign and magnified, its partner's.

    Λ is the information of what is known of the rig.
    """
    errors, linear = fitted
    weighted = np.zeros((*errors.error.shape, linear.J.shape[1]))
    weighted[linear.places] = linear.J * linear.weight[:, None]
    first = weighted[:, :, :2] + errors.jacobian[:, :, 2:, 6, None] * weighted[:, :, 2:]
    second = weighted[:, :, 2:] + errors.jacobian[:, :, :2, 7, None] * weighted[:, :, :2]
    a, b, side = np.nonzero(errors.told[:, :, :2] | errors.told[:, :, 2:])
    outline = np.concatenate([a, b])
    vertex = np.concatenate([errors.tangency[a, b, side], errors.tangency[a, b, 2 + side]])
    angle = normal_angle(np.concatenate([errors.direction[a, b, side], errors.direction[a, b, 2 + side]]))
    sigma = task.seen.sigma_px[task.seen.offsets[outline] + vertex]
    along = np.concatenate([first[a, b, side], second[a, b, side]])
    meat = more * AlongOutlines(outline, angle, sigma, sigma**2, task.seen.correlation_rad).covariance(along)
    if task.rig is not None:
        own = POSE * (len(at.R) - 1)
        meat[own:, own:] += np.diag(task.rig.sigma.ravel() ** -2.0)
    inverse = np.linalg.inv(_equations(task, at, linear).H)
    return np.asarray(inverse @ meat @ inverse)
