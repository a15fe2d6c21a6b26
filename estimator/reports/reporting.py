"""From a refined flight to the estimate a user reads: velocities with covariance, frames with reasons, statistics, versions."""

import dataclasses
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, FrameReport, Status, VelocityEstimate
from datasets.observation import Observation
from datasets.vocabulary.state import Motion
from estimator.data.configuration import Configuration
from estimator.data.versions import versions
from estimator.fitting.adequacy import Misfit
from estimator.fitting.calibration_share import CalibrationShare, calibration_sentence, calibration_statistics
from estimator.fitting.focal_refinement import FocalRefined
from estimator.fitting.refinement import Refined
from estimator.motion.flight import N_PARAMETERS, NAMES, Flight, fitted_body, inertia_matrix, states, velocities, velocity_sensitivity
from estimator.motion.rigid_body import angular_velocity, rotation_matrices
from estimator.motion.rotation import quaternion
from estimator.outlines.result import OutlineTrack
from estimator.particle.particle import Particle
from estimator.poses.pose_search import FoundPoses
from estimator.reports.misfit_words import adequacy_statistics, misfit_sentence

Array = NDArray[np.float64]


def empty_estimate(
    observation: Observation,
    tracks: tuple[OutlineTrack, ...],
    particle: Particle,
    configuration: Configuration,
    outcome: tuple[Status, str],
) -> Estimate:
    """An estimate that says why there is no measurement."""
    status, message = outcome
    return Estimate(
        name=observation.name,
        status=status,
        message=with_views(message, particle),
        frames=frame_reports(tracks, None),
        statistics=view_statistics(particle),
        configuration=dataclasses.asdict(configuration),
        versions=versions(),
    )


