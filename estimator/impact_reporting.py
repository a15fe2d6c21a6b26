"""From a refined flight with impacts to the estimate a user reads: segments, impacts, and what a stated plate says to them.

A plate stated with a wrong tilt is contradicted by the gap where the particle hits away from the point the plane is stated at: 10° are
0.9 mm
at 5 mm. Turned about the very point of contact it only touches another corner first, and one impact may not show it.
"""

import dataclasses
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, ImpactEstimate, PlateGap, SegmentEstimate, Status, VelocityEstimate
from datasets.observation import Observation
from datasets.vocabulary.plate import Plate
from datasets.vocabulary.state import Motion
from estimator.configuration import Configuration
from estimator.fitting.piecewise_fit import PiecewiseRefined, flown
from estimator.fitting.pose_search import FoundPoses
from estimator.motion.flight import fitted_body
from estimator.motion.piecewise import (
    PiecewiseFlight,
    Touch,
    impact_slice,
    names,
    piecewise_states,
    piecewise_velocities,
    piecewise_velocity_sensitivity,
    touch_and_sensitivity,
)
from estimator.motion.rigid_body import rotation_matrices
from estimator.motion.rotation import quaternion
from estimator.outlines.result import OutlineTrack
from estimator.particle import Particle
from estimator.predicted_bias import hull_vertices
from estimator.reporting import fit_statistics, flight_values, frame_reports, sighting_errors, versions, view_statistics, with_views

Array = NDArray[np.float64]
HULL_SHARE = 0.005
"""Standard deviation of the hull's surface at the point of contact, as a share of the particle's extent.

Gaps over true plates were within 0.02 mm (root mean square) for stones of 6 mm.
"""
MOST_SIGMAS = 3.5
"""A gap, or a depth inside the plate, beyond so many standard deviations contradicts the plate."""


