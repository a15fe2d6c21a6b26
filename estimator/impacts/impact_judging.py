"""What flights with impacts are worth: the jumps at their impacts, trajectories that compete with them, and the status they deserve."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Status
from estimator.data.configuration import Configuration
from estimator.fitting.levenberg_marquardt import Outcome, Solution
from estimator.impacts.piecewise_fit import PiecewiseRefined
from estimator.motion.piecewise import AFTER, BEFORE, PiecewiseFlight, touch_and_sensitivity
from estimator.poses.pose_search import FoundPoses
from estimator.search.candidate_flights import LOST_RMS_PX, same_flight

Array = NDArray[np.float64]
IMPACTS_MEAN_SQUARE = 4.0
"""Mean square of the errors over their variance that flights with impacts may leave, 0.7 to 1.5 where all impacts are known.

Stricter than for one free flight: an impact that was overlooked bends the whole segment a little and its velocities a lot.
"""
CONTACT_FRAMES, NEAR_FRAMES, CONTACT_RATIO, CONTACT_MEAN_SQUARE = 6, 2.0, 3.0, 2.0
"""Impacts within so many frames are told. A contact that was overlooked leaves mean squares of errors near an impact so many times those
elsewhere, and larger than noise does."""


@dataclass(frozen=True)
class Chain:
    """All segments fitted jointly from one minimum of the longest."""

    found: FoundPoses
    solution: Solution[PiecewiseFlight]


def rivals_of(chains: list[Chain], configuration: Configuration) -> list[Chain]:
    """Those that fit nearly as well as the first, and are another trajectory."""
    best = chains[0].solution
    near = [c for c in chains[1:] if c.solution.equations.cost < configuration.ambiguity * best.equations.cost]
    return [c for c in near if not same_flight(c.solution.state.first, best.state.first)]


def jumps(refined: PiecewiseRefined) -> list[float]:
    """Squared Mahalanobis length of the jump of (v, omega) at each impact."""
    found = []
    for number in range(len(refined.flight.bounces)):
        touch, J = touch_and_sensitivity(refined.flight, number)
        D = J[AFTER] - J[BEFORE]
        jump = touch.after[0] - touch.before[0]
        found.append(float(jump @ np.linalg.solve(D @ refined.covariance @ D.T, jump)))
    return found


def judge_chain(chains: list[Chain], refined: PiecewiseRefined, configuration: Configuration) -> tuple[Status, str]:
    """The status that the result deserves, and why."""
    best = chains[0].solution
    rms = refined.at.errors.rms_px
    if not np.all(np.isfinite(np.diag(refined.covariance))) or (best.outcome is Outcome.STALLED and rms > LOST_RMS_PX):
        return Status.NO_CONVERGENCE, "the fit with impacts found no step that lowers its error."
    why = unfit(refined)
    if why is not None:
        return why
    rivals = rivals_of(chains, configuration)
    if rivals:
        ratio = rivals[0].solution.equations.cost / best.equations.cost
        return Status.AMBIGUOUS, f"another trajectory fits nearly as well (cost ratio {ratio:.3f}): more frames or views would decide."
    count = len(refined.flight.bounces)
    told = f"converged, piecewise: {count} impact{'s' if count > 1 else ''} between {count + 1} free flights."
    return Status.CONVERGED, " ".join([told, *_near_one_another(refined)])


def unfit(refined: PiecewiseRefined) -> tuple[Status, str] | None:
    """Why flights with impacts are no measurement, where the outlines speak against them or the refinement did not end."""
    near = second_contact(refined)
    if near is not None:
        return Status.SECOND_CONTACT, near
    if refined.noise.mean_square > IMPACTS_MEAN_SQUARE:
        times = np.sqrt(refined.noise.mean_square)
        missed = (
            f"the best flight with impacts misses the outlines by {refined.at.errors.rms_px:.2f} px RMS, {times:.1f} times their noise."
        )
        return Status.NO_CONVERGENCE, missed
    if not refined.settled:
        return Status.NO_CONVERGENCE, "the last refinement of the flight with impacts did not settle."
    return None


def _near_one_another(refined: PiecewiseRefined) -> list[str]:
    """Sentences on impacts that follow one another within a few frames."""
    frames = [_frame_of(refined, float(t)) for t in refined.flight.times_s]
    return [
        f"Impacts {k + 1} and {k + 2} (frames {a:.1f} and {b:.1f}) are {b - a:.1f} frames apart; velocities between them are loose."
        for k, (a, b) in enumerate(pairwise(frames))
        if b - a <= CONTACT_FRAMES
    ]


def second_contact(refined: PiecewiseRefined) -> str | None:
    """What to say where errors near an impact are far larger than elsewhere: the particle touched again within a few frames."""
    frames, counted = refined.sightings.frame, refined.at.frames.count > 0
    mean_square = refined.at.frames.chi2 / np.maximum(refined.at.frames.count, 1)
    for number, time_s in enumerate(refined.flight.times_s):
        frame = _frame_of(refined, float(time_s))
        near = (np.abs(frames - frame) <= NEAR_FRAMES) & counted
        far = (np.abs(frames - frame) > CONTACT_FRAMES) & counted
        if not near.any() or not far.any():
            continue
        here, there = float(mean_square[near].mean()), float(np.median(mean_square[far]))
        if here > CONTACT_MEAN_SQUARE and here > CONTACT_RATIO * there:
            return (
                f"errors within {NEAR_FRAMES:g} frames of impact {number + 1} (frame {frame:.1f}) are {np.sqrt(here / there):.1f} times "
                "those elsewhere: the particle touched again there, which one impact does not describe."
            )
    return None


def _frame_of(refined: PiecewiseRefined, time_s: float) -> float:
    return float(np.interp(time_s, *_frame_times(refined)))


def _frame_times(refined: PiecewiseRefined) -> tuple[Array, Array]:
    sightings = refined.sightings
    order = np.argsort(sightings.times_s, kind="stable")
    return sightings.times_s[order], sightings.frame[order].astype(np.float64)
