"""One estimate of two particles that collide, from one observation.

Each particle gets the outlines that are its own, in pictures where the two are apart; the others are left out with a reason. With these
each is a sequence with one impact and is measured as such (:mod:`estimator.measuring.with_impacts`), from nothing; then both are fitted
jointly with one time of impact, and the collision is read off.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.estimate import CollisionEstimate, Estimate, Measured, Status
from datasets.observation import Frames, Observation
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask
from estimator.data.no_measurement import NoMeasurement
from estimator.fitting.problem import Fact
from estimator.fitting.refinement import solve
from estimator.fitting.tasks import refinement_settings
from estimator.fitting.trajectory import fit_jointly
from estimator.impacts.chains import EDGE_FRAMES, LEAST_JUMP, Seen, fitted_chains, prepared_task, task_of
from estimator.impacts.impact_judging import Chain, judge_chain, jumps
from estimator.impacts.impact_search import LEAST_JUMP_PX
from estimator.impacts.loose_contact import with_lasting_contacts
from estimator.measuring.by_samples import left_out_beside_contacts, on_all_samples, with_surface
from estimator.measuring.pair_by_samples import bound_together
from estimator.motion.piecewise import PiecewiseFlight
from estimator.motion.rigid_body import RanAway
from estimator.outlines.recording import outlines_of, view_outlines_of
from estimator.outlines.result import OutlineTrack
from estimator.pairs.apart import Run, joint_kink, runs_apart, track_of
from estimator.pairs.associating import LEAST_RATIO, LOOKED_AT, Assigned, Sought, assigned, best_miss_px, sought
from estimator.pairs.collision import collision_of
from estimator.pairs.pair_fit import SHARED, PairFlight, PairRefined, at_one_time, parts_of
from estimator.pairs.touching import Hulls, hulls_of, touching
from estimator.particle.particle import Particle, particle_of
from estimator.reports.impact_reporting import impacts_estimate
from estimator.reports.reporting import empty_estimate
from estimator.reports.verdict import failed
from estimator.search.candidate_flights import LOST_RMS_PX
from estimator.surface.joint import JointFit

Array = NDArray[np.float64]
KINK_STEP_FRAMES = 0.25
"""Between the times at which a kink of both paths is looked for: the joint fit finds the rest."""
NAMES = ("first", "second")
WORST = (Status.NO_CONVERGENCE, Status.SECOND_CONTACT, Status.AMBIGUOUS)
"""The pair's status is the worse of the two, in this order."""


@dataclass(frozen=True)
class SeenPair:
    """Both particles with their own outlines; ``ratio``: the least by which whose outline is whose was decided."""

    both: tuple[Seen, Seen]
    ratio: float
    runs: tuple[Run, ...]


@dataclass(frozen=True)
class Fitted:
    """Both at one time of impact: ``free``, and ``held`` such that their ``hulls`` touch then.

    ``joints``: where samples were fitted; ``why_not`` where they were to be.
    """

    free: PairRefined
    held: PairRefined
    hulls: Hulls
    joints: tuple[JointFit[PiecewiseFlight], ...] = ()
    why_not: str = ""


def measure_pair(observation: Observation, configuration: Configuration) -> Estimate:
    """Measure two particles that collide once; the second one's estimate is the ``companion`` of the first one's.

    Raises
    ------
    datasets.errors.InputError
        Where the observation contradicts itself, shows only one of the particles, never shows them apart before and after, or they do
        not collide.
    """
    seen = seen_pair(observation, configuration)
    impact_s = collision_time(observation, seen)
    tasks: list[FitTask] = []
    chains: list[list[Chain]] = []
    try:
        _check_edges(observation, seen, impact_s)
        for one in seen.both:
            tasks.append(task_of(one, configuration))
            chains.append(fitted_chains(one, tasks[-1], np.array([impact_s]), configuration))
        fitted = _joint(seen, (tasks[0], tasks[1]), (chains[0], chains[1]), configuration)
    except (NoMeasurement, RanAway) as failure:
        parts = [empty_estimate(one, configuration, failed(failure)) for one in seen.both]
        return replace(parts[0], companion=parts[1])
    _check_jumps(observation, fitted.free)
    return _told(observation, seen, (chains[0], chains[1]), fitted, configuration)


