"""From a refined flight with impacts to the estimate a user reads: segments, impacts, and what a stated plate says to them."""

import dataclasses
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, ImpactEstimate, PlateGap, SegmentEstimate, Status, VelocityEstimate
from datasets.observation import Observation
from datasets.vocabulary.state import Motion
from estimator.data.configuration import Configuration
from estimator.data.versions import versions
from estimator.impacts.piecewise_fit import PiecewiseRefined
from estimator.impacts.plate_contact import PlateTask
from estimator.impacts.plate_edge import edge_sentence
from estimator.impacts.plate_gap import plate_gaps, plate_sentences, spread_by
from estimator.impacts.plate_holding import plate_told
from estimator.motion.flight import fitted_body
from estimator.motion.piecewise import (
    PiecewiseFlight,
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
from estimator.particle.particle import Particle
from estimator.poses.pose_search import FoundPoses
from estimator.reports.reporting import fit_statistics, flight_values, frame_reports, sighting_errors, view_statistics, with_views

Array = NDArray[np.float64]


def impacts_estimate(
    observation: Observation,
    tracks: tuple[OutlineTrack, ...],
    seen: tuple[Particle, FoundPoses],
    refined: PiecewiseRefined,
    outcome: tuple[Status, str],
    *,
    configuration: Configuration,
    plate: PlateTask | None = None,
) -> Estimate:
    """The estimate of a fit that ended with a flight with impacts; no numbers where the status says that there is no convergence.

    ``plate``: what the flight was held to.
    """
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
    impacts = tuple(_impact(refined, number, gap) for number, gap in enumerate(plate_gaps(refined, observation, particle)))
    edge = edge_sentence(observation, impacts[0].x_world)
    held, told["statistics"] = plate_told(plate, refined, told["statistics"])
    return Estimate(
        name=observation.name,
        status=status,
        message=with_views(" ".join([message, *plate_sentences(impacts), *([edge] if edge else []), *held]), particle),
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
    """Poses of the fitted body and velocities at ``times_s`` (f,) s."""
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
    covariance, bound = (spread_by(J, matrix) for matrix in (refined.refined.covariance, refined.refined.bound))
    return VelocityEstimate(time_s, values[:3], values[3:], covariance, bound)


def _segments(refined: PiecewiseRefined, times_s: Array) -> tuple[SegmentEstimate, ...]:
    ends = [float(times_s[0]), *refined.flight.times_s.tolist(), float(times_s[-1])]
    return tuple(SegmentEstimate(a, b, _velocity(refined, 0.5 * (a + b))) for a, b in pairwise(ends))


def _impact(refined: PiecewiseRefined, number: int, gap: PlateGap | None) -> ImpactEstimate:
    flight = refined.flight
    touch, J = touch_and_sensitivity(flight, number)
    time_s = flight.bounces[number].time_s
    at = impact_slice(number).start
    return ImpactEstimate(
        time_s=time_s,
        time_sigma_s=float(np.sqrt(refined.refined.covariance[at, at])),
        x_world=touch.x[0],
        q_world_body=quaternion(touch.R[0] @ _fitted_axes(flight)),
        before=_with_covariance(refined, time_s, touch.before[0], J[6:12]),
        after=_with_covariance(refined, time_s, touch.after[0], J[12:18]),
        covariance=spread_by(J, refined.refined.covariance),
        plate=gap,
    )
