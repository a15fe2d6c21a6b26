"""Chains: flights of all segments of a sequence with kinks in its path, found one by one, then fitted jointly.

The longest segment is searched from nothing, as a free flight is. Each neighbour starts from the pose that it shares with it at the
impact, and is searched from nothing only where that leads nowhere. Competing minima of the longest segment are carried through all
segments: what a slow first flight leaves open, the tumbling after the impact usually decides.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Status
from datasets.observation import Observation
from estimator.appearance.flight_errors import errors_of, particle_poses
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask, restricted
from estimator.data.no_measurement import RAN_AWAY, NoMeasurement
from estimator.data.views import Poses
from estimator.fitting.levenberg_marquardt import Solution
from estimator.fitting.stable_inverse import NothingSeen
from estimator.fitting.tasks import biased_task, fit_task, refinement_settings
from estimator.fitting.trajectory import fit
from estimator.fitting.viewing_angles import with_clear_angles
from estimator.impacts.impact_discovery import LEAST_TRACKED, kinks_of_poses
from estimator.impacts.impact_judging import IMPACTS_MEAN_SQUARE, Chain, jumps
from estimator.impacts.impact_search import LEAST_RATIO, Kink, centroid_path, clear_kinks, find_kinks
from estimator.impacts.piecewise_fit import PiecewiseRefined, refine_piecewise
from estimator.impacts.plate_contact import PlateTask
from estimator.impacts.segments import joined, meeting_time, nearest_as_one, reversed_turns, segment_rows, with_pictures_between
from estimator.likelihood.noise_model import measured_noise
from estimator.motion.flight import Flight, flown
from estimator.motion.piecewise import PiecewiseFlight
from estimator.motion.rigid_body import RanAway
from estimator.outlines.result import OutlineTrack
from estimator.outlines.sightings import pictures_of, usable_sightings
from estimator.particle.particle import Particle, views_like
from estimator.poses.pose_refinement import pose_errors, refine
from estimator.poses.pose_search import FoundPoses
from estimator.search.candidate_flights import GOOD_COST, RIVAL_TRACK, Candidate, candidate_flights, first_pose

Array = NDArray[np.float64]
EDGE_FRAMES = 3
"""Frames before the first or after the last picture of a flight within which an impact leaves nothing to measure there. By judgement."""
LEAST_BETWEEN = 2
"""Pictures of one camera between impacts, without which there is no velocity between them."""
MOST_ROUNDS = 2
"""Searches for impacts that a fit has shown to be missing."""
UNCLEAR_FRAMES = 0.6
"""Sightings this near to a kink are left to the joint fit."""
LEAST_JUMP = 60.0
"""Squared Mahalanobis length of the jump of v and omega: below it there was no impact."""
SEARCHED_MEAN_SQUARE = 1.2
"""Above this impacts may be missing, and are searched for."""
WEAK_RATIO = 3.0
"""Of the residuals at a kink where impacts must be missing; nothing jumps at those that are none."""


@dataclass(frozen=True)
class Seen:
    """An observation, its outlines, and the particle of its calibrated views."""

    observation: Observation
    tracks: tuple[OutlineTrack, ...]
    particle: Particle


def task_of(seen: Seen, configuration: Configuration, *, in_part: bool = False) -> FitTask:
    """The fit's task; ``in_part``: with outlines of which a part is unsure."""
    sightings = usable_sightings(seen.observation, seen.tracks, configuration, in_part=in_part)
    views = views_like(seen.particle, sightings.silhouettes, np.random.default_rng(configuration.seed))
    return fit_task(seen.observation, seen.particle, sightings, views, configuration)


def nominations(seen: Seen, *, least_ratio: float = LEAST_RATIO) -> list[list[Kink]]:
    """Where impacts may be, in the order to try: kinks that the camera with most outlines saw, and those without outlines used in part.

    The latter fill the gap at an impact, but what is hidden of them may bend the path of their centroids.
    """
    track = seen.tracks[kinks_camera(seen.tracks)]
    found = [clear_kinks(find_kinks(centroid_path(track, in_part=in_part), least_ratio=least_ratio)) for in_part in (True, False)]
    return [kinks for k, kinks in enumerate(found) if kinks and kinks not in found[:k]]


def kinks_camera(tracks: tuple[OutlineTrack, ...]) -> int:
    """The number of the camera with most outlines, whose frames kinks are counted in."""
    return int(np.argmax([int(track.seen.sum()) for track in tracks]))