def seen_pair(observation: Observation, configuration: Configuration) -> SeenPair:
    """Both particles from their views, and the outlines that are each one's own.

    Raises
    ------
    datasets.errors.InputError
        As :func:`measure_pair`.
    """
    companion = observation.companion
    assert companion is not None
    if len(observation.cameras) != 1 or isinstance(observation.recordings[0], Frames):
        raise InputError(
            f"{observation.name}: expected the outlines of one high-speed camera where two particles are to be measured, "
            f"got {len(observation.cameras)} cameras{' with pictures' if isinstance(observation.recordings[0], Frames) else ''}"
        )
    camera = observation.cameras[0]
    for which, views in zip(NAMES, (observation.views, companion.views), strict=True):
        if not views:
            raise InputError(f"{observation.name}: expected calibrated views of both particles, got none of the {which} one")
    particles = tuple(
        _particle(replace(observation, views=views, view_recording=recording), which, configuration)
        for which, views, recording in zip(
            NAMES, (observation.views, companion.views), (observation.view_recording, companion.view_recording), strict=True
        )
    )
    larger, smaller = (
        outlines_of(r[0], camera.intrinsics, name=observation.name) for r in (observation.recordings, observation.further_recordings)
    )
    if not larger.used.any():
        raise InputError(f"{observation.name}: expected outlines that can be used, got none")
    looked_for = [sought(particle, larger, camera, configuration) for particle in particles]
    runs = runs_apart(larger, smaller)
    if not runs:
        raise InputError(_never_apart(observation, larger, (looked_for[0], looked_for[1])))
    decided = [assigned(run, (looked_for[0], looked_for[1])) for run in runs]
    both = [_alone(observation, particles[k], _own(runs, decided, k, (larger, smaller))) for k in (0, 1)]
    return SeenPair((both[0], both[1]), min(d.ratio for d in decided), tuple(runs))


def _particle(observation: Observation, which: str, configuration: Configuration) -> Particle:
    name = f"{observation.name}: the {which} particle"
    seen = view_outlines_of(observation.view_recording, observation.views, name=f"{name}, calibrated views")
    try:
        return particle_of(seen.outlines, observation.views, configuration)
    except InputError as error:
        raise InputError(f"{name}: {error}") from error


def _own(runs: list[Run], decided: list[Assigned], which: int, tracks: tuple[OutlineTrack, OutlineTrack]) -> OutlineTrack:
    return track_of(runs, [d.first if which == 0 else 1 - d.first for d in decided], *tracks)


def _alone(observation: Observation, particle: Particle, track: OutlineTrack) -> Seen:
    """One particle as if it were alone in the pictures."""
    return Seen(replace(observation, recordings=(track.outlines,), companion=None, further_recordings=()), (track,), particle)


def _never_apart(observation: Observation, larger: OutlineTrack, particles: tuple[Sought, Sought]) -> str:
    """What to say of pictures without two outlines: only one of the particles is there, or they never separate."""
    used = np.flatnonzero(larger.used)
    expected = f"{observation.name}: expected pictures with two outlines, before and after a collision, got none in a row"
    some = used[np.unique(np.linspace(0, len(used) - 1, LOOKED_AT).round().astype(int))]
    misses = [float(np.median([best_miss_px(larger.frames[k], particle) for k in some])) for particle in particles]
    if min(misses) < LOST_RMS_PX:
        return f"{expected}: only the {NAMES[int(np.argmin(misses))]} particle is seen"
    return f"{expected}: the particles never separate, or what is seen is neither of them"


def collision_time(observation: Observation, seen: SeenPair) -> float:
    """When both paths bend together (s), to about a frame.

    Raises
    ------
    datasets.errors.InputError
        Where they do not bend, or the particles are not seen apart before and after.
    """
    times = observation.clock.times_s
    frames = np.concatenate([run.frames for run in seen.runs])
    among = np.arange(frames.min() + 2, frames.max() - 2, KINK_STEP_FRAMES)
    hidden = np.setdiff1d(np.arange(frames.min(), frames.max() + 1), frames)
    if len(hidden):
        among = among[np.abs(among[:, None] - hidden).min(axis=1) <= 1.0]
    elif frames.min() > 0 or frames.max() < len(times) - 1:
        side = "before" if frames.min() == 0 else "after"
        raise InputError(
            f"{observation.name}: expected two particles that are apart before and after they collide, got them apart only {side}"
        )
    if len(among) == 0:
        raise InputError(
            f"{observation.name}: expected two particles that are apart for at least three pictures before and after a collision"
        )
    at, bends = joint_kink((seen.both[0].tracks[0], seen.both[1].tracks[0]), among)
    if max(bends) < LEAST_JUMP_PX:
        raise InputError(_no_collision(observation, f"their paths bend by {bends[0]:.2f} and {bends[1]:.2f} px per frame at most"))
    return float(np.interp(at, np.arange(len(times)), times))


def _no_collision(observation: Observation, found: str) -> str:
    return f"{observation.name}: expected two particles that collide, got two that pass one another: {found}"


def _check_edges(observation: Observation, seen: SeenPair, impact_s: float) -> None:
    """Refuse to measure where a side of the collision has three pictures or fewer of a particle."""
    times = observation.clock.times_s
    frame = float(np.interp(impact_s, times, np.arange(len(times))))
    for which, one in zip(NAMES, seen.both, strict=True):
        used = np.flatnonzero(one.tracks[0].used)
        counts = {"before": int(np.sum(used < frame)), "after": int(np.sum(used > frame))}
        side = min(counts, key=lambda name: counts[name])
        if counts[side] <= EDGE_FRAMES:
            raise NoMeasurement(
                Status.IMPACT_AT_EDGE,
                f"the {which} particle is apart in {counts[side]} pictures {side} the collision (frame {frame:.1f}): too few to measure.",
            )


