"""From outlines with kinks in their path to an estimate with impacts: segments one by one, where they meet, then all jointly.

The longest segment is searched from nothing, as a free flight is. Each neighbour starts from the pose that it shares with it at the
impact, and is searched from nothing only where that leads nowhere. Competing minima of the longest segment are carried through all
segments: what a slow first flight leaves open, the tumbling after the impact usually decides. Where samples are asked for, they fit the
flight that tangents end with.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, Status
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask
from estimator.data.no_measurement import NoMeasurement
from estimator.fitting.adequacy import misfit, widened
from estimator.fitting.tasks import refinement_settings
from estimator.fitting.trajectory import cost as flight_cost
from estimator.impacts.breakage import worse_after
from estimator.impacts.chains import (
    Seen,
    edge_kink,
    frame_interval_s,
    prepared_task,
    refined_chain,
    task_of,
    with_jumps_alone,
    with_missing_impacts,
)
from estimator.impacts.impact_contacts import SeparatedContacts, contact_sentences, separated_contacts
from estimator.impacts.impact_judging import Chain, judge_chain, rivals_of
from estimator.impacts.impact_search import Kink
from estimator.impacts.loose_contact import with_lasting_contacts
from estimator.impacts.piecewise_fit import PiecewiseRefined, facts_of
from estimator.impacts.plate_contact import PlateTask
from estimator.impacts.plate_edge import edge_sentence
from estimator.impacts.plate_gap import plate_gaps
from estimator.impacts.plate_holding import plate_task
from estimator.measuring.by_samples import left_out_beside_contacts, on_all_samples, share_of, unless_left, with_joint, with_surface
from estimator.motion.piecewise import PiecewiseFlight, touch_and_sensitivity
from estimator.motion.rigid_body import RanAway
from estimator.reports.impact_reporting import impacts_estimate
from estimator.reports.misfit_words import adequacy_statistics, misfit_remark
from estimator.reports.reporting import empty_estimate
from estimator.reports.verdict import failed
from estimator.search.candidate_flights import same_flight
from estimator.surface.joint import JointFit, slow_misfit

Array = NDArray[np.float64]


def estimate_with_impacts(seen: Seen, kinks: list[Kink], configuration: Configuration) -> Estimate | None:
    """The estimate of a sequence with impacts near ``kinks``; ``None`` where the fit finds no jump of the velocities."""
    try:
        return _estimated(seen, kinks, configuration)
    except (NoMeasurement, RanAway) as failure:
        return empty_estimate(seen, configuration, failed(failure))


def _estimated(seen: Seen, kinks: list[Kink], configuration: Configuration) -> Estimate | None:
    edge = edge_kink(seen.tracks, kinks)
    if edge is not None:
        raise NoMeasurement(Status.IMPACT_AT_EDGE, edge)
    task = task_of(seen, configuration, in_part=True)
    chains = with_missing_impacts(seen, task, kinks, configuration)
    chains, refined = with_jumps_alone(seen, task, chains, configuration)
    if refined is None:
        return None
    chains = _without_the_same(seen, task, (chains, refined), configuration)
    chains, told = _with_contacts(seen, task, (chains, refined), configuration)
    plate = None if told.widened else _plate_of(seen, told.refined, configuration)
    said = left_out_beside_contacts(seen.particle, configuration)
    if plate is not None:
        told = replace(told, refined=refined_chain(seen, task, told.refined.flight, configuration, plate))
    joint, remark = None, ""
    if said is None and not told.widened:
        refined, joint, remark = _by_samples(seen, task, told.refined, configuration, plate)
        told = replace(told, refined=refined)
    status, message = unless_left(judge_chain(chains, told.refined, configuration), seen.particle, remark)
    if joint is not None:
        tested = slow_misfit(joint)
    else:
        tested = misfit(told.refined, facts_of(plate, task))
    missed = misfit_remark(tested) if tested is not None and status is not Status.NO_CONVERGENCE else ""
    outcome = (status, " ".join(filter(None, [message, *contact_sentences(told, frame_interval_s(seen)), missed])))
    refined = widened(told.refined, tested)
    share = share_of(refined, joint, task, seen.observation)
    estimate = impacts_estimate(seen, chains[0].found, refined, outcome, configuration=configuration, plate=plate, share=share)
    statistics = {**estimate.statistics, **adequacy_statistics(tested), "impacts": [dict(vars(s)) for s in told.spreads]}
    estimate = _unless_broken(replace(estimate, statistics=statistics), seen.observation.clock.times_s)
    return with_surface(estimate, joint, remark, said=said)


def _by_samples(
    seen: Seen, task: FitTask, refined: PiecewiseRefined, configuration: Configuration, plate: PlateTask | None
) -> tuple[PiecewiseRefined, JointFit[PiecewiseFlight] | None, str]:
    """The flight by all samples with impacts that last; as tangents have it where that comes to nothing, and what to remark."""
    try:
        led = refined_chain(seen, task, with_lasting_contacts(refined.flight), configuration, plate)
    except RanAway:
        return refined, None, ""
    joint, remark = on_all_samples(led, task, seen.particle, configuration, facts_of(plate, task))
    return refined if joint is None else with_joint(led, joint), joint, remark


def _unless_broken(estimate: Estimate, times_s: Array) -> Estimate:
    if estimate.status not in (Status.CONVERGED, Status.SECOND_CONTACT):
        return estimate
    worse = worse_after(estimate, times_s)
    return estimate if worse is None else replace(estimate, status=Status.BROKEN, message=f"{worse}. {estimate.message}")


def _with_contacts(
    seen: Seen, task: FitTask, known: tuple[list[Chain], PiecewiseRefined], configuration: Configuration
) -> tuple[list[Chain], SeparatedContacts]:
    """The chains with impacts that were several contacts told apart, in those too that had fitted nearly as well, and the best of them."""
    chains, refined = known
    told = _separated(seen, task, refined, configuration)
    if len(told.refined.flight.bounces) == len(refined.flight.bounces):
        return chains, told
    found = [(_told_chain(task, chains[0], told), told)]
    for rival in rivals_of(chains, configuration):
        try:
            other = _separated(seen, task, refined_chain(seen, task, rival.solution.state, configuration), configuration)
        except RanAway:
            continue
        found.append((_told_chain(task, rival, other), other))
    found.sort(key=lambda each: each[0].solution.equations.cost)
    return [chain for chain, _ in found], found[0][1]


def _told_chain(task: FitTask, chain: Chain, told: SeparatedContacts) -> Chain:
    cost = flight_cost(task, told.refined.flight)
    return Chain(chain.found, replace(chain.solution, state=told.refined.flight, equations=replace(chain.solution.equations, cost=cost)))


def _without_the_same(seen: Seen, task: FitTask, known: tuple[list[Chain], PiecewiseRefined], configuration: Configuration) -> list[Chain]:
    """The chains without rivals of the first that the last refinement brings to where it has brought the first: they were on the way."""
    chains, refined = known
    for rival in rivals_of(chains, configuration):
        try:
            other = refined_chain(seen, task, rival.solution.state, configuration)
        except RanAway:
            continue
        if same_flight(other.flight.first, refined.flight.first):
            chains = [chain for chain in chains if chain is not rival]
    return chains


def _separated(seen: Seen, task: FitTask, refined: PiecewiseRefined, configuration: Configuration) -> SeparatedContacts:
    def prepared(flight: PiecewiseFlight) -> FitTask:
        return prepared_task(seen, task, flight, configuration)

    return separated_contacts(task, refined, prepared, refinement_settings(configuration), frame_s=frame_interval_s(seen))


def _plate_of(seen: Seen, refined: PiecewiseRefined, configuration: Configuration) -> PlateTask | None:
    """The plate to hold the flight to: none where that is not asked for, nor where impacts or picture contradict the one that is stated."""
    place = touch_and_sensitivity(refined.flight, 0)[0].x[0]
    contradicted = any(gap is not None and not gap.agrees for gap in plate_gaps(refined, seen.observation, seen.particle))
    if contradicted or edge_sentence(seen.observation, place) is not None:
        return None
    return plate_task(seen.observation, seen.particle, refined, configuration)
