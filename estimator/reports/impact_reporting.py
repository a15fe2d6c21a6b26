"""From a refined flight with impacts to the estimate a user reads: segments, impacts, and what a stated plate says to them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, ImpactEstimate, PlateGap, SegmentEstimate, Status
from estimator.data.configuration import Configuration
from estimator.fitting.calibration_share import CalibrationShare, calibration_sentence, calibration_statistics, widened
from estimator.impacts.chains import Seen
from estimator.impacts.piecewise_fit import PiecewiseRefined
from estimator.impacts.plate_contact import PlateTask
from estimator.impacts.plate_edge import edge_sentence
from estimator.impacts.plate_gap import plate_gaps, plate_sentences, spread_by
from estimator.impacts.plate_holding import plate_told
from estimator.motion.flight import velocity_sensitivity
from estimator.motion.piecewise import AFTER, BEFORE, TIME, named, touch_and_sensitivity
from estimator.motion.rotation import quaternion
from estimator.poses.pose_search import FoundPoses
from estimator.reports.reporting import fitted_axes, fitted_estimate, told_velocity, velocity_of, with_views

Array = NDArray[np.float64]


def impacts_estimate(
    seen: Seen,
    found: FoundPoses,
    refined: PiecewiseRefined,
    outcome: tuple[Status, str],
    *,
    configuration: Configuration,
    plate: PlateTask | None = None,
    share: CalibrationShare | None = None,
) -> Estimate:
    """The estimate of a fit that ended with a flight with impacts; no numbers where the status says that there is no convergence.

    ``plate``: what the flight was held to. ``share``: what a calibration adds to the error bars; what a gravity that is off adds to a
    velocity between an impact and another time in its segment, milliseconds times its error, is left out.
    """
    (status, message), (observation, particle) = outcome, (seen.observation, seen.particle)
    wide = refined if share is None else widened(refined, share)
    estimate = fitted_estimate(seen, found, wide, (status, with_views(message, particle)), configuration=configuration)
    if status is Status.NO_CONVERGENCE:
        return estimate
    impacts = tuple(_impact(wide, number, gap) for number, gap in enumerate(plate_gaps(wide, observation, particle)))
    edge = edge_sentence(observation, impacts[0].x_world)
    held, statistics = plate_told(plate, wide, estimate.statistics)
    sentences = [with_views(" ".join([message, *plate_sentences(impacts), *([edge] if edge else []), *held]), particle)]
    segments = _segments(wide, observation.clock.times_s)
    if share is not None:
        middle = segments[0].velocity
        J = velocity_sensitivity(refined.flight, middle.time_s) @ share.parameters
        statistics["calibration"] = calibration_statistics(J @ J.T, middle.covariance)
        sentences.append(calibration_sentence(statistics["calibration"]))
    message = " ".join(filter(None, sentences))
    return replace(estimate, message=message, statistics=statistics, segments=segments, impacts=impacts)


def _segments(refined: PiecewiseRefined, times_s: Array) -> tuple[SegmentEstimate, ...]:
    ends = [float(times_s[0]), *refined.flight.times_s.tolist(), float(times_s[-1])]
    return tuple(SegmentEstimate(a, b, velocity_of(refined, 0.5 * (a + b))) for a, b in pairwise(ends))


def _impact(refined: PiecewiseRefined, number: int, gap: PlateGap | None) -> ImpactEstimate:
    flight = refined.flight
    touch, J = touch_and_sensitivity(flight, number)
    time_s, at = flight.bounces[number].time_s, flight.layout[named(TIME, number)]
    sides = (number, touch.before[0, 3:]), (number + 1, touch.after[0, 3:])
    covariance, drifts = spread_by(J, refined.covariance), [refined.drift(time_s, segment, omega) for segment, omega in sides]
    for part, more in zip((BEFORE, AFTER), drifts, strict=True):
        covariance[part, part] += more
    return ImpactEstimate(
        time_s=time_s,
        time_sigma_s=float(np.sqrt(refined.covariance[at, at].item())),
        x_world=touch.x[0],
        q_world_body=quaternion(touch.R[0] @ fitted_axes(flight)),
        before=told_velocity(refined, time_s, touch.before[0], J[BEFORE], drifts[0]),
        after=told_velocity(refined, time_s, touch.after[0], J[AFTER], drifts[1]),
        covariance=covariance,
        plate=gap,
    )