def with_missing_impacts(seen: Seen, task: FitTask, kinks: list[Kink], configuration: Configuration) -> list[Chain]:
    """The joint fits with ``kinks``, and with those that tracked poses show besides them where the fit misses."""
    chains = fitted_chains(seen, task, impact_times(seen, kinks), configuration)
    for _ in range(MOST_ROUNDS):
        flight = chains[0].solution.state
        errors = errors_of(task, flight.first, flown(flight, task.sightings.times_s))
        mean_square = measured_noise(errors).mean_square
        if mean_square <= SEARCHED_MEAN_SQUARE:
            break
        found = kinks_of_poses(task, flight)
        if len(found) <= len(flight.bounces) and mean_square > IMPACTS_MEAN_SQUARE:
            found = kinks_of_poses(task, flight, least_ratio=WEAK_RATIO)
        if len(found) <= len(flight.bounces):
            break
        edge = edge_kink(seen.tracks, found)
        if edge is not None:
            raise NoMeasurement(Status.IMPACT_AT_EDGE, edge)
        chains = fitted_chains(seen, task, impact_times(seen, found), configuration)
    return chains


def with_jumps_alone(
    seen: Seen, task: FitTask, chains: list[Chain], configuration: Configuration
) -> tuple[list[Chain], PiecewiseRefined | None]:
    """The chains and their refinement without impacts at which nothing jumps, and ``None`` where none is left.

    Impacts between which no velocity is seen become one.
    """
    while True:
        flight = chains[0].solution.state
        try:
            refined = refined_chain(seen, task, flight, configuration)
        except NothingSeen:
            if len(flight.bounces) == 1:
                raise
            chains = fitted_chains(seen, task, nearest_as_one(flight.times_s), configuration)
            continue
        jump = np.array(jumps(refined))
        if jump.min() >= LEAST_JUMP:
            return chains, refined
        if len(jump) == 1:
            return chains, None
        chains = fitted_chains(seen, task, np.delete(refined.flight.times_s, int(np.argmin(jump))), configuration)


def seen_frames(tracks: tuple[OutlineTrack, ...]) -> NDArray[np.int64]:
    """Numbers (f,) of the frames of which any camera has an outline."""
    return np.unique(np.concatenate([np.flatnonzero(t.seen) for t in tracks]))


def frames_beside(frames: NDArray[np.int64], kink: Kink) -> tuple[int, int]:
    """How many of ``frames`` (f,) lie before and after a kink."""
    return int(np.sum(frames < kink.frame)), int(np.sum(frames > kink.frame))


def edge_kink(tracks: tuple[OutlineTrack, ...], kinks: list[Kink]) -> str | None:
    """What to say of an impact with fewer than three used frames before or after it."""
    frames = seen_frames(tracks)
    for kink in kinks:
        before, after = frames_beside(frames, kink)
        if min(before, after) <= EDGE_FRAMES:
            where, count = ("first", before) if before < after else ("last", after)
            return (
                f"an impact at frame {kink.frame:.1f}, with {count} usable frames {'before' if where == 'first' else 'after'} it: in the "
                f"{where} three there is too little to measure on that side. Cut the recording there, and the rest is a free flight."
            )
    return None


def impact_times(seen: Seen, kinks: list[Kink]) -> Array:
    """Times (k,) s of kinks."""
    times = seen.observation.clock_of(kinks_camera(seen.tracks)).times_s
    return np.interp([k.frame for k in kinks], np.arange(len(times)), times)


def frame_interval_s(seen: Seen) -> float:
    """From one frame to the next, as the time stamps say."""
    return float(np.median(np.diff(seen.observation.clock.times_s)))


def fitted_chains(seen: Seen, task: FitTask, impacts_s: Array, configuration: Configuration) -> list[Chain]:
    """The joint fits from the competing minima of the longest segment, by ascending cost.

    Impacts between which too few pictures lie to fit a flight become one: where they were two, what the fit leaves shows it.
    ``impacts_s`` (k,): times to begin with.
    """
    frame_s = frame_interval_s(seen)
    impacts_s = with_pictures_between(task.sightings.times_s, task.sightings.frame, impacts_s, LEAST_BETWEEN)
    rows = segment_rows(task.sightings.times_s, impacts_s, clear_s=UNCLEAR_FRAMES * frame_s)
    if min(map(len, rows)) < LEAST_TRACKED:
        rows = segment_rows(task.sightings.times_s, impacts_s, clear_s=0.0)
    longest = int(np.argmax([len(r) for r in rows]))
    tasks = [restricted(task, r) for r in rows]
    found, reference = first_pose(tasks[longest], seen.particle, configuration)
    starts = candidate_flights(seen.observation, tasks[longest], seen.particle, (found, reference), configuration)
    best = starts[0].solution.equations.cost
    chains = []
    for start in starts:
        if start.solution.equations.cost > RIVAL_TRACK * max(best, tasks[longest].weight.size):
            continue
        try:
            flights = _neighbours(seen, tasks, (longest, start.solution.state), impacts_s, configuration)
            chain = Chain(found, _joint(task, flights, impacts_s))
        except RanAway:
            continue
        if np.isfinite(chain.solution.equations.cost):
            chains.append(chain)
    if not chains:
        raise NoMeasurement(Status.NO_CONVERGENCE, RAN_AWAY)
    return sorted(chains, key=lambda c: c.solution.equations.cost)


