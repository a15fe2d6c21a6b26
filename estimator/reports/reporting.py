"""From a refined flight to the estimate a user reads: velocities with covariance, frames with reasons, statistics, versions."""

import dataclasses
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, FrameReport, Status, VelocityEstimate
from datasets.observation import Observation
from datasets.vocabulary.state import Motion as StatedMotion
from estimator.data.configuration import Configuration
from estimator.data.versions import versions
from estimator.fitting.adequacy import Misfit
from estimator.fitting.calibration_share import CalibrationShare, calibration_sentence, calibration_statistics, widened
from estimator.fitting.focal_flight import LOG_FOCAL
from estimator.fitting.refinement import Refined
from estimator.impacts.chains import Seen
from estimator.impacts.plate_gap import spread_by
from estimator.motion.flight import Motion, fitted_body, rates, still, velocities, velocity_sensitivity
from estimator.motion.piecewise import SHIFT, PiecewiseFlight, segment_of
from estimator.motion.rigid_body import rotation_matrices
from estimator.motion.rotation import quaternion
from estimator.outlines.result import OutlineTrack
from estimator.particle.particle import Particle
from estimator.poses.pose_search import FoundPoses
from estimator.reports.clock_reporting import clock_sentences, clock_statistics
from estimator.reports.misfit_words import adequacy_statistics, misfit_remark, misfit_sentence

Array = NDArray[np.float64]


def empty_estimate(seen: Seen, configuration: Configuration, outcome: tuple[Status, str]) -> Estimate:
    """An estimate that says why there is no measurement."""
    status, message = outcome
    return Estimate(
        name=seen.observation.name,
        status=status,
        message=with_views(message, seen.particle),
        frames=frame_reports(seen.tracks, None),
        statistics=view_statistics(seen.particle),
        configuration=dataclasses.asdict(configuration),
        versions=versions(),
    )


def converged_estimate(
    seen: Seen,
    found: FoundPoses,
    refined: Refined[Motion],
    outcome: tuple[Status, str, Misfit | None],
    *,
    configuration: Configuration,
    share: CalibrationShare | None = None,
) -> Estimate:
    """The estimate of a fit that ended with a free flight; its numbers are left out where the status says that there is no convergence.

    ``outcome``: status, message and the test of the residuals. ``share``: what the stated uncertainty of camera and gravity adds.
    """
    (status, message, tested), observation = outcome, seen.observation
    statistics = adequacy_statistics(tested)
    if tested is not None and not tested.adequate and status is not Status.NO_CONVERGENCE:
        message = misfit_sentence(tested) if status is Status.CONVERGED else f"{message} {misfit_remark(tested)}"
    sentences = [with_views(message, seen.particle)]
    if LOG_FOCAL in refined.flight.layout.places:
        statistics["focal_length"] = focal_length(refined, observation, configuration.focal_prior)
        sentences.append(statistics["focal_length"]["statement"])
    clocks = clock_statistics(refined, observation)
    statistics |= {"clocks": clocks} if clocks else {}
    sentences += clock_sentences(clocks)
    estimate = fitted_estimate(seen, found, refined, (status, ""), configuration=configuration, share=share)
    middle = estimate.middle
    if middle is not None and share is not None:
        moved = share.covariance(velocity_sensitivity(refined.flight, middle.time_s), middle.time_s - refined.flight.first.time_s)
        statistics["calibration"] = calibration_statistics(moved, middle.covariance)
        sentences.append(calibration_sentence(statistics["calibration"]))
    if middle is not None and observation.mass_kg is not None:
        statistics["momenta"] = _momenta(refined.flight, seen.particle, observation.mass_kg, middle.time_s)
    return replace(estimate, message=" ".join(filter(None, sentences)), statistics={**estimate.statistics, **statistics})


