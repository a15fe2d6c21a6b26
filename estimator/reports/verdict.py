"""The status that a free flight deserves, and the sentence that says why."""

import numpy as np

from datasets.estimate import Status
from estimator.data.no_measurement import RAN_AWAY, NoMeasurement
from estimator.fitting.levenberg_marquardt import Outcome
from estimator.fitting.refinement import Refined
from estimator.fitting.stable_inverse import NothingSeen
from estimator.motion.flight import Motion
from estimator.motion.rigid_body import RanAway
from estimator.search.candidate_flights import LOST_RMS_PX, MOST_MEAN_SQUARE
from estimator.search.rival_flights import Standing

UNDETERMINED = "the usable pictures do not determine the flight: of some combination of its numbers they say nothing."


def failed(failure: NoMeasurement | RanAway) -> tuple[Status, str]:
    """Status and what to say of a fit that ended so."""
    if isinstance(failure, NoMeasurement):
        return failure.status, failure.message
    return (Status.NOT_ENOUGH_FRAMES, UNDETERMINED) if isinstance(failure, NothingSeen) else (Status.NO_CONVERGENCE, RAN_AWAY)


def judge(ranked: Standing, refined: Refined[Motion]) -> tuple[Status, str]:
    """The status that the result deserves, and why."""
    best = ranked.flights[0]
    numbers = np.concatenate([refined.flight.values, np.diag(refined.covariance)])
    rms = refined.at.errors.rms_px
    if not np.all(np.isfinite(numbers)) or (best.outcome is Outcome.STALLED and rms > LOST_RMS_PX):
        return Status.NO_CONVERGENCE, "the trajectory fit found no step that lowers its error."
    if refined.noise.mean_square > MOST_MEAN_SQUARE:
        times = np.sqrt(refined.noise.mean_square)
        return (
            Status.NO_CONVERGENCE,
            f"the best trajectory misses the outlines by {rms:.2f} px RMS, {times:.1f} times their noise: wrong minimum or missing effect.",
        )
    if not refined.settled:
        return Status.NO_CONVERGENCE, "the last refinement did not settle."
    if ranked.rivals:
        ratio = ranked.rivals[0].equations.cost / best.equations.cost
        said = f"the outlines do not refuse another trajectory (cost ratio {ratio:.3f}): more frames or views would decide."
        return Status.AMBIGUOUS, said
    if ranked.outside_px > 0.0:
        return (
            Status.AMBIGUOUS,
            f"the outlines reach {ranked.outside_px:.1f} px further out of the visual hull than noise and views explain: the pose may be "
            "a wrong one that meets the tangents by chance; more views would decide.",
        )
    return Status.CONVERGED, "converged."
