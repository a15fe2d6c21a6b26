"""From an observation to an estimate: outlines, particle, pose, track, trajectory, refinement, each with a way to say that it failed.

The chain is visible in :func:`estimate`; every step that cannot go on raises :class:`NoMeasurement` with a status, so there is never a
plausible number without one.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.estimate import Estimate, Status
from datasets.observation import Frames, Observation
from estimator.configuration import Configuration
from estimator.fitting.adequacy import misfit
from estimator.fitting.calibration_share import CalibrationShare, calibration_share
from estimator.fitting.flight_starts import at_time, best_spin, best_start, flight_of_track, starts_along
from estimator.fitting.focal_refinement import FocalRefined, refine_with_focal
from estimator.fitting.focal_search import FocalPrior
from estimator.fitting.levenberg_marquardt import Outcome, Solution
from estimator.fitting.noise_model import measured_noise
from estimator.fitting.pose_refinement import Views
from estimator.fitting.pose_search import FoundPoses, SearchEffort, search_pose
from estimator.fitting.refinement import NothingSeen, Refined, Refinement, refine_flight, with_noise_of
from estimator.fitting.tracking import Track, track
from estimator.fitting.trajectory import FitTask, Prior, Sightings, errors_of, fit, fit_growing, particle_poses, unbiased_errors
from estimator.fitting.viewing_angles import with_clear_angles
from estimator.geometry.silhouettes import silhouettes
from estimator.motion.flight import N_PARAMETERS, Flight, poses, poses_and_sensitivity
from estimator.motion.rigid_body import RanAway
from estimator.motion.rotation import rotation_vector
from estimator.outlines.behind_plate import beside_plate
from estimator.outlines.pictured import Pictures
from estimator.outlines.recording import outlines_of, view_outlines_of
from estimator.outlines.result import FrameStatus, OutlineTrack
from estimator.particle import Particle, particle_of, views_like
from estimator.predicted_bias import with_predicted_bias
from estimator.reporting import converged_estimate, empty_estimate
from estimator.rival_flights import Standing, few_views, other_side, standing
from estimator.surface.joint import joint_fit

Array = NDArray[np.float64]
LOST_RMS_PX = 1.0
SEARCHED_FRAMES = 5
GOOD_COST = 4.0
"""Cost per pair (1 is expected) of a trajectory that fits: no spins are drawn for it."""
LOWER = 0.999
"""Share of a cost below which another is that of another minimum."""
RIVAL_POSE, RIVAL_TRACK = 25.0, 3.0
"""A pose minimum or a track that costs more than this many times the best is no rival once a trajectory fits."""
FEW_VIEW_STARTS, FEW_VIEW_CANDIDATES, FEW_VIEW_FLIGHTS = 200, 24, 6
"""Effort of the search where views are few: the right pose was the fourth minimum of a real picture with five views."""
SAME_DEG = 10.0
"""A pose found in another picture is another one when it is further than this from the fitted flight."""


HOLLOW_MOMENTS, HOLLOW_PRODUCTS = 0.2, 0.08
"""Relative errors of the visual hull's moments and products of inertia over the empty share of its outlines' convex hulls.

Of 14 jagged bodies, 0.03 to 0.12 of it empty, moments were off by 0.019 and products by 0.0056; of 12 convex ones by 0.006 and 0.0023."""
HULL_COM, HULL_MOMENTS, HULL_PRODUCTS, HULL_VIEWS = 0.0039, 0.019, 0.012, 6
"""Errors of the visual hull of six views: centre of mass (share of the extent), moments and products (relative); k views: (6 / k)^(2/3).