def fitted_estimate(
    seen: Seen,
    found: FoundPoses,
    refined: Refined[Motion],
    outcome: tuple[Status, str],
    *,
    configuration: Configuration,
    share: CalibrationShare | None = None,
) -> Estimate:
    """What is told of any fit that ended with a motion; no numbers where the status says that there is no convergence.

    ``share``: what a calibration adds to the error bars.
    """
    (status, message), flight, times = outcome, refined.flight, seen.observation.clock.times_s
    told: dict[str, Any] = {
        "name": seen.observation.name,
        "status": status,
        "message": message,
        "configuration": dataclasses.asdict(configuration),
        "versions": versions(),
        "frames": frame_reports(seen.tracks, sighting_errors(refined)),
        "statistics": {**view_statistics(seen.particle), **fit_statistics(refined, found)},
    }
    if status is Status.NO_CONVERGENCE:
        return Estimate(**told)
    own = flight.layout.columns(name for name in flight.layout.names if not name.endswith(SHIFT))
    return Estimate(
        body=fitted_body(flight.first),
        motion=motion_of(flight, times),
        start=velocity_of(refined, float(times[0]), share),
        middle=velocity_of(refined, float(times[(len(times) - 1) // 2]), share),
        parameters=tuple(flight.layout.labels[k] for k in own),
        values=flight.values[own],
        covariance=(refined if share is None else widened(refined, share)).covariance[np.ix_(own, own)],
        bound=refined.bound[np.ix_(own, own)],
        **told,
    )


def motion_of(motion: Motion, times_s: Array) -> StatedMotion:
    """Poses of the fitted body and velocities at ``times_s`` (f,) s."""
    x, both = motion.states(still(motion), times_s), rates(motion, still(motion), times_s)[:, 0]
    return StatedMotion(
        times_s=times_s,
        x_world=x.x[:, 0],
        q_world_body=quaternion(rotation_matrices(x.q[:, 0]) @ fitted_axes(motion)),
        v_world=both[:, :3],
        omega_world=both[:, 3:],
    )


def fitted_axes(motion: Motion) -> Array:
    """The fitted body's axes (3, 3) in the nominal body's."""
    return motion.first.body.R_particle_body.T @ fitted_body(motion.first).R_particle_body


def focal_length(refined: Refined[Motion], observation: Observation, prior: float) -> dict[str, Any]:
    """The focal length found (px, of x and y), its standard deviation, the camera's own, and what to think of it in a sentence."""
    camera, place = observation.cameras[0].intrinsics, refined.flight.layout[LOG_FOCAL]
    factor, relative = float(np.exp(refined.flight.values[place].item())), float(np.sqrt(refined.covariance[place, place].item()))
    f, sigma = factor * camera.fx_px, factor * camera.fx_px * relative
    silent = relative > SILENT * prior
    return {
        "focal_px": [f, factor * camera.fy_px],
        "sigma_px": [sigma, factor * camera.fy_px * relative],
        "camera_px": [camera.fx_px, camera.fy_px],
        "prior_relative": prior,
        "statement": f"focal length measured: {f:.0f} ± {sigma:.0f} px (camera: {camera.fx_px:.0f} ± {100 * prior:g}%)"
        + ("; the pictures say hardly anything of it, what holds it is the prior." if silent else "."),
    }


SILENT = 0.8
"""A standard deviation above this share of the prior's means that the pictures had little to say."""


def velocity_of(refined: Refined[Motion], time_s: float, share: CalibrationShare | None = None) -> VelocityEstimate:
    """Velocities at a time with their covariance, a calibration's ``share`` in it."""
    J = velocity_sensitivity(refined.flight, time_s)
    values = np.concatenate(velocities(refined.flight, still(refined.flight), time_s), axis=1)[0]
    segment = int(segment_of(refined.flight, np.array([time_s]))[0]) if isinstance(refined.flight, PiecewiseFlight) else 0
    more = refined.drift(time_s, segment, values[3:]) + (
        0.0 if share is None else share.covariance(J, time_s - refined.flight.first.time_s)
    )
    return told_velocity(refined, time_s, values, J, more)


def told_velocity(refined: Refined[Motion], time_s: float, values: Array, J: Array, more: Array | float = 0.0) -> VelocityEstimate:
    """Velocities ``values`` (6,) with their covariance, of which ``more`` (6, 6) is known; ``J`` (6, p) by the parameters."""
    covariance, bound = (spread_by(J, matrix) for matrix in (refined.covariance, refined.bound))
    return VelocityEstimate(time_s, values[:3], values[3:], covariance + more, bound)


def _momenta(motion: Motion, particle: Particle, mass_kg: float, time_s: float) -> dict[str, Any]:
    """Linear (kg m/s) and angular (kg m²/s) momentum in the middle, of the hull's inertia scaled to the mass."""
    at = motion.states(still(motion), np.array([time_s]))
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


def fit_statistics(refined: Refined[Motion], found: FoundPoses) -> dict[str, Any]:
    """What is told of a last refinement and of the pose search before it."""
    errors = refined.at.errors
    return {
        "n_pairs": int(errors.valid.sum()),
        "pairs_without_tangents": int((~errors.valid).sum()),
        "rms_ete_px": errors.rms_px,
        "whitened_mean_square": refined.at.frames.mean_square,
        "noise_scale": refined.noise.scale,
        "noise_mean_square": refined.noise.mean_square,
        "noise_correlation_rad": refined.noise.correlation_rad,
        "pairs_within_sequence": refined.at.within.pairs,
        "rms_ete_within_px": refined.at.within.rms_px,
        "competing_minima": [{"rms_ete_px": float(r), "cost": float(c)} for r, c in zip(found.rms_px, found.poses.cost, strict=True)],
    }


def sighting_errors(refined: Refined[Motion]) -> dict[tuple[int, int], tuple[float, float]]:
    """Plain RMS ETE (px) and whitened RMS of each (camera, frame) that was fitted."""
    whitened = np.sqrt(refined.at.frames.chi2 / np.maximum(refined.at.frames.count, 1))
    places = zip(refined.sightings.camera.tolist(), refined.sightings.frame.tolist(), strict=True)
    return {place: (float(a), float(b)) for place, a, b in zip(places, refined.at.errors.rms_of_each_px, whitened, strict=True)}


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