def impacts_estimate(
    observation: Observation,
    tracks: tuple[OutlineTrack, ...],
    seen: tuple[Particle, FoundPoses],
    refined: PiecewiseRefined,
    outcome: tuple[Status, str],
    *,
    configuration: Configuration,
) -> Estimate:
    """The estimate of a fit that ended with a flight with impacts; no numbers where the status says that there is no convergence."""
    particle, found = seen
    status, message = outcome
    flight, times = refined.flight, observation.clock.times_s
    told: dict[str, Any] = {
        "configuration": dataclasses.asdict(configuration),
        "versions": versions(),
        "frames": frame_reports(tracks, sighting_errors(refined.refined)),
        "statistics": {**view_statistics(particle), **fit_statistics(refined.refined, found)},
    }
    if status is Status.NO_CONVERGENCE:
        return Estimate(name=observation.name, status=status, message=with_views(message, particle), **told)
    impacts = tuple(_impact(refined, number, observation, particle) for number in range(len(flight.bounces)))
    return Estimate(
        name=observation.name,
        status=status,
        message=with_views(" ".join([message, *_plate_sentences(impacts)]), particle),
        body=fitted_body(flight.first),
        motion=piecewise_motion(flight, times),
        start=_velocity(refined, float(times[0])),
        middle=_velocity(refined, float(times[(len(times) - 1) // 2])),
        parameters=names(flight),
        values=np.concatenate([flight_values(flight.first), *(np.array([b.time_s, *b.v, *b.omega]) for b in flight.bounces)]),
        covariance=refined.refined.covariance,
        bound=refined.refined.bound,
        segments=_segments(refined, times),
        impacts=impacts,
        **told,
    )


def piecewise_motion(flight: PiecewiseFlight, times_s: Array) -> Motion:
    """Poses of the fitted body and velocities at ``times_s``."""
    still = np.zeros((1, flight.size))
    reached, rates = piecewise_states(flight, still, times_s), piecewise_velocities(flight, still, times_s)[:, 0]
    return Motion(
        times_s=times_s,
        x_world=reached.x[:, 0],
        q_world_body=quaternion(rotation_matrices(reached.q[:, 0]) @ _fitted_axes(flight)),
        v_world=rates[:, :3],
        omega_world=rates[:, 3:],
    )


def _fitted_axes(flight: PiecewiseFlight) -> Array:
    return flight.first.body.R_particle_body.T @ fitted_body(flight.first).R_particle_body


def _velocity(refined: PiecewiseRefined, time_s: float) -> VelocityEstimate:
    values = piecewise_velocities(refined.flight, np.zeros((1, refined.flight.size)), np.array([time_s]))[0, 0]
    return _with_covariance(refined, time_s, values, piecewise_velocity_sensitivity(refined.flight, time_s))


def _with_covariance(refined: PiecewiseRefined, time_s: float, values: Array, J: Array) -> VelocityEstimate:
    covariance, bound = (_spread(J, matrix) for matrix in (refined.refined.covariance, refined.refined.bound))
    return VelocityEstimate(time_s, values[:3], values[3:], covariance, bound)


def _spread(J: Array, matrix: Array) -> Array:
    result = J @ matrix @ J.T
    return np.asarray(0.5 * (result + result.T))


def _segments(refined: PiecewiseRefined, times_s: Array) -> tuple[SegmentEstimate, ...]:
    ends = [float(times_s[0]), *refined.flight.times_s.tolist(), float(times_s[-1])]
    return tuple(SegmentEstimate(a, b, _velocity(refined, 0.5 * (a + b))) for a, b in pairwise(ends))


def _impact(refined: PiecewiseRefined, number: int, observation: Observation, particle: Particle) -> ImpactEstimate:
    flight = refined.flight
    touch, J = touch_and_sensitivity(flight, number)
    time_s, covariance = flight.bounces[number].time_s, _spread(J, refined.refined.covariance)
    at = impact_slice(number).start
    plate = observation.plate
    return ImpactEstimate(
        time_s=time_s,
        time_sigma_s=float(np.sqrt(refined.refined.covariance[at, at])),
        x_world=touch.x[0],
        q_world_body=quaternion(touch.R[0] @ _fitted_axes(flight)),
        before=_with_covariance(refined, time_s, touch.before[0], J[6:12]),
        after=_with_covariance(refined, time_s, touch.after[0], J[12:18]),
        covariance=covariance,
        plate=None if plate is None else _gap(refined, (touch, covariance), time_s, plate, (observation, particle)),
    )


def _gap(refined: PiecewiseRefined, at: tuple[Touch, Array], time_s: float, plate: Plate, seen: tuple[Observation, Particle]) -> PlateGap:
    """How far the lowest point of the hull is above the plate at the impact, and at worst."""
    (touch, covariance), (observation, particle), flight = at, seen, refined.flight
    body, n = flight.first.body, plate.normal_world
    vertices = (hull_vertices(particle) - body.com_particle) @ body.R_particle_body
    began = float(observation.clock.times_s[0])
    arms = (vertices - flight.first.com) @ touch.R[0].T
    lowest = int(np.argmin(arms @ n))
    place = touch.x[0] + arms[lowest]
    J = np.concatenate([n, np.cross(arms[lowest], n)])
    lever = place - plate.point_world - plate.velocity_world * (time_s - began)
    sideways = float(np.linalg.norm(lever - (lever @ n) * n))
    variance = float(J @ covariance[:6, :6] @ J) + plate.offset_sigma_m**2 + (plate.normal_sigma_rad * sideways) ** 2
    sigma = float(np.sqrt(variance + (HULL_SHARE * particle.extent_m) ** 2))
    gap = float(plate.height_m(place, time_s - began))
    every = flown(flight, refined.times_s)
    heights = [
        float(plate.height_m(c + vertices @ R.T, t - began).min())
        for c, R, t in zip(every.centre[:, 0], every.R[:, 0], refined.times_s, strict=True)
    ]
    deepest = min([gap, *heights])
    return PlateGap(gap, sigma, deepest, bool(abs(gap) <= MOST_SIGMAS * sigma and deepest >= -MOST_SIGMAS * sigma))


def _plate_sentences(impacts: tuple[ImpactEstimate, ...]) -> list[str]:
    """What to say of a plate that the motion contradicts."""
    return [
        f"the stated plate contradicts impact {number + 1}: the particle's lowest point is {1e3 * i.plate.gap_m:+.2f} ± "
        f"{1e3 * i.plate.sigma_m:.2f} mm above it there, and {1e3 * i.plate.deepest_m:+.2f} mm at the lowest in any frame."
        for number, i in enumerate(impacts)
        if i.plate is not None and not i.plate.agrees
    ]