RMS of 12 cut stones, where 12 views gave 0.0026, 0.0123, 0.0078 and 24 gave 0.0016, 0.0091, 0.0039. Priors are no narrower."""
RAN_AWAY = "no flight fits the outlines: every fit ran away to spins that no particle has."
UNDETERMINED = "the usable pictures do not determine the flight: of some combination of its numbers they say nothing."


class NoMeasurement(Exception):
    """A step could not go on; carries the status and a sentence for the user."""

    def __init__(self, status: Status, message: str) -> None:
        super().__init__(message)
        self.status = status
        self.message = message


@dataclass(frozen=True)
class Candidate:
    """One pose minimum followed through the sequence and fitted."""

    start_rms_px: float
    solution: Solution[Flight]


def estimate(observation: Observation, configuration: Configuration) -> Estimate:
    """Measure one sequence from its observation alone.

    Raises
    ------
    datasets.errors.InputError
        Where the observation contradicts itself: sizes, numbers of pictures, views that do not agree.
    """
    check_focal_prior(observation, configuration)
    return estimate_free_flight(observation, tracks_of(observation), observed_particle(observation, configuration), configuration)


def check_focal_prior(observation: Observation, configuration: Configuration) -> None:
    """Refuse to measure the focal length of several cameras."""
    if configuration.focal_prior > 0.0 and len(observation.cameras) > 1:
        raise InputError(
            f"{observation.name}: expected one high-speed camera where its focal length is to be measured (focal_prior > 0), "
            f"got {len(observation.cameras)}"
        )
    if configuration.focal_prior > 0.0 and configuration.surface_fit:
        raise InputError(f"{observation.name}: expected focal_prior = 0 where surface_fit = 1, got {configuration.focal_prior:g}")


def estimate_free_flight(
    observation: Observation, tracks: tuple[OutlineTrack, ...], particle: Particle, configuration: Configuration
) -> Estimate:
    """The estimate from what was seen, as one free flight."""
    try:
        return _estimated(observation, tracks, particle, configuration)
    except NoMeasurement as failure:
        return empty_estimate(observation, tracks, particle, configuration, (failure.status, failure.message))
    except RanAway as failure:
        return empty_estimate(observation, tracks, particle, configuration, failed(failure))


def failed(failure: RanAway) -> tuple[Status, str]:
    """Status and what to say of a fit that ended so."""
    return (Status.NOT_ENOUGH_FRAMES, UNDETERMINED) if isinstance(failure, NothingSeen) else (Status.NO_CONVERGENCE, RAN_AWAY)


def _estimated(observation: Observation, tracks: tuple[OutlineTrack, ...], particle: Particle, configuration: Configuration) -> Estimate:
    sightings = usable_sightings(observation, tracks, configuration)
    pictures = pictures_of(observation, tracks, sightings)
    views = views_like(particle, sightings.silhouettes, np.random.default_rng(configuration.seed), pictures)
    task = fit_task(observation, particle, sightings, views, configuration)
    found, reference = first_pose(task, particle, configuration)
    candidates = candidate_flights(observation, task, particle, (found, reference), configuration)
    if _misses(task, candidates[0]):
        candidates = _with_other_references(observation, task, particle, (candidates, reference), configuration)
    if few_views(particle):
        candidates += _from_another_side(observation, task, particle, (candidates, reference), configuration)
    contest = standing(task, particle, [c.solution for c in candidates], ambiguity=configuration.ambiguity)
    flight = contest.flights[0].state
    biased = biased_task(observation, task, particle, flight, configuration, pictures=pictures)
    refined, focal = refined_flight(biased, flight, configuration)
    if configuration.surface_fit:
        refined = on_all_samples(refined, task, particle, configuration)
    status, message = judge(_without_the_same(biased, contest, refined, configuration), refined)
    tested = misfit(with_clear_angles(biased, flight), refined, refinement_settings(configuration)) if focal is None else None
    outcome = (status, message, tested)
    share = None if focal is not None else calibration_of(biased, observation, refined.flight, configuration)
    shown = (particle, found)
    return converged_estimate(observation, tracks, shown, refined, outcome, configuration=configuration, focal=focal, share=share)


def tracks_of(observation: Observation) -> tuple[OutlineTrack, ...]:
    """The outlines that each high-speed camera recorded, without frames of which a plate hides a part."""
    tracks = (
        outlines_of(r, c.intrinsics, name=f"{observation.name}, camera {c.name}")
        for r, c in zip(observation.recordings, observation.cameras, strict=True)
    )
    return tuple(beside_plate(track, observation, number) for number, track in enumerate(tracks))


def observed_particle(observation: Observation, configuration: Configuration) -> Particle:
    """The particle as the calibrated views show it."""
    seen = view_outlines_of(observation.view_recording, observation.views, name=f"{observation.name}, calibrated views")
    return particle_of(seen.outlines, observation.views, configuration, observation.made)


def biased_task(
    observation: Observation,
    task: FitTask,
    particle: Particle,
    flight: Flight,
    configuration: Configuration,
    *,
    pictures: Pictures | None = None,
) -> FitTask:
    """The task with the outlines' bias predicted under a first flight; ``pictures``: how those of the sightings show outlines."""
    pairs, rng = bias_pairs(observation, configuration), np.random.default_rng(configuration.seed)
    return with_predicted_bias(task, particle, flight, pairs=pairs, rng=rng, pictures=pictures)