def _joint(seen: SeenPair, tasks: tuple[FitTask, FitTask], chains: tuple[list[Chain], list[Chain]], configuration: Configuration) -> Fitted:
    """Both at one time of impact: fitted, then refined with the outlines' bias predicted, then held together."""
    own = [chain[0].solution for chain in chains]
    times = [s.state.layout[SHARED] for s in own]
    knowledge = [1.0 / float(np.linalg.pinv(s.equations.H, hermitian=True)[t, t].item()) for s, t in zip(own, times, strict=True)]
    start = at_one_time(own[0].state, own[1].state, (max(knowledge[0], 1e-9), max(knowledge[1], 1e-9)))
    fitted = fit_jointly(parts_of(tasks, start), start)
    if not np.isfinite(fitted.equations.cost):
        raise RanAway("the pair's flights cannot be flown together")
    pair = fitted.state
    ready = [prepared_task(*each, configuration) for each in zip(seen.both, tasks, pair.both, strict=True)]
    hulls, settings = hulls_of((seen.both[0].particle, seen.both[1].particle)), refinement_settings(configuration)
    facts: list[Fact[PairFlight]] = [lambda there: touching(there, hulls)]
    why_not = ""
    if all(left_out_beside_contacts(one.particle, configuration) is None for one in seen.both):
        lasting = PairFlight(with_lasting_contacts(pair.first), with_lasting_contacts(pair.second))
        led = solve(parts_of(ready, lasting), lasting, settings)
        of_each = zip(led.parts, tasks, seen.both, strict=True)
        (first, why), (second, or_why) = (on_all_samples(part, task, one.particle, configuration) for part, task, one in of_each)
        if first is not None and second is not None:
            joints = (first, second)
            return Fitted(bound_together(joints, led), bound_together(joints, led, facts), hulls, joints)
        why_not = why if first is None else or_why
    free = solve(parts_of(ready, pair), pair, settings)
    return Fitted(free, solve(parts_of(ready, pair), free.state, settings, facts), hulls, why_not=why_not)


def _check_jumps(observation: Observation, refined: PairRefined) -> None:
    """Refuse two flights of which neither jumps."""
    found = [jumps(part)[0] for part in refined.parts]
    if max(found) < LEAST_JUMP:
        raise InputError(_no_collision(observation, "neither one's velocity jumps"))


def _told(
    observation: Observation, seen: SeenPair, chains: tuple[list[Chain], list[Chain]], fitted: Fitted, configuration: Configuration
) -> Estimate:
    outcomes = [judge_chain(chain, part, configuration) for chain, part in zip(chains, fitted.held.parts, strict=True)]
    status, message = _together(outcomes, seen.ratio)
    parts = []
    for one, chain, part in zip(seen.both, chains, fitted.held.parts, strict=True):
        parts.append(impacts_estimate(one, chain[0].found, part, (status, message), configuration=configuration))
    parts = [with_surface(*each, "") for each in zip(parts, fitted.joints, strict=True)] if fitted.joints else parts
    if status is Status.NO_CONVERGENCE:
        return replace(parts[0], companion=parts[1])
    particles = (seen.both[0].particle, seen.both[1].particle)
    collision = collision_of(fitted.free, fitted.held, fitted.hulls, particles, observation)
    parts[0] = with_surface(parts[0], None, fitted.why_not)
    first = replace(parts[0], statistics={**parts[0].statistics, "assignment_ratio": seen.ratio})
    return replace(first, companion=parts[1], collision=collision, message=f"{first.message} {sentence(collision)}")


def _together(outcomes: list[tuple[Status, str]], ratio: float) -> tuple[Status, str]:
    for status in WORST:
        for which, (found, message) in zip(NAMES, outcomes, strict=True):
            if found is status:
                return status, f"the {which} particle: {message}"
    if ratio < LEAST_RATIO:
        return Status.AMBIGUOUS, f"the particles are so much alike that whose outline is whose is open (ratio of squares {ratio:.2f})."
    return Status.CONVERGED, "converged: two particles that collide."


def sentence(collision: CollisionEstimate) -> str:
    """The collision in words."""
    c = collision
    source = "by the hulls' volumes, equal density taken for granted" if c.mass_source == "volumes" else "as weighed"
    kept = "is kept" if c.momentum_kept else "is NOT kept"
    return (
        f"e = {_words(c.restitution)}, impulse ratio {_words(c.impulse_ratio)}; "
        f"with the mass ratio {c.mass_ratio.value:.3f} ({source}) momentum {kept}; momentum itself gives "
        f"{_words(c.momentum_mass_ratio)}."
    )


def _words(measured: Measured) -> str:
    return f"{measured.value:.3f} ± {measured.sigma:.3f}"