def converged_estimate(
    observation: Observation,
    tracks: tuple[OutlineTrack, ...],
    seen: tuple[Particle, FoundPoses],
    refined: Refined,
    outcome: tuple[Status, str, Misfit | None],
    *,
    configuration: Configuration,
    focal: FocalRefined | None = None,
    share: CalibrationShare | None = None,
) -> Estimate:
    """The estimate of a fit that ended with a flight; its numbers are left out where the status says that there is no convergence.

    ``outcome``: status, message and the test of the residuals. ``focal``: the focal length, where it was measured.
    ``share``: what the stated uncertainty of camera and gravity adds.
    """
    particle, found = seen
    status, message, tested = outcome
    statistics = {**view_statistics(particle), **fit_statistics(refined, found), **adequacy_statistics(tested)}
    if status is Status.CONVERGED and tested is not None and not tested.adequate:
        message = misfit_sentence(tested)
    reports = frame_reports(tracks, sighting_errors(refined))
    message = with_views(message, particle)
    if focal is not None:
        statistics["focal_length"] = focal_length(focal, observation, configuration.focal_prior)
        message = f"{message} {statistics['focal_length']['statement']}"
    told: dict[str, Any] = {
        "configuration": dataclasses.asdict(configuration),
        "versions": versions(),
        "frames": reports,
        "statistics": statistics,
    }
    if status is Status.NO_CONVERGENCE:
        return Estimate(name=observation.name, status=status, message=message, **told)
    times = observation.clock.times_s
    middle = _velocity(refined, float(times[(len(times) - 1) // 2]), share)
    if share is not None:
        statistics["calibration"] = calibration_statistics(refined, share, middle)
        message = " ".join(part for part in (message, calibration_sentence(statistics["calibration"])) if part)
    if observation.mass_kg is not None:
        statistics["momenta"] = _momenta(refined.flight, particle, observation.mass_kg, float(times[(len(times) - 1) // 2]))
    return Estimate(
        name=observation.name,
        status=status,
        message=message,
        body=fitted_body(refined.flight),
        motion=motion_of(refined.flight, times),
        start=_velocity(refined, float(times[0]), share),
        middle=middle,
        parameters=NAMES if focal is None else (*NAMES, "log_focal_factor"),
        values=flight_values(refined.flight) if focal is None else np.append(flight_values(refined.flight), focal.log_factor),
        covariance=_covariance(refined, share) if focal is None else focal.covariance,
        bound=refined.bound if focal is None else focal.bound,
        **told,
    )


def motion_of(flight: Flight, times_s: Array) -> Motion:
    """Poses of the fitted body and velocities at ``times_s`` (f,) s."""
    reached = states(flight, np.zeros((1, N_PARAMETERS)), times_s)
    body = fitted_body(flight)
    inverse = np.asarray(np.linalg.inv(inertia_matrix(flight, flight.inertia[None])), dtype=np.float64)
    omega = np.stack([angular_velocity(reached.q[i], reached.L[i], inverse)[0] for i in range(len(times_s))])
    nominal_from_fitted = flight.body.R_particle_body.T @ body.R_particle_body
    return Motion(
        times_s=times_s,
        x_world=reached.x[:, 0],
        q_world_body=quaternion(rotation_matrices(reached.q[:, 0]) @ nominal_from_fitted),
        v_world=reached.v[:, 0],
        omega_world=omega,
    )


def focal_length(focal: FocalRefined, observation: Observation, prior: float) -> dict[str, Any]:
    """The focal length found (px, of x and y), its standard deviation, the camera's own, and what to think of it in a sentence."""
    camera = observation.cameras[0].intrinsics
    factor = float(np.exp(focal.log_factor))
    f, sigma = factor * camera.fx_px, factor * camera.fx_px * focal.sigma
    silent = focal.sigma > SILENT * prior
    return {
        "focal_px": [f, factor * camera.fy_px],
        "sigma_px": [sigma, factor * camera.fy_px * focal.sigma],
        "camera_px": [camera.fx_px, camera.fy_px],
        "prior_relative": prior,
        "statement": f"focal length measured: {f:.0f} ± {sigma:.0f} px (camera: {camera.fx_px:.0f} ± {100 * prior:g}%)"
        + ("; the pictures say hardly anything of it, what holds it is the prior." if silent else "."),
    }


SILENT = 0.8
"""A standard deviation above this share of the prior's means that the pictures had little to say."""


def _covariance(refined: Refined, share: CalibrationShare | None) -> Array:
    """Covariance (21, 21) of the flight's parameters, the calibration's share in it."""
    return refined.covariance if share is None else refined.covariance + share.parameters @ share.parameters.T


def _velocity(refined: Refined, time_s: float, share: CalibrationShare | None = None) -> VelocityEstimate:
    v, omega = velocities(refined.flight, np.zeros((1, N_PARAMETERS)), time_s)
    J = velocity_sensitivity(refined.flight, time_s)
    covariance, bound = J @ refined.covariance @ J.T, J @ refined.bound @ J.T
    if share is not None:
        covariance = covariance + share.covariance(J, time_s - refined.flight.time_s)
    return VelocityEstimate(time_s, v[0], omega[0], 0.5 * (covariance + covariance.T), 0.5 * (bound + bound.T))


def flight_values(flight: Flight) -> Array:
    """Parameter values; the rotation is the increment about the estimated pose, so zero."""
    return np.concatenate([flight.x, np.zeros(3), flight.v, flight.omega, flight.com, flight.inertia, [flight.offset_px]])


def _momenta(flight: Flight, particle: Particle, mass_kg: float, time_s: float) -> dict[str, Any]:
    """Linear (kg m/s) and angular (kg m²/s) momentum in the middle, of the hull's inertia scaled to the mass."""
    at = states(flight, np.zeros((1, N_PARAMETERS)), np.array([time_s]))
    largest = mass_kg * particle.largest_moment_per_mass
    return {"P_world_kgms": (mass_kg * at.v[0, 0]).tolist(), "L_world_kgm2s": (largest * at.L[0, 0]).tolist()}


def view_statistics(particle: Particle) -> dict[str, Any]:
    """What is told of the calibrated views."""
    report = particle.report
    return {
        "n_views": len(particle.calibrated),
        "views_left_out": list(report.left_out),
        "views_without_outline": list(report.without_outline),
        "view_numbers": report.numbers.tolist(),
        "view_rms_ete_px": report.rms_px.tolist(),
        "view_noise_px": float(np.median(particle.seen.noise_px)),
        "view_disagreement": {
            "rms_px": particle.disagreement.rms_px,
            "expected_px": particle.disagreement.expected_px,
            "calibration_px": particle.disagreement.calibration_px,
        },
        "extent_mm": 1e3 * particle.extent_m,
    }


def with_views(message: str, particle: Particle) -> str:
    """A message, which calibrated views were left out, and whether they disagree."""
    return " ".join(part for part in (message, particle.sentence) if part)


def fit_statistics(refined: Refined, found: FoundPoses) -> dict[str, Any]:
    """What is told of a last refinement and of the pose search before it."""
    errors = refined.errors
    return {
        "n_pairs": int(errors.valid.sum()),
        "pairs_without_tangents": int((~errors.valid).sum()),
        "rms_ete_px": errors.rms_px,
        "whitened_mean_square": refined.frames.mean_square,
        "noise_scale": refined.noise.scale,
        "noise_mean_square": refined.noise.mean_square,
        "noise_correlation_rad": refined.noise.correlation_rad,
        "pairs_within_sequence": refined.within.pairs,
        "rms_ete_within_px": refined.within.rms_px,
        "competing_minima": [{"rms_ete_px": float(r), "cost": float(c)} for r, c in zip(found.rms_px, found.poses.cost, strict=True)],
    }


def sighting_errors(refined: Refined) -> dict[tuple[int, int], tuple[float, float]]:
    """Plain RMS ETE (px) and whitened RMS of each (camera, frame) that was fitted."""
    errors = refined.errors
    told = errors.told[:, :, :2]
    squares = np.where(told, errors.error[:, :, :2] ** 2, 0.0).sum(axis=(1, 2))
    rms = np.sqrt(squares / np.maximum(told.sum(axis=(1, 2)), 1))
    whitened = np.sqrt(refined.frames.chi2 / np.maximum(refined.frames.count, 1))
    return {(int(c), int(f)): (float(a), float(b)) for (c, f), a, b in zip(refined.places, rms, whitened, strict=True)}


def frame_reports(tracks: tuple[OutlineTrack, ...], errors: dict[tuple[int, int], tuple[float, float]] | None) -> tuple[FrameReport, ...]:
    """What became of every picture; ``errors``: those of the fitted ones, ``None`` where nothing was fitted."""
    reports = []
    for c, t in enumerate(tracks):
        for f, frame in enumerate(t.frames):
            rms, whitened = (errors or {}).get((c, f), (0.0, 0.0))
            fitted = frame.used if errors is None else frame.seen and (c, f) in errors
            reason = NO_HULL if frame.used else str(frame.status)
            reports.append(FrameReport(c, f, fitted, "" if fitted and frame.used else reason, rms, whitened))
    return tuple(reports)


NO_HULL = "outline without area"