def bias_pairs(observation: Observation, configuration: Configuration) -> int:
    """Pairs of draws from which the outlines' bias is predicted; 0 where some come from pictures and some were given as such."""
    pictured = {isinstance(recording, Frames) for recording in observation.recordings}
    return configuration.bias_pairs if len(pictured) == 1 else 0


def pictures_of(observation: Observation, tracks: tuple[OutlineTrack, ...], sightings: Sightings) -> Pictures | None:
    """How the sightings' pictures show outlines; none where outlines were given as such by any camera."""
    if not all(isinstance(recording, Frames) for recording in observation.recordings):
        return None
    return Pictures.of([tracks[int(c)].frames[int(f)] for c, f in zip(sightings.camera, sightings.frame, strict=True)])


def refined_flight(task: FitTask, flight: Flight, configuration: Configuration) -> tuple[Refined, FocalRefined | None]:
    """The last refinement, with the focal length among the parameters where the configuration says that it is not known."""
    settings = refinement_settings(configuration)
    task = with_clear_angles(task, flight)
    if configuration.focal_prior == 0.0:
        return refine_flight(task, flight, settings), None
    focal = refine_with_focal(task, flight, settings, FocalPrior(configuration.focal_prior))
    return focal.refined, focal


def on_all_samples(refined: Refined, task: FitTask, particle: Particle, configuration: Configuration) -> Refined:
    """The flight fitted once more, to every outline sample and with the surface as an unknown."""
    joint = joint_fit(particle, task.sightings, refined.flight, task.prior, huber=configuration.huber, seed=configuration.seed)
    predicted = poses(joint.flight, np.zeros((1, N_PARAMETERS)), task.sightings.times_s)
    settled = refined.settled and joint.settled
    return replace(refined, flight=joint.flight, covariance=joint.covariance, predicted=predicted, settled=settled)


def calibration_of(task: FitTask, observation: Observation, flight: Flight, configuration: Configuration) -> CalibrationShare | None:
    """What the stated uncertainty of camera and gravity adds to that of a refined flight."""
    if observation.gravity_covariance is None and all(camera.lens_covariance is None for camera in observation.cameras):
        return None
    settings = refinement_settings(configuration)
    task = with_clear_angles(task, flight)
    predicted, _ = poses_and_sensitivity(flight, task.sightings.times_s)
    task, _ = with_noise_of(task, unbiased_errors(task, flight, predicted))
    return calibration_share(task, flight, settings, observation.gravity_covariance)


def refinement_settings(configuration: Configuration) -> Refinement:
    """What the last refinement needs of the configuration."""
    return Refinement(floor_px=configuration.floor_px, body_noise_px=configuration.body_noise_px, within_pairs=configuration.within_pairs)


