"""What is likely wrong with the input where no flight fits: each of a few usual mistakes is taken back and the fit tried again.

Gravity's sign, pixels counted upwards or mirrored, time stamps in ms or µs instead of s; mistakes in the calibrated views show before any
fit (:mod:`estimator.particle.view_faults`). A correction is only *named*, never applied: it is named where without it residuals are no
noise, and with it a quick fit converges whose residuals are (:mod:`estimator.fitting.adequacy`). Where several do, it is the one under
which a surface meets all outline samples best: seen from far away, tangents hardly tell a body from its mirror image.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, Status
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.data.configuration import Configuration
from estimator.impacts.chains import Seen
from estimator.measuring.free_flight import estimate_free_flight
from estimator.outlines.result import OutlineTrack
from estimator.particle.view_faults import mirrored, upside_down
from estimator.surface.told import SWALLOWED

Array = NDArray[np.float64]
GROSS = (Status.NO_CONVERGENCE, Status.RESTING)
LONGEST_GAP_S, SHORTEST_GAP_S = 0.05, 1e-6
"""Between frames: what falls for longer leaves the picture within a few frames; no camera records outlines faster."""


@dataclass(frozen=True)
class Correction:
    """A mistake taken back: what it makes of what was seen, and the sentence that names it."""

    key: str
    sentence: str
    corrected: Callable[[Seen], Seen]


def _gravity(seen: Seen) -> Seen:
    return replace(seen, observation=replace(seen.observation, gravity_world=-seen.observation.gravity_world))


def _upwards(seen: Seen) -> Seen:
    return _turned_over(seen, lambda outline, camera: upside_down(outline, camera.height_px))


def _mirrored(seen: Seen) -> Seen:
    return _turned_over(seen, lambda outline, camera: mirrored(outline, camera.width_px))


def _turned_over(seen: Seen, turn: Callable[[Outline, Intrinsics], Outline]) -> Seen:
    """With every camera's outlines turned over, which turns their order round."""
    tracks = (
        OutlineTrack(tuple(replace(f, outline=turn(f.outline, camera.intrinsics), unsure=f.unsure[::-1]) for f in track.frames))
        for track, camera in zip(seen.tracks, seen.observation.cameras, strict=True)
    )
    return replace(seen, tracks=tuple(tracks))


def _times(factor: float) -> Callable[[Seen], Seen]:
    def corrected(seen: Seen) -> Seen:
        clock, *further = (replace(each, times_s=factor * each.times_s) for each in seen.observation.clocks)
        own = (clock, *further) if seen.observation.camera_clocks else ()
        return replace(seen, observation=replace(seen.observation, clock=clock, camera_clocks=own))

    return corrected


GRAVITY = Correction("gravity", "gravity is reversed: check the sign of gravity_world", _gravity)
UPWARDS = Correction("image_y", "the rows of the high-speed camera's pictures are counted upwards: pixel y runs downwards", _upwards)
MIRRORED = Correction("image_x", "the high-speed camera's pictures are mirrored: pixel x runs to the right", _mirrored)
TIMES = tuple(
    (factor, Correction(key, f"times are {said}: time stamps are in seconds", _times(factor)))
    for factor, key, said in (
        (1e-3, "times_ms", "divided by 1000"),
        (1e-6, "times_us", "divided by a million"),
        (1e3, "times_short", "multiplied by 1000"),
    )
)


def input_fault(seen: Seen, estimate: Estimate, configuration: Configuration) -> Correction | None:
    """The correction of the input with which the outlines fit where they do not without it; ``None`` where they do or none is found.

    Where slow errors are none, but a surface misses the outlines, one must meet them better by as much as makes a fit a noisy one.
    """
    gross, missed = estimate.status in GROSS, _missed(estimate, default=1.0)
    slowly_off = not estimate.statistics.get("adequacy", {"adequate": not gross})["adequate"]
    if not slowly_off and missed <= SWALLOWED:
        return None
    quick = replace(configuration, trajectory_candidates=1, momentum_starts=0, focal_prior=0.0)
    fitting = []
    for correction in (*(_of_times(seen.observation.clock.times_s) if gross else ()), GRAVITY, UPWARDS, MIRRORED):
        tried = estimate_free_flight(correction.corrected(seen), quick)
        adequate, left = tried.statistics.get("adequacy", {}).get("adequate", False), _missed(tried, default=np.inf)
        if tried.status is Status.CONVERGED and adequate and (slowly_off or SWALLOWED * left <= missed):
            fitting.append((left, tried.statistics["noise_mean_square"], correction))
    return min(fitting, key=lambda each: each[:2])[2] if fitting else None


def _missed(estimate: Estimate, *, default: float) -> float:
    """Effective noise of the pictures' samples over the outlines' own, of the camera where it is most; ``default`` without a surface."""
    told = estimate.statistics.get("surface")
    if told is None:
        return default
    return float(max(px / told["outline_noise_px"][group] for group, px in told["effective_noise_px"].items() if group != "views"))


def _of_times(times_s: Array) -> tuple[Correction, ...]:
    """Corrections of time stamps that are no high-speed camera's and become it."""
    gap = float(np.median(np.diff(times_s)))
    if SHORTEST_GAP_S <= gap <= LONGEST_GAP_S:
        return ()
    return tuple(correction for factor, correction in TIMES if SHORTEST_GAP_S <= gap * factor <= LONGEST_GAP_S)


def with_fault(estimate: Estimate, correction: Correction) -> Estimate:
    """The estimate with the correction named in its message."""
    statistics = {**estimate.statistics, "input_fault": correction.key}
    return replace(estimate, message=f"{estimate.message} The outlines fit if {correction.sentence}.", statistics=statistics)
