"""The instrument: one estimate from one observation. How a picture becomes a number is read from here.

1. :func:`.outlines.sightings.tracks_of`: each picture of a high-speed camera becomes an outline in pixels, or a reason why there is none.
2. :func:`.particle.observed.observed_particle`: outlines of the calibrated views become the particle: hull, mass properties, starts.
3. :func:`nominations`: kinks of the outlines' path say where an impact may be. A kink is only a reason to look.
4. :func:`.measuring.with_impacts.estimate_with_impacts`, where there are kinks: flights that meet at impacts, one joint fit. Where the fit
   finds no jump of the velocities, or no such flight fits, the sequence is measured as one free flight.
5. :func:`.measuring.free_flight.estimate_free_flight`, otherwise: pose search, tracking, fit, last refinement, judgement, report.
6. What is said of a sequence that neither describes: the particle rests, or broke; an input is faulty.

An observation of two particles goes its own way, :func:`.measuring.two_particles.measure_pair`, of the same steps. The page
``docs/architecture.md`` draws the way and the rooms that it goes through.
"""

from dataclasses import replace

import numpy as np

from datasets.estimate import Estimate, Status
from datasets.observation import Observation
from estimator.data.configuration import Configuration
from estimator.fitting.calibration_share import with_what_is_missing
from estimator.impacts.breakage import worse_part
from estimator.impacts.chains import Seen, nominations
from estimator.impacts.impact_search import Kink
from estimator.impacts.plate_holding import check_plate_settings
from estimator.measuring.free_flight import check_focal_prior, estimate_free_flight
from estimator.measuring.input_faults import input_fault, with_fault
from estimator.measuring.resting import resting_sentence
from estimator.measuring.two_particles import measure_pair
from estimator.measuring.with_impacts import estimate_with_impacts
from estimator.outlines.result import FrameStatus, OutlineTrack, left_out
from estimator.outlines.sightings import tracks_of
from estimator.particle.observed import observed_particle
from estimator.reports.clock_reporting import with_clocks_as_stamped

HEALTHY_MEAN_SQUARE = 1.0
"""Mean square of the errors over their variance; a free flight that leaves more is worth the question whether the particle falls at all."""
APART_FRAMES = 2.0
"""How far from a kink frames are taken where the flights before and after it are measured apart."""
WITHOUT_MEASUREMENT = (Status.NO_CONVERGENCE, Status.IMPACT_AT_EDGE)


def measure(observation: Observation, configuration: Configuration) -> Estimate:
    """Measure one sequence from its observation alone, with impacts where there are any.

    Raises
    ------
    datasets.errors.InputError
        Where the observation contradicts itself: sizes, numbers of pictures, views that do not agree; or where it states no plate and
        the configuration needs one.
    """
    check_focal_prior(observation, configuration)
    check_plate_settings(observation, configuration)
    if observation.companion is not None:
        return with_what_is_missing(measure_pair(observation, configuration), observation)
    seen = Seen(observation, tracks_of(observation), observed_particle(observation, configuration))
    estimate = with_clocks_as_stamped(with_what_is_missing(_measured(seen, configuration), observation), observation)
    fault = None if estimate.impacts else input_fault(seen, estimate, configuration)
    return estimate if fault is None else with_fault(estimate, fault)


def _measured(seen: Seen, configuration: Configuration) -> Estimate:
    """With impacts or as one free flight, and what is said of one that neither describes."""
    nominated, pieces = nominations(seen), None
    for kinks in nominated:
        pieces = estimate_with_impacts(seen, kinks, configuration)
        if pieces is not None and pieces.status not in WITHOUT_MEASUREMENT:
            return pieces
    whole = estimate_free_flight(seen, configuration)
    if not _doubtful(whole):
        return whole
    spin = None if whole.middle is None else float(np.linalg.norm(whole.middle.omega_world))
    resting = resting_sentence(seen, nominated[-1] if nominated else [], np.random.default_rng(configuration.seed), spin)
    if resting is not None:
        return without_numbers(whole, Status.RESTING, resting)
    if pieces is None or whole.status is not Status.NO_CONVERGENCE:
        return whole
    broke = _broke(seen, nominated[0], configuration) if pieces.status is Status.NO_CONVERGENCE else None
    return pieces if broke is None else without_numbers(whole, Status.BROKEN, broke)


def _broke(seen: Seen, kinks: list[Kink], configuration: Configuration) -> str | None:
    """What to say where the flight up to the strongest kink is that of the particle, and the one after it is not."""
    kink = max(kinks, key=lambda k: k.jump_px)
    quick = replace(configuration, trajectory_candidates=1, momentum_starts=0, surface_fit=0)
    parts = _only(seen.tracks, kink.frame - APART_FRAMES, before=True), _only(seen.tracks, kink.frame + APART_FRAMES, before=False)
    before, after = (estimate_free_flight(replace(seen, tracks=part), quick) for part in parts)
    return worse_part(before, after, kink.frame)


def _only(tracks: tuple[OutlineTrack, ...], frame: float, *, before: bool) -> tuple[OutlineTrack, ...]:
    """The tracks without the frames on the other side of ``frame``."""
    return tuple(
        OutlineTrack(tuple(f if (number < frame) is before else left_out(FrameStatus.ABSENT) for number, f in enumerate(track.frames)))
        for track in tracks
    )


def _doubtful(estimate: Estimate) -> bool:
    """Whether there is no free flight, or one that leaves errors so large that the particle may be held by something."""
    return estimate.status is Status.NO_CONVERGENCE or estimate.statistics.get("noise_mean_square", 0.0) > HEALTHY_MEAN_SQUARE


def without_numbers(estimate: Estimate, status: Status, message: str) -> Estimate:
    """What is left of an estimate whose numbers are no measurement."""
    return Estimate(
        name=estimate.name,
        status=status,
        message=message,
        frames=estimate.frames,
        statistics={key: value for key, value in estimate.statistics.items() if key != "momenta"},
        configuration=estimate.configuration,
        versions=estimate.versions,
    )