def usable_sightings(
    observation: Observation, tracks: tuple[OutlineTrack, ...], configuration: Configuration, *, in_part: bool = False
) -> Sightings:
    """The silhouettes of all cameras that are used, in the order of time within each camera; ``in_part``: those too that are used in part.

    Raises
    ------
    NoMeasurement
        Where there are fewer than the configuration asks for.
    """
    places = [(c, int(f)) for c, t in enumerate(tracks) for f in np.flatnonzero(t.seen if in_part else t.used)]
    shown = [tracks[c].frames[f] for c, f in places]
    cameras = [observation.cameras[c].intrinsics for c, _ in places]
    hulls = silhouettes([s.outline for s in shown], cameras, unsure=[s.unsure for s in shown]) if places else None
    usable = np.flatnonzero(np.diff(hulls.offsets) > 0) if hulls is not None else np.zeros(0, dtype=np.int64)
    whole = sum(shown[i].used for i in usable)
    if hulls is None or whole < configuration.minimum_frames:
        raise _too_few(tracks, whole, configuration.minimum_frames)
    camera = np.array([places[i][0] for i in usable], dtype=np.int64)
    frame = np.array([places[i][1] for i in usable], dtype=np.int64)
    outlines = tuple(shown[i].outline.points_px for i in usable)
    return Sightings(hulls.take(usable.tolist()), camera, frame, observation.clock.times_s[frame], observation.cameras, outlines)


def _too_few(tracks: tuple[OutlineTrack, ...], usable: int, wanted: int) -> NoMeasurement:
    reasons = [r for t in tracks for r, u in zip(t.reasons, t.used, strict=True) if not u]
    counts = ", ".join(f"{reasons.count(r)} {r}" for r in dict.fromkeys(reasons))
    outside = sum(r in {str(FrameStatus.CUT_OFF), str(FrameStatus.ABSENT)} for r in reasons)
    status = Status.OUT_OF_VIEW if outside > 0.5 * sum(len(t) for t in tracks) else Status.NOT_ENOUGH_FRAMES
    return NoMeasurement(status, f"{usable} usable pictures, at least {wanted} are needed" + (f"; left out: {counts}." if counts else "."))


def fit_task(observation: Observation, particle: Particle, sightings: Sightings, views: Views, configuration: Configuration) -> FitTask:
    """The fit's task: silhouettes, views and what holds the body and the outline offset."""
    measured = any(isinstance(r, Frames) for r in observation.recordings)
    fewer = (HULL_VIEWS / len(views.silhouettes)) ** (2.0 / 3.0)
    prior = Prior(
        com_m=max(configuration.com_prior, HULL_COM * fewer) * particle.extent_m,
        inertia=math.hypot(max(configuration.inertia_prior, HULL_MOMENTS * fewer), HOLLOW_MOMENTS * particle.hollow),
        inertia_products=math.hypot(max(configuration.inertia_products_prior, HULL_PRODUCTS * fewer), HOLLOW_PRODUCTS * particle.hollow),
        offset_px=configuration.frame_offset_prior_px if measured else configuration.offset_prior_px,
    )
    weight = np.ones((len(sightings), len(views.silhouettes)))
    return FitTask(sightings, views, prior, configuration.huber, weight)


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
        candidates.append(Candidate(float(found.rms_px[row]), solution))
    return sorted(candidates, key=lambda c: c.solution.equations.cost)


def _good(task: FitTask, solution: Solution[Flight]) -> bool:
    return solution.equations.cost <= GOOD_COST * task.weight.size


