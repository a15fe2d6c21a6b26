"""What the uncertainty of the camera's calibration, and of measured gravity, adds to that of a flight with impacts.

As of one free flight (:mod:`estimator.fitting.calibration_share`), for all parameters of all segments. A gravity that is off moves the
parameters; what it adds to a velocity between an impact and another time in its segment, milliseconds times its error, is left out.
"""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.data.fit_task import FitTask
from estimator.fitting.calibration_share import calibration_errors, calibration_moves, seen_under
from estimator.fitting.refinement import Refinement
from estimator.impacts.piecewise_fit import PiecewiseRefined, flown, seen_at, with_noise_at
from estimator.impacts.plate_contact import PlateTask
from estimator.motion.piecewise import PiecewiseFlight, piecewise_velocity_sensitivity

Array = NDArray[np.float64]


def with_calibration(
    task: FitTask,
    refined: PiecewiseRefined,
    settings: Refinement,
    plate: PlateTask | None = None,
    gravity_covariance: Array | None = None,
) -> tuple[PiecewiseRefined, Array | None]:
    """A refined flight with the calibration's share in its covariance, and that share (p, p); ``None`` where no uncertainty is stated.

    ``gravity_covariance`` (3, 3) m²/s⁴, world frame.
    """
    flight = refined.flight
    others, _ = calibration_errors(task, flight, gravity_covariance, _under)
    if not others:
        return refined, None
    task, _ = with_noise_at(task, flight)
    others, _ = calibration_errors(task, flight, gravity_covariance, _under)
    at, _, _ = seen_at(task, flight, settings, (plate, ()))

    def seen(task: FitTask, flight: PiecewiseFlight) -> tuple[Array, Array]:
        return seen_under(task, flight.first, flown(flight, task.sightings.times_s), (at, settings))

    moves = calibration_moves(at, others, seen)
    share = np.asarray(moves @ moves.T)
    return replace(refined, refined=replace(refined.refined, covariance=refined.refined.covariance + share)), share


def _under(flight: PiecewiseFlight, pull: Array) -> PiecewiseFlight:
    return replace(flight, first=replace(flight.first, gravity_world=flight.first.gravity_world + pull))


def share_of(refined: PiecewiseRefined, share: Array) -> dict[str, Any]:
    """Standard deviations of v (m/s) and omega (rad/s) in the middle of the first segment, by the calibration alone and of all.

    ``share`` (p, p) of the covariance.
    """
    ends = (float(refined.times_s.min()), float(refined.flight.times_s[0]))
    J = piecewise_velocity_sensitivity(refined.flight, 0.5 * (ends[0] + ends[1]))
    parts = (("v_ms", J[:3]), ("omega_rads", J[3:6]))
    whole = refined.refined.covariance
    return {name: {"calibration": _size(part @ share @ part.T), "all": _size(part @ whole @ part.T)} for name, part in parts}


def _size(covariance: Array) -> float:
    return float(np.sqrt(np.trace(covariance)))
