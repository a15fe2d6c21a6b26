"""Poses and the focal length together: the parameters ``X = [f, Q, t]`` of the published method, one ``f`` shared by all sightings.

Levenberg-Marquardt over ``ln f`` and six pose parameters per sighting; with a single sighting these are the paper's eight, the
quaternion's length aside. The principal point stays where the camera says (the image's centre unless given).

``f`` and the distance ``z`` of a particle of size ``s`` are told apart by perspective alone, of order ``s / z``, so with tangents known
to ``e`` px, the particle ``p`` px wide, one sighting gives ``ln f`` to about ``(e / p) (z / s) / sqrt(number of tangents)``: a 6 mm
particle 0.6 m away, 60 px wide with tangents to 0.1 px, to some per cent; a long lens of the calibration rig, not at all. So ``sigma``
always comes with the value, and a prior (the lens's engraving) takes over where the pictures are silent.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.data.views import Poses, Views
from estimator.fitting.focal_flight import LONGEST_STEP, with_focal_column
from estimator.fitting.levenberg_marquardt import Descent, NormalEquations, Outcome, minimise
from estimator.geometry.epipolar_tangency import TangencyErrors
from estimator.geometry.focal_derivative import focal_derivative, with_focal
from estimator.geometry.silhouettes import Silhouettes
from estimator.likelihood.composite_likelihood import shared_view_noise, weigh
from estimator.motion.rotation import rotation_from_vector
from estimator.poses.pose_refinement import mean_cost, pose_errors, pose_set

Array = NDArray[np.float64]
MOST_STEPS = 60
"""Of a search over focal lengths: steps are bounded, so a focal length of half takes some. By judgement."""


@dataclass(frozen=True)
class FocalPrior:
    """What is known of ``ln f``, relative to the camera's: zero to within ``sigma`` (infinite: nothing)."""

    sigma: float

    @property
    def precision(self) -> float:
        """Information of the prior."""
        return self.sigma**-2


@dataclass(frozen=True)
class FocalPoses:
    """``log_factor``: natural logarithm of the focal length over the camera's, and its standard deviation ``sigma``.

    ``poses`` (n) and plain ``rms_px`` (n,) at that focal length; ``settled`` says whether the fit converged.
    """

    log_factor: float
    sigma: float
    poses: Poses
    rms_px: Array
    settled: bool


@dataclass(frozen=True)
class _State:
    R: Array
    centre: Array
    log_factor: float


def poses_with_focal(
    first: Silhouettes, start: Poses, views: Views, prior: FocalPrior, *, floor_px: float = 0.0, huber: float = np.inf
) -> FocalPoses:
    """Fit the poses of all silhouettes ``first`` and the focal length they share, from ``start`` at the camera's focal length."""
    problem = Descent(
        cost=lambda s: _cost(first, s, views, prior, huber),
        linearise=lambda s: _linearise(first, s, views, prior, huber),
        move=_moved,
    )
    solution = minimise(problem, _State(start.R, start.centre_cam, 0.0), max_steps=MOST_STEPS)
    at = solution.state
    seen = with_focal(first, at.log_factor)
    errors = _errors(seen, at, views, huber)
    poses = Poses(at.R, at.centre, mean_cost(errors))
    sigma = _sigma(seen, at, views, prior, floor_px)
    return FocalPoses(at.log_factor, sigma, poses, pose_errors(seen, poses, views).rms_of_each_px, solution.outcome is Outcome.CONVERGED)


def _errors(seen: Silhouettes, at: _State, views: Views, huber: float) -> TangencyErrors:
    return pose_errors(seen, Poses(at.R, at.centre, np.zeros(len(at.R))), views, huber=huber)


def _by_focal(seen: Silhouettes, at: _State, views: Views, errors: TangencyErrors) -> Array:
    return focal_derivative(seen, pose_set(at.R, at.centre, views.centre), views.silhouettes, views.poses, errors)


def _total(errors: TangencyErrors, at: _State, prior: FocalPrior) -> float:
    """Cost of data and prior; of pairs without tangents as much as the others have, so that losing pairs never pays."""
    valid = int(errors.valid.sum())
    data = float(errors.cost.sum()) * errors.valid.size / valid if valid else np.inf
    return data + 0.5 * prior.precision * at.log_factor**2


def _cost(first: Silhouettes, at: _State, views: Views, prior: FocalPrior, huber: float) -> float:
    return _total(_errors(with_focal(first, at.log_factor), at, views, huber), at, prior)


def _linearise(first: Silhouettes, at: _State, views: Views, prior: FocalPrior, huber: float) -> NormalEquations:
    """Normal equations of 6 n pose parameters and ``ln f``, the poses' blocks from the kernel."""
    seen = with_focal(first, at.log_factor)
    errors = _errors(seen, at, views, huber)
    by_focal = _by_focal(seen, at, views, errors)
    z = np.abs(errors.error) / np.sqrt(errors.variance)
    weight = 0.5 * np.minimum(1.0, huber / np.maximum(z, 1e-12)) / errors.variance * errors.valid[:, :, None]
    n = len(at.R)
    H, g = np.zeros((6 * n + 1, 6 * n + 1)), np.zeros(6 * n + 1)
    mixed = np.einsum("nkm,nkm,nkma->na", weight, by_focal, errors.jacobian[..., :6])
    for i in range(n):
        block = slice(6 * i, 6 * i + 6)
        H[block, block], g[block] = errors.normal[i, :6, :6], errors.gradient[i, :6]
        H[block, -1] = H[-1, block] = mixed[i]
    H[-1, -1] = float(np.sum(weight * by_focal**2)) + prior.precision
    g[-1] = float(np.sum(weight * by_focal * errors.error)) + prior.precision * at.log_factor
    return NormalEquations(H, g, _total(errors, at, prior))


def _moved(at: _State, step: Array) -> _State:
    """A step cut to ``LONGEST_STEP`` of ``ln f``."""
    step = step * min(1.0, LONGEST_STEP / max(abs(float(step[-1])), 1e-300))
    pose = step[:-1].reshape(-1, 6)
    return _State(rotation_from_vector(pose[:, 3:]) @ at.R, at.centre + pose[:, :3], at.log_factor + float(step[-1]))


def _sigma(seen: Silhouettes, at: _State, views: Views, prior: FocalPrior, floor_px: float) -> float:
    """Standard deviation of ``ln f``: sandwich of the composite likelihood, each outline's noise counted once; inflated by a bad fit."""
    n = len(at.R)
    errors = _errors(seen, at, views, np.inf)
    errors = with_focal_column(errors, _by_focal(seen, at, views, errors))
    S = np.zeros((n, 9, 6 * n + 1))
    for i in range(n):
        S[i, :6, 6 * i : 6 * i + 6] = np.eye(6)
    S[:, 8, -1] = 1.0
    frames = weigh(errors, S, seen, floor_px=floor_px, huber=np.inf)
    known = np.zeros_like(frames.H)
    known[-1, -1] = prior.precision
    inflation = max(1.0, frames.mean_square)
    bread = _inverse(frames.H + known)
    meat = inflation * (frames.meat + shared_view_noise(errors, frames.weighted, views.silhouettes)) + known
    return float(np.sqrt((bread @ meat @ bread)[-1, -1]))


def _inverse(H: Array) -> Array:
    scale = 1.0 / np.sqrt(np.maximum(np.diag(H), 1e-300))
    return np.asarray(np.linalg.pinv(H * scale[:, None] * scale) * scale[:, None] * scale)
