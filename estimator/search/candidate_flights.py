"""Candidate flights: poses of some pictures, each followed through the sequence and fitted, and those near the best one."""

from dataclasses import dataclass, replace

import numpy as np

from datasets.estimate import Status
from datasets.observation import Observation
from estimator.appearance.flight_errors import errors_of, particle_poses
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask
from estimator.data.no_measurement import NoMeasurement
from estimator.fitting.levenberg_marquardt import Solution
from estimator.fitting.refinement import Refined
from estimator.fitting.tasks import refined_flight
from estimator.fitting.trajectory import fit, fit_growing
from estimator.likelihood.noise_model import measured_noise
from estimator.motion.flight import Flight, Motion, flown
from estimator.motion.rigid_body import RanAway
from estimator.motion.rotation import rotation_vector
from estimator.particle.particle import Particle
from estimator.poses.pose_search import FoundPoses, SearchEffort, search_pose
from estimator.search.flight_starts import at_time, best_spin, best_start, flight_of_track, starts_along
from estimator.search.rival_flights import Standing, few_views, other_side
from estimator.search.tracking import Track, track

LOST_RMS_PX = 1.0
"""Tangency error of a picture's best pose above which other pictures are searched, too: noise leaves tenths. By judgement."""
SEARCHED_FRAMES = 5
"""Pictures that are searched for a pose at most, spread over the sequence. By judgement."""
GOOD_COST = 4.0
"""Cost per pair (1 is expected) of a trajectory that fits: no spins are drawn for it."""
LOWER = 0.999
"""Share of a cost below which another is that of another minimum (notebook 26)."""
RIVAL_POSE, RIVAL_TRACK = 25.0, 3.0
"""A pose minimum or a track that costs more than this many times the best is no rival once a trajectory fits."""
FEW_VIEW_STARTS, FEW_VIEW_CANDIDATES, FEW_VIEW_FLIGHTS = 200, 24, 6
"""Effort of the search where views are few: the right pose was the fourth minimum of a real picture with five views."""
SAME_DEG = 10.0
"""A pose found in another picture is another one when it is further than this from the fitted flight."""


@dataclass(frozen=True)
class Candidate:
    """One pose minimum followed through the sequence and fitted."""

    solution: Solution[Flight]


def first_pose(task: FitTask, particle: Particle, configuration: Configuration) -> tuple[FoundPoses, int]:
    """Search the sighting nearest the middle; when its best pose misses by more than a pixel, try others and keep the best.

    Raises
    ------
    NoMeasurement
        Where no start converges anywhere.
    """
    best: tuple[FoundPoses, int] | None = None
    for reference in _references(task):
        found = _found(task, particle, reference, configuration)
        if len(found.rms_px) and (best is None or found.rms_px[0] < best[0].rms_px[0]):
            best = (found, reference)
        if best is not None and best[0].rms_px[0] < LOST_RMS_PX:
            return best
    if best is None:
        raise NoMeasurement(
            Status.NO_CONVERGENCE, "no start of the pose search converged: the outlines may not show the particle of the calibrated views."
        )
    return best


