"""All sets together: where the particle lies in every set, from the tangency errors of every pair of views of different sets.

Set ``i`` has the motion ``x_set = R_i x_particle + t_i``; the first set stays where it is, which fixes the gauge. A small motion ``xi_i``
moves the particle as set ``i`` sees it along the particle's axes about a pivot. Moving it in all sets alike changes nothing: the error of
a view of set ``i`` with a view of set ``j`` has the derivative ``J`` by ``xi_i`` and ``-J`` by ``xi_j``: one Jacobian serves both.

One outline's noise enters the pairs with all others. The covariance is therefore the sandwich ``H⁻¹ M H⁻¹`` [White 1982]: ``M`` adds up
what the noise of every tangent does to the gradient; it is alike at neighbouring tangents of one outline
(:mod:`estimator.fitting.correlated_sums`).
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.correlated_sums import AlongOutlines
from estimator.fitting.levenberg_marquardt import NormalEquations, Outcome, Problem, minimise
from estimator.fitting.noise_model import normal_angle
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.rotation import rotation_from_vector

Array = NDArray[np.float64]
POSE = 6


@dataclass(frozen=True)
class Placements:
    """Where the particle lies in s sets: ``R`` (s, 3, 3), ``t`` (s, 3) m map particle to set coordinates."""

    R: Array
    t: Array

    def moved(self, steps: Array, pivot: Array) -> "Placements":
        """The particle moved by ``steps`` (s, 6), translation (m) and turn (rad) along its own axes about ``pivot`` (3,)."""
        R = self.R @ rotation_from_vector(steps[:, 3:])
        return Placements(R, self.t + np.einsum("sij,sj->si", self.R, pivot + steps[:, :3]) - R @ pivot)


@dataclass(frozen=True)
class JointTask:
    """What is fitted: n views of s sets.

    ``seen`` and ``in_set`` (from set to camera coordinates) of every view, ``set_of`` (n,) which set it is of, ``pivot`` (3,) m in the
    particle's frame, ``used`` (n,) which views count; errors beyond ``huber`` standard deviations keep a constant influence.
    """

    seen: Silhouettes
    in_set: PoseSet
    set_of: NDArray[np.int64]
    pivot: Array
    used: NDArray[np.bool_]
    huber: float

    @property
    def pairs(self) -> Array:
        """Weight (n, n) of pairs, each once: 1 for used views of different sets."""
        across = self.set_of[:, None] != self.set_of[None, :]
        return np.triu(across & self.used[:, None] & self.used[None, :]).astype(np.float64)

    def poses(self, at: Placements) -> PoseSet:
        """From particle to camera coordinates, of every view."""
        R_set, t_set = at.R[self.set_of], at.t[self.set_of]
        t = np.einsum("nij,nj->ni", self.in_set.R, t_set) + self.in_set.t
        return PoseSet(np.ascontiguousarray(self.in_set.R @ R_set), np.ascontiguousarray(t))

    def errors(self, at: Placements, pairs: Array | None = None) -> TangencyErrors:
        """Errors of all ``pairs`` (those of different sets where none are given), derivatives along the particle's axes."""
        poses = self.poses(at)
        weight = self.pairs if pairs is None else pairs
        return tangency_errors(self.seen, poses, self.seen, poses, pivot_particle=self.pivot, axes=poses.R, weight=weight)


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
    """Refine the placements of all sets but the first, from ``start``; one set alone stays as it is."""
    sets = len(start.R)
    if sets < 2:
        return Joint(start, np.zeros((POSE * sets,) * 2), 1.0, True)
    problem = Problem(
        cost=lambda at: _cost(task, at),
        linearise=lambda at: _equations(_linear(task, at)[1]),
        move=lambda at, step: at.moved(np.concatenate([np.zeros(POSE), step]).reshape(sets, POSE), task.pivot),
    )
    solution = minimise(problem, start)
    errors, linear = _linear(task, solution.state)
    mean_square = float(np.mean(linear.z2)) if len(linear.z2) else float("inf")
    covariance = np.zeros((POSE * sets,) * 2)
    covariance[POSE:, POSE:] = _sandwich(task, errors, linear) * max(mean_square, 1.0)
    return Joint(solution.state, covariance, mean_square, solution.outcome is not Outcome.STALLED)


def _robust(z2: Array, huber: float) -> tuple[Array, Array]:
    """Cost and weight of squared standardised errors [Huber 1964]."""
    z = np.sqrt(z2)
    far = z > huber
    return np.where(far, huber * z - 0.5 * huber**2, 0.5 * z2), np.where(far, huber / np.maximum(z, huber), 1.0)


def _cost(task: JointTask, at: Placements) -> float:
    errors = task.errors(at)
    told = errors.told
    return 0.5 * float(_robust(errors.error[told] ** 2 / errors.variance[told], task.huber)[0].sum())


def _linear(task: JointTask, at: Placements) -> tuple[TangencyErrors, _Linear]:
    """The errors and their derivatives; the four of a pair are two measurements seen twice, so each has half a weight."""
    errors = task.errors(at)
    a, b, side = np.nonzero(errors.told)
    e, variance = errors.error[a, b, side], errors.variance[a, b, side]
    z2 = e**2 / variance
    m, sets = len(e), len(at.R)
    J = np.zeros((m, sets, POSE))
    own = errors.jacobian[a, b, side, :POSE]
    J[np.arange(m), task.set_of[a]] = own
    J[np.arange(m), task.set_of[b]] = -own
    weight = 0.5 * _robust(z2, task.huber)[1] / variance
    return errors, _Linear(e, J.reshape(m, POSE * sets)[:, POSE:], weight, z2, (a, b, side))


def _equations(linear: _Linear) -> NormalEquations:
    weighted = linear.J * linear.weight[:, None]
    cost = 0.5 * float(np.sum(linear.weight * linear.e**2))
    return NormalEquations(weighted.T @ linear.J, weighted.T @ linear.e, cost)


def _sandwich(task: JointTask, errors: TangencyErrors, linear: _Linear) -> Array:
    """``H⁻¹ M H⁻¹``: the noise of each tangency moves its own error and, with the other sign and magnified, its partner's."""
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
    meat = AlongOutlines(outline, angle, sigma, sigma**2, task.seen.correlation_rad).covariance(along)
    inverse = np.linalg.inv(_equations(linear).H)
    return np.asarray(inverse @ meat @ inverse)


def with_views(task: JointTask, used: NDArray[np.bool_]) -> JointTask:
    """The task with these views alone."""
    return replace(task, used=used)