def _neighbours(
    seen: Seen, tasks: list[FitTask], known: tuple[int, Flight], impacts_s: Array, configuration: Configuration
) -> list[Flight]:
    """A flight for each segment, from that of one of them outwards."""
    at, flight = known
    flights: list[Flight | None] = [flight if k == at else None for k in range(len(tasks))]
    for k in (*range(at + 1, len(tasks)), *range(at - 1, -1, -1)):
        neighbour = flights[k - 1] if k > at else flights[k + 1]
        assert neighbour is not None
        flights[k] = _from_shared_pose(seen, tasks[k], neighbour, float(impacts_s[k - 1 if k > at else k]), configuration)
    return [f for f in flights if f is not None]


def _from_shared_pose(seen: Seen, task: FitTask, neighbour: Flight, impact_s: float, configuration: Configuration) -> Flight:
    """The flight of a segment, started from the pose that its neighbour has at the impact between them."""
    reference = int(np.argmin(np.abs(task.sightings.times_s - impact_s)))
    found = _shared_pose(task, neighbour, impact_s, reference)
    best = candidate_flights(seen.observation, task, seen.particle, (found, reference), configuration)[:1]
    if not best or not _fits(task, best[0]):
        searched = first_pose(task, seen.particle, configuration)
        best += candidate_flights(seen.observation, task, seen.particle, searched, configuration)
    return min(best, key=lambda c: c.solution.equations.cost).solution.state


def _fits(task: FitTask, candidate: Candidate) -> bool:
    return candidate.solution.equations.cost <= GOOD_COST * task.weight.size


def _shared_pose(task: FitTask, neighbour: Flight, impact_s: float, reference: int) -> FoundPoses:
    """The neighbour's pose at the impact, refined on the nearest sighting of the segment.

    Raises
    ------
    RanAway
        Where the neighbour has no pose then.
    """
    one = task.sightings.take(np.array([reference]))
    pose = particle_poses(neighbour, flown(neighbour, np.array([impact_s])), one)
    if not np.isfinite(pose.R).all():
        raise RanAway("the flight on the other side of an impact ran away")
    guess = Poses(pose.R, pose.t + pose.R @ neighbour.body.com_particle, np.full(1, np.inf))
    refined = refine(one.silhouettes, guess, task.views, iterations=40)
    return FoundPoses(refined, pose_errors(one.silhouettes, refined, task.views).rms_of_each_px)


def _joint(task: FitTask, flights: list[Flight], impacts_s: Array) -> Solution[PiecewiseFlight]:
    """All segments at once, from where the separate flights meet; from the kinks where they meet nowhere near."""
    frame_s = float(np.median(np.diff(np.unique(task.sightings.times_s))))
    viewing = task.sightings.cameras[0].R_cam_world[2]
    meeting = [meeting_time(a, b, float(t), viewing) for a, b, t in zip(flights[:-1], flights[1:], impacts_s, strict=True)]
    times = [m if abs(m - t) < 2.0 * frame_s else float(t) for m, t in zip(meeting, impacts_s, strict=True)]
    start = joined(flights, times, 0.5 * (float(task.sightings.times_s.min()) + times[0]))
    if np.any(np.diff([start.first.time_s, *start.times_s]) <= 0.0):
        start = joined(flights, impacts_s.tolist(), 0.5 * (float(task.sightings.times_s.min()) + float(impacts_s[0])))
    return _best_sense(task, fit(task, start), viewing)


def _best_sense(task: FitTask, solution: Solution[PiecewiseFlight], viewing: Array) -> Solution[PiecewiseFlight]:
    """The best of a solution and those in which a segment that turns little turns the other way across the line of sight."""
    if len(task.sightings.cameras) > 1:
        return solution
    ends = (float(task.sightings.times_s.min()), float(task.sightings.times_s.max()))
    others = [fit(task, other) for other in reversed_turns(solution.state, ends, viewing)]
    return min((solution, *others), key=lambda s: s.equations.cost)


def refined_chain(
    seen: Seen, task: FitTask, flight: PiecewiseFlight, configuration: Configuration, plate: PlateTask | None = None
) -> PiecewiseRefined:
    """The last refinement; ``plate``: what it is held to."""
    return refine_piecewise(prepared_task(seen, task, flight, configuration), flight, refinement_settings(configuration), plate)


def prepared_task(seen: Seen, task: FitTask, flight: PiecewiseFlight, configuration: Configuration) -> FitTask:
    """The task with the outlines' bias predicted under a flight and without pairs seen from nearly one line.

    Not of outlines from pictures: picturing all of them again at every refinement doubles the computing time.
    """
    pictured = pictures_of(seen.observation, seen.tracks, task.sightings) is not None
    return with_clear_angles(task if pictured else biased_task(seen.observation, task, seen.particle, flight, configuration), flight)