def _references(task: FitTask) -> list[int]:
    """Sightings worth a pose search, those nearest the middle first; whole ones where there are any."""
    whole = np.flatnonzero(task.sightings.silhouettes.whole)
    rows = whole if len(whole) else np.arange(len(task.sightings))
    n = len(rows)
    order = np.unique(np.linspace(0, n - 1, SEARCHED_FRAMES + 2).round().astype(int)[1:-1])
    return [int(reference) for reference in rows[order[np.argsort(np.abs(order - n // 2), kind="stable")]]]


def _found(task: FitTask, particle: Particle, reference: int, configuration: Configuration) -> FoundPoses:
    effort = SearchEffort(starts=configuration.pose_starts, candidates=configuration.pose_candidates)
    if few_views(particle):
        effort = SearchEffort(starts=max(effort.starts, FEW_VIEW_STARTS), candidates=max(effort.candidates, FEW_VIEW_CANDIDATES))
    return search_pose(task.sightings.silhouettes.take([reference]), task.views, particle.catalogue, effort)


def candidate_flights(
    observation: Observation, task: FitTask, particle: Particle, start: tuple[FoundPoses, int], configuration: Configuration
) -> list[Candidate]:
    """The best pose minima, each tracked and fitted, by ascending cost.

    A second one is tried only while the first misses by much or competes. Where views are few the cheapest minimum may owe its cost to
    chance, so every other that costs no more than noise competes.
    """
    found, reference = start
    time_s = float(task.sightings.times_s[reference])
    gravity = np.asarray(observation.gravity_world, dtype=np.float64)
    rng = np.random.default_rng(configuration.seed)
    candidates: list[Candidate] = []
    first_cost = np.inf
    by_chance = GOOD_COST if few_views(particle) and configuration.trajectory_candidates > 1 else 0.0
    most = FEW_VIEW_FLIGHTS if by_chance else configuration.trajectory_candidates
    for row in range(min(most, len(found.rms_px))):
        fits = bool(candidates) and min(c.solution.equations.cost for c in candidates) < GOOD_COST * task.weight.size
        if fits and found.poses.cost[row] > max(RIVAL_POSE * found.poses.cost[0], by_chance):
            break
        followed = track(task.sightings, task.views, reference, found.poses.take(np.array([row])))
        typical = float(np.median(followed.cost))
        if fits and typical > max(RIVAL_TRACK * first_cost, by_chance):
            continue
        first_cost = min(first_cost, typical)
        flight = flight_of_track(followed, particle.body, gravity, time_s=time_s)
        solution = fit_growing(task, flight)
        if not fits:
            solution = _from_other_starts(task, followed, (flight, solution), configuration, rng)
        candidates.append(Candidate(solution))
    return sorted(candidates, key=lambda c: c.solution.equations.cost)


def _good(task: FitTask, solution: Solution[Flight]) -> bool:
    return solution.equations.cost <= GOOD_COST * task.weight.size


def _from_other_starts(
    task: FitTask, followed: Track, first: tuple[Flight, Solution[Flight]], configuration: Configuration, rng: np.random.Generator
) -> Solution[Flight]:
    """The best of a solution and that from elsewhere on its track and, where both are poor, from drawn angular velocities.

    A minimum beside the right one may cost 1.5 times as much (notebook 26), less than an effect that is not in the model makes the right
    one cost: what a poor solution is does not show in one sequence, so elsewhere is always tried.
    """
    flight, solution = first
    try:
        elsewhere = best_start(task, starts_along(followed, flight.body, flight.gravity_world))
        again = fit(task, at_time(fit_growing(task, elsewhere).state, flight.time_s))
    except RanAway:
        again = solution
    if again.equations.cost < LOWER * solution.equations.cost:
        solution = again
    if _good(task, solution) or not configuration.momentum_starts:
        return solution
    drawn = best_spin(task, flight, limit_rads=configuration.largest_spin_rads, count=configuration.momentum_starts, rng=rng)
    return min(solution, fit_growing(task, drawn), key=lambda s: s.equations.cost)


def misses(task: FitTask, candidate: Candidate) -> bool:
    """Whether a trajectory leaves errors so far above the outlines' noise that it is no measurement."""
    if _good(task, candidate.solution):
        return False
    if not np.isfinite(candidate.solution.equations.cost):
        return True
    flight = candidate.solution.state
    errors = errors_of(task, flight, flown(flight, task.sightings.times_s))
    return measured_noise(errors).mean_square > MOST_MEAN_SQUARE


def with_other_references(
    observation: Observation, task: FitTask, particle: Particle, tried: tuple[list[Candidate], int], configuration: Configuration
) -> list[Candidate]:
    """The candidates, and the best pose of other sightings tracked and fitted until one does not miss: the first may show a bad side."""
    candidates, first = tried
    once = replace(configuration, trajectory_candidates=1, momentum_starts=0)
    for reference in _references(task):
        found = _found(task, particle, reference, configuration) if reference != first else None
        if found is None or len(found.rms_px) == 0:
            continue
        candidates = [*candidates, *candidate_flights(observation, task, particle, (found, reference), once)]
        candidates.sort(key=lambda c: c.solution.equations.cost)
        if not misses(task, candidates[0]):
            break
    return candidates


def from_another_side(
    observation: Observation, task: FitTask, particle: Particle, tried: tuple[list[Candidate], int], configuration: Configuration
) -> list[Candidate]:
    """Flights from minima of a picture of another side that are not the best flight's pose there and that its cost does not exclude."""
    candidates, reference = tried
    best = candidates[0].solution.state
    other = other_side(task, best, reference)
    if other is None:
        return []
    found = _found(task, particle, other, configuration)
    there = particle_poses(best, flown(best, task.sightings.times_s[[other]]), task.sightings.take(np.array([other]))).R[0]
    turned = np.degrees(np.linalg.norm(rotation_vector(found.poses.R @ there.T), axis=-1))
    rows = np.flatnonzero((turned > SAME_DEG) & (found.poses.cost < GOOD_COST))[:FEW_VIEW_FLIGHTS]
    if len(rows) == 0:
        return []
    rivals = FoundPoses(found.poses.take(rows), found.rms_px[rows])
    return candidate_flights(observation, task, particle, (rivals, other), configuration)


def without_the_same(task: FitTask, ranked: Standing, refined: Refined[Motion], configuration: Configuration) -> Standing:
    """The ranked flights without rivals that the last refinement brings to where it has brought the first: they were on the way."""
    rivals = [s for s in ranked.rivals if not same_flight(s.state, ranked.flights[0].state)]
    apart = []
    for rival in rivals:
        try:
            other = refined_flight(task, rival.state, configuration)
        except RanAway:
            continue
        if not same_flight(other.flight.first, refined.flight.first):
            apart.append(rival)
    return replace(ranked, rivals=tuple(apart))


MOST_MEAN_SQUARE = 16.0
"""Errors four times as large as the outlines' own noise: the trajectory is not that of this particle."""


def same_flight(a: Flight, b: Flight) -> bool:
    """Whether two flights agree in orientation (3°) and spin (3%)."""
    a = at_time(a, b.time_s)
    turn = 2.0 * np.arccos(min(1.0, abs(float(a.q @ b.q))))
    spin = np.linalg.norm(a.omega - b.omega) <= 0.03 * np.linalg.norm(b.omega) + 1.0
    return bool(turn < np.radians(3.0) and spin)
