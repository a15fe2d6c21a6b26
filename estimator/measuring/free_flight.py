"""From an observation to an estimate: outlines, particle, pose, track, trajectory, refinement, each with a way to say that it failed.

The chain is visible in :func:`_estimated`, a line a step; every step that cannot go on raises :class:`NoMeasurement` with a status, so
there is never a plausible number without one.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.estimate import Estimate
from datasets.observation import Observation
from estimator.data.configuration import Configuration
from estimator.data.no_measurement import NoMeasurement
from estimator.fitting.adequacy import misfit, widened
from estimator.fitting.refinement import Refined
from estimator.fitting.tasks import biased_task, fit_task, refined_flight
from estimator.impacts.chains import Seen
from estimator.measuring.by_samples import left_out, on_all_samples, share_of, unless_left, with_joint, with_surface
from estimator.motion.flight import Motion
from estimator.motion.rigid_body import RanAway
from estimator.outlines.sightings import pictures_of, tracks_of, usable_sightings
from estimator.particle.observed import observed_particle
from estimator.particle.particle import views_like
from estimator.reports.reporting import converged_estimate, empty_estimate
from estimator.reports.verdict import failed, judge
from estimator.search.candidate_flights import (
    candidate_flights,
    first_pose,
    from_another_side,
    misses,
    with_other_references,
    without_the_same,
)
from estimator.search.clock_alignment import aligned, unknown_clocks, with_clocks
from estimator.search.rival_flights import few_views, standing
from estimator.surface.joint import slow_misfit

Array = NDArray[np.float64]


def estimate(observation: Observation, configuration: Configuration) -> Estimate:
    """Measure one sequence from its observation alone.

    Raises
    ------
    datasets.errors.InputError
        Where the observation contradicts itself: sizes, numbers of pictures, views that do not agree.
    """
    check_focal_prior(observation, configuration)
    return estimate_free_flight(Seen(observation, tracks_of(observation), observed_particle(observation, configuration)), configuration)


def check_focal_prior(observation: Observation, configuration: Configuration) -> None:
    """Refuse to measure the focal length of several cameras."""
    if configuration.focal_prior > 0.0 and len(observation.cameras) > 1:
        raise InputError(
            f"{observation.name}: expected one high-speed camera where its focal length is to be measured (focal_prior > 0), "
            f"got {len(observation.cameras)}"
        )


def estimate_free_flight(seen: Seen, configuration: Configuration) -> Estimate:
    """The estimate from what was seen, as one free flight."""
    try:
        return _estimated(seen, configuration)
    except (NoMeasurement, RanAway) as failure:
        return empty_estimate(seen, configuration, failed(failure))


def _estimated(seen: Seen, configuration: Configuration) -> Estimate:
    observation, particle = seen.observation, seen.particle
    sightings = usable_sightings(observation, seen.tracks, configuration)
    pictures = pictures_of(observation, seen.tracks, sightings)
    views = views_like(particle, sightings.silhouettes, np.random.default_rng(configuration.seed), pictures)
    task = fit_task(observation, particle, sightings, views, configuration)
    searched = aligned(observation, task, particle, configuration)
    found, reference = first_pose(searched, particle, configuration)
    candidates = candidate_flights(observation, searched, particle, (found, reference), configuration)
    if misses(searched, candidates[0]):
        candidates = with_other_references(observation, searched, particle, (candidates, reference), configuration)
    if few_views(particle):
        candidates += from_another_side(observation, searched, particle, (candidates, reference), configuration)
    ranked = standing(searched, particle, [c.solution for c in candidates], ambiguity=configuration.ambiguity)
    flight = with_clocks(task, ranked.flights[0].state, unknown_clocks(observation))
    refined: Refined[Motion]
    joint, remark = None, ""
    known, said = configuration.focal_prior == 0.0, left_out(configuration)
    if said is None:
        refined = refined_flight(task, flight, configuration)
        joint, remark = on_all_samples(refined, task, particle, configuration)
    if joint is None:
        task = biased_task(observation, task, particle, flight, configuration, pictures=pictures)
        refined = refined_flight(task, flight, configuration)
    else:
        refined = with_joint(refined, joint)
    status, message = unless_left(judge(without_the_same(searched, ranked, refined, configuration), refined), particle, remark)
    tested = slow_misfit(joint) if joint is not None else misfit(refined) if known else None
    outcome = (status, message, tested)
    refined = widened(refined, tested)
    share = share_of(refined, joint, task, observation) if known else None
    told = converged_estimate(seen, found, refined, outcome, configuration=configuration, share=share)
    return with_surface(told, joint, remark, said=said)
