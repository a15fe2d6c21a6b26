"""One row of scores for one sequence: errors, error bars put to the test, and what the sequence was like.

``z`` is out of plane: the world frame is the first HSV camera's. Velocities are compared at the estimate's own instants; where such
an instant lies between two frames of the truth a cubic spline through the truth's frames is used (error about ``dt^4 omega^5 / 384``,
below 1e-4 rad/s at 4000 fps and 300 rad/s; not meant for an instant next to an impact). The true angular velocity is a vector in the
world frame and needs no regard for symmetry.

A sequence without a converged estimate has NaN in every error: it is counted by its status and never by a number.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.special import chdtri, ndtri

from datasets.errors import InputError
from datasets.estimate import Estimate, FrameReport, Status, VelocityEstimate
from datasets.scoring.angles import angles_up_to_symmetry, particle_orientation
from datasets.scoring.efficiency import against_bound
from datasets.scoring.metrics import COMPONENTS, INSTANTS
from datasets.truth import Truth

Array = NDArray[np.float64]
Row = dict[str, Any]

INTERVAL_95 = float(ndtri(0.975))
"""Half width of a 95% interval in standard deviations."""
ELLIPSOID_95 = float(chdtri(3, 0.05))
"""Squared Mahalanobis distance of three components that 95% are within."""
VECTORS = {"v": slice(0, 3), "omega": slice(3, 6)}
"""Which components are those of one vector."""


def score(estimate: Estimate, truth: Truth) -> Row:
    """One tidy row: what the sequence was like, its status, every metric, pulls and interval flags.

    Raises
    ------
    InputError
        When the two are not of the same sequence.
    """
    if estimate.name != truth.name:
        raise InputError(f'the estimate is of sequence "{estimate.name}", the truth of "{truth.name}"; expected the same.')
    row = _description(estimate, truth)
    for instant in INSTANTS:
        velocity: VelocityEstimate | None = getattr(estimate, instant)
        scored = velocity is not None and estimate.status is Status.CONVERGED
        row |= {f"{instant}_{key}": value for key, value in (_velocity(velocity, truth) if scored and velocity else _NO_VELOCITY).items()}
    return row | _against_bound(estimate, truth) | _poses(estimate, truth)


def truth_as_estimate(truth: Truth) -> Estimate:
    """The truth handed in as if it were measured; it scores exactly zero in every error."""
    motion = truth.motion
    middle = (len(motion.times_s) - 1) // 2
    return Estimate(
        name=truth.name,
        status=Status.CONVERGED,
        message="the truth itself",
        body=truth.body,
        motion=motion,
        start=_true_velocity(truth, 0),
        middle=_true_velocity(truth, middle),
        frames=tuple(FrameReport(0, k, True, "", 0.0, 0.0) for k in range(len(motion.times_s))),
        statistics={"n_views": 0},
    )


def _true_velocity(truth: Truth, frame: int) -> VelocityEstimate:
    motion = truth.motion
    zero = np.zeros((6, 6))
    return VelocityEstimate(float(motion.times_s[frame]), motion.v_world[frame], motion.omega_world[frame], zero, zero)


def _description(estimate: Estimate, truth: Truth) -> Row:
    v, omega = _truth_at(truth, _middle_time(truth))
    used = {(frame.camera, frame.frame) for frame in estimate.frames if frame.used}
    return {
        "sequence": truth.name,
        "particle": str(truth.notes.get("particle", truth.name)),
        "status": estimate.status.value,
        "converged": estimate.status is Status.CONVERGED,
        "n_frames": len(truth.motion.times_s),
        "n_used": len(used),
        "n_views": int(estimate.statistics.get("n_views", 0)),
        "n_symmetries": len(truth.symmetries),
        "irregularity": float(truth.descriptors.get("irregularity", np.nan)),
        "speed_ms": float(np.linalg.norm(v)),
        "spin_rads": float(np.linalg.norm(omega)),
    }


def _middle_time(truth: Truth) -> float:
    times = truth.motion.times_s
    return float(times[(len(times) - 1) // 2])


def _truth_at(truth: Truth, time_s: float) -> tuple[Array, Array]:
    """True v and omega at a time; at a frame's time exactly that frame's."""
    motion = truth.motion
    exact = np.flatnonzero(motion.times_s == time_s)
    if len(exact):
        return motion.v_world[exact[0]], motion.omega_world[exact[0]]
    first, last = float(motion.times_s[0]), float(motion.times_s[-1])
    if not first - 1e-9 <= time_s <= last + 1e-9:
        raise InputError(f'sequence "{truth.name}": expected an instant from {first:g} to {last:g} s, got {time_s:g} s.')
    both = CubicSpline(motion.times_s, np.hstack([motion.v_world, motion.omega_world]))(time_s)
    return both[:3], both[3:]


def _velocity(velocity: VelocityEstimate, truth: Truth) -> Row:
    return velocity_errors(velocity, *_truth_at(truth, velocity.time_s))


def _against_bound(estimate: Estimate, truth: Truth) -> Row:
    """Errors at mid-sequence over the bound that the truth states; no columns where it states none."""
    if truth.bound is None:
        return {}
    velocity = estimate.middle if estimate.status is Status.CONVERGED else None
    return against_bound(None if velocity is None else _error(velocity, *_truth_at(truth, velocity.time_s)), truth.bound)


def _error(velocity: VelocityEstimate, v: Array, omega: Array) -> Array:
    return np.concatenate([velocity.v_world - v, velocity.omega_world - omega])


def velocity_errors(velocity: VelocityEstimate, v: Array, omega: Array) -> Row:
    """Errors of velocities against the true ``v`` (3,) m/s and ``omega`` (3,) rad/s, and their intervals put to the test."""
    error = _error(velocity, v, omega)
    with np.errstate(invalid="ignore"):  # a negative variance is no error bar: NaN, and outside every interval
        sigma, bound = np.sqrt(np.diag(velocity.covariance)), np.sqrt(np.diag(velocity.bound))
    in_plane, out_of_plane, angular = float(np.hypot(error[0], error[1])), abs(float(error[2])), float(np.linalg.norm(error[3:]))
    speed, spin = float(np.linalg.norm(v)), float(np.linalg.norm(omega))
    row: Row = {
        "in_plane_ms": in_plane,
        "out_of_plane_ms": out_of_plane,
        "angular_rads": angular,
        "in_plane_percent": 100 * _ratio(in_plane, speed),
        "out_of_plane_percent": 100 * _ratio(out_of_plane, speed),
        "angular_percent": 100 * _ratio(angular, spin),
        "mahalanobis2": _mahalanobis2(error, velocity.covariance),
        **{f"ellipsoid95_{name}": float(_mahalanobis2(error[k], velocity.covariance[k, k]) <= ELLIPSOID_95) for name, k in VECTORS.items()},
        "sigma_over_bound": _mean_ratio(sigma, bound),
        "sigma_in_plane_percent": 100 * _ratio(float(np.hypot(sigma[0], sigma[1])), speed),
        "sigma_out_of_plane_percent": 100 * _ratio(float(sigma[2]), speed),
        "sigma_angular_percent": 100 * _ratio(float(np.linalg.norm(sigma[3:])), spin),
        "bound_in_plane_percent": 100 * _ratio(float(np.hypot(bound[0], bound[1])), speed),
        "bound_out_of_plane_percent": 100 * _ratio(float(bound[2]), speed),
        "bound_angular_percent": 100 * _ratio(float(np.linalg.norm(bound[3:])), spin),
    }
    for k, name in enumerate(COMPONENTS):
        pull = _ratio(float(error[k]), float(sigma[k]))
        row |= {f"pull_{name}": pull, f"inside95_{name}": float(abs(pull) <= INTERVAL_95)}
        row[f"over_bound_{name}"] = _ratio(abs(float(error[k])), float(bound[k]))
    return row


def _ratio(error: float, scale: float) -> float:
    """``error / scale``; no error is none on any scale, an error on no scale is infinite."""
    if error == 0.0:
        return 0.0
    return error / scale if scale != 0.0 else float(np.copysign(np.inf, error))


def _mean_ratio(sigma: Array, bound: Array) -> float:
    if np.array_equal(sigma, bound):
        return 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        return float(np.exp(np.mean(np.log(sigma) - np.log(bound))))


def _mahalanobis2(error: Array, covariance: Array) -> float:
    """``error^T covariance^-1 error``; infinite where the covariance rules the error out, or is none."""
    if not np.any(error):
        return 0.0
    try:
        whitened = np.linalg.solve(np.linalg.cholesky(covariance), error)
    except np.linalg.LinAlgError:
        return float(np.inf)
    return float(whitened @ whitened)


_NO_VELOCITY: Row = {
    key: float("nan")
    for key in (
        *("in_plane_ms", "out_of_plane_ms", "angular_rads", "in_plane_percent", "out_of_plane_percent", "angular_percent"),
        *("mahalanobis2", "ellipsoid95_v", "ellipsoid95_omega"),
        *("sigma_over_bound", "sigma_in_plane_percent", "sigma_out_of_plane_percent", "sigma_angular_percent"),
        *("bound_in_plane_percent", "bound_out_of_plane_percent", "bound_angular_percent"),
        *(f"{kind}_{name}" for name in COMPONENTS for kind in ("pull", "inside95", "over_bound")),
    )
}


def _poses(estimate: Estimate, truth: Truth) -> Row:
    keys = ("orientation_median_deg", "orientation_max_deg", "position_median_mm", "position_max_mm")
    motion, body = estimate.motion, estimate.body
    if motion is None or body is None or estimate.status is not Status.CONVERGED:
        return dict.fromkeys(keys, float("nan"))
    true_frames = matching_frames(motion.times_s, truth)
    R_truth = particle_orientation(truth.motion, truth.body)[true_frames]
    angle_deg = np.degrees(angles_up_to_symmetry(particle_orientation(motion, body), R_truth, truth.symmetries))
    distance_mm = 1e3 * np.linalg.norm(motion.x_world - truth.motion.x_world[true_frames], axis=1)
    values = (np.median(angle_deg), np.max(angle_deg), np.median(distance_mm), np.max(distance_mm))
    return dict(zip(keys, map(float, values), strict=True))


def matching_frames(times_s: Array, truth: Truth) -> NDArray[np.intp]:
    """The truth's frame for each time (n,) s of an estimate.

    Raises
    ------
    InputError
        Where a time is that of no frame.
    """
    true_times = truth.motion.times_s
    nearest = np.abs(times_s[:, None] - true_times[None, :]).argmin(axis=1)
    apart = np.abs(true_times[nearest] - times_s)
    allowed = 0.01 * float(np.diff(true_times).min()) if len(true_times) > 1 else 1e-9
    if len(times_s) == 0 or apart.max() > allowed:
        raise InputError(
            f'sequence "{truth.name}": expected poses at the frame times of the truth, got times up to {apart.max():g} s apart.'
        )
    return nearest