def _from_other_starts(
    task: FitTask, followed: Track, first: tuple[Flight, Solution[Flight]], configuration: Configuration, rng: np.random.Generator
) -> Solution[Flight]:
    """The best of a solution and that from elsewhere on its track and, where both are poor, from drawn angular velocities.

    A minimum beside the right one may cost 1.5 times as much (decision 26), less than an effect that is not in the model makes the right
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


def _misses(task: FitTask, candidate: Candidate) -> bool:
    """Whether a trajectory leaves errors so far above the outlines' noise that it is no measurement."""
    if _good(task, candidate.solution):
        return False
    if not np.isfinite(candidate.solution.equations.cost):
        return True
    flight = candidate.solution.state
    errors = errors_of(task, flight, poses(flight, np.zeros((1, N_PARAMETERS)), task.sightings.times_s))
    return measured_noise(errors).mean_square > MOST_MEAN_SQUARE


def _with_other_references(
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
        if not _misses(task, candidates[0]):
            break
    return candidates


def _from_another_side(
    observation: Observation, task: FitTask, particle: Particle, tried: tuple[list[Candidate], int], configuration: Configuration
) -> list[Candidate]:
    """Flights from minima of a picture of another side that are not the best flight's pose there and that its cost does not exclude."""
    candidates, reference = tried
    best = candidates[0].solution.state
    other = other_side(task, best, reference)
    if other is None:
        return []
    found = _found(task, particle, other, configuration)
    flown = poses(best, np.zeros((1, N_PARAMETERS)), task.sightings.times_s[[other]])
    there = particle_poses(best, flown, task.sightings.take(np.array([other]))).R[0]
    turned = np.degrees(np.linalg.norm(rotation_vector(found.poses.R @ there.T), axis=-1))
    rows = np.flatnonzero((turned > SAME_DEG) & (found.poses.cost < GOOD_COST))[:FEW_VIEW_FLIGHTS]
    if len(rows) == 0:
        return []
    rivals = FoundPoses(found.poses.take(rows), found.rms_px[rows])
    return candidate_flights(observation, task, particle, (rivals, other), configuration)


def _without_the_same(task: FitTask, contest: Standing, refined: Refined, configuration: Configuration) -> Standing:
    """The contest without rivals that the last refinement brings to where it has brought the first: they were on the way."""
    rivals = [s for s in contest.rivals if not same_flight(s.state, contest.flights[0].state)]
    apart = []
    for rival in rivals:
        try:
            other = refined_flight(task, rival.state, configuration)[0]
        except RanAway:
            continue
        if not same_flight(other.flight, refined.flight):
            apart.append(rival)
    return replace(contest, rivals=tuple(apart))


def judge(contest: Standing, refined: Refined) -> tuple[Status, str]:
    """The status that the result deserves, and why."""
    best = contest.flights[0]
    numbers = np.concatenate([refined.flight.x, refined.flight.v, refined.flight.omega, np.diag(refined.covariance)])
    rms = refined.errors.rms_px
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
    if contest.rivals:
        ratio = contest.rivals[0].equations.cost / best.equations.cost
        said = f"the outlines do not refuse another trajectory (cost ratio {ratio:.3f}): more frames or views would decide."
        return Status.AMBIGUOUS, said
    if contest.outside_px > 0.0:
        return (
            Status.AMBIGUOUS,
            f"the outlines reach {contest.outside_px:.1f} px further out of the visual hull than noise and views explain: the pose may be "
            "a wrong one that meets the tangents by chance; more views would decide.",
        )
    return Status.CONVERGED, "converged."


MOST_MEAN_SQUARE = 16.0
"""Errors four times as large as the outlines' own noise: the trajectory is not that of this particle."""


def same_flight(a: Flight, b: Flight) -> bool:
    """Whether two flights agree in orientation (3°) and spin (3%)."""
    a = at_time(a, b.time_s)
    turn = 2.0 * np.arccos(min(1.0, abs(float(a.q @ b.q))))
    spin = np.linalg.norm(a.omega - b.omega) <= 0.03 * np.linalg.norm(b.omega) + 1.0
    return bool(turn < np.radians(3.0) and spin)
