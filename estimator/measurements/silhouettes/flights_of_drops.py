"""The free flights of a recording with impacts, each of which becomes a sequence of the campaign.

Impacts are found and fitted as for a single estimate (:mod:`estimator.impacts.chains`), under free flight; what else acts is the campaign's
question. A flight takes the frames between two impacts that are further from them than ``UNCLEAR_FRAMES`` and whose outline is whole, and
is left out where these are fewer than the configuration asks for. Of an impact within ``EDGE_FRAMES`` of an end of the recording the
frames beyond it are no flight.
"""

from dataclasses import dataclass, replace

import numpy as np

from datasets.estimate import Status
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask, restricted
from estimator.data.no_measurement import NoMeasurement
from estimator.data.views import Views
from estimator.fitting.tasks import fit_task
from estimator.impacts.chains import (
    EDGE_FRAMES,
    UNCLEAR_FRAMES,
    Seen,
    fitted_chains,
    frame_interval_s,
    frames_beside,
    impact_times,
    nominations,
    seen_frames,
    with_jumps_alone,
    with_missing_impacts,
)
from estimator.impacts.impact_judging import Chain
from estimator.impacts.impact_search import LEAST_RATIO, Kink
from estimator.impacts.piecewise_fit import PiecewiseRefined
from estimator.impacts.segments import segment_rows
from estimator.motion.flight import Flight
from estimator.motion.piecewise import PiecewiseFlight, piecewise_states, piecewise_velocities
from estimator.motion.rigid_body import RanAway
from estimator.outlines.result import FrameStatus, OutlineTrack, left_out
from estimator.outlines.sightings import usable_sightings


@dataclass(frozen=True)
class FreeFlight:
    """One flight of a recording: its ``number`` among all (from 1; 0 where it is the whole), its sightings, and where a fit starts."""

    number: int
    task: FitTask
    flight: Flight


def free_flights_of(
    seen: Seen, task: FitTask, views: Views, configuration: Configuration, *, least_ratio: float = LEAST_RATIO
) -> tuple[FreeFlight, ...]:
    """The flights before, between and after the impacts of a recording; none where it has no impact.

    ``task``: of the whole outlines. ``views``: with which the campaign compares outlines. ``least_ratio``: of kinks that nominate impacts,
    as in :func:`estimator.impacts.impact_search.find_kinks`.
    """
    nominated = nominations(seen, least_ratio=least_ratio)
    inner = [kink for kinks in nominated[:1] for kink in kinks]
    seen = replace(seen, tracks=_between_edges(seen.tracks, inner)) if inner else seen
    for kinks in nominated:
        refined = _with_impacts(seen, kinks, views, configuration)
        if refined is not None:
            return _cut(task, refined.flight, configuration, UNCLEAR_FRAMES * frame_interval_s(seen))
    return ()


def _with_impacts(seen: Seen, kinks: list[Kink], views: Views, configuration: Configuration) -> PiecewiseRefined | None:
    """The fit with impacts at kinks; ``None`` where nothing jumps there, or no flights lead through them."""
    kinks = [kink for kink in kinks if not _at_edge(seen.tracks, kink)]
    if not kinks:
        return None
    try:
        sightings = usable_sightings(seen.observation, seen.tracks, configuration, in_part=True)
        task = fit_task(seen.observation, seen.particle, sightings, views, configuration)
        return with_jumps_alone(seen, task, _chains(seen, task, kinks, configuration), configuration)[1]
    except (NoMeasurement, RanAway):
        return None


def _chains(seen: Seen, task: FitTask, kinks: list[Kink], configuration: Configuration) -> list[Chain]:
    """The fits with impacts; those at the kinks alone where one that seems to be missing lies at the edge of the recording."""
    try:
        return with_missing_impacts(seen, task, kinks, configuration)
    except NoMeasurement as failure:
        if failure.status is not Status.IMPACT_AT_EDGE:
            raise
        return fitted_chains(seen, task, impact_times(seen, kinks), configuration)


def _at_edge(tracks: tuple[OutlineTrack, ...], kink: Kink) -> bool:
    return min(frames_beside(seen_frames(tracks), kink)) <= EDGE_FRAMES


def _between_edges(tracks: tuple[OutlineTrack, ...], kinks: list[Kink]) -> tuple[OutlineTrack, ...]:
    """The tracks without the few frames beyond impacts at the edges of the recording."""
    edges = [kink.frame for kink in kinks if _at_edge(tracks, kink)]
    middle = float(np.median(seen_frames(tracks)))
    first = max((frame for frame in edges if frame < middle), default=-np.inf)
    last = min((frame for frame in edges if frame > middle), default=np.inf)
    return tuple(
        OutlineTrack(tuple(f if first < number < last else left_out(FrameStatus.ABSENT) for number, f in enumerate(track.frames)))
        for track in tracks
    )


def _cut(task: FitTask, flight: PiecewiseFlight, configuration: Configuration, clear_s: float) -> tuple[FreeFlight, ...]:
    """The flights with enough pictures."""
    found = []
    for number, rows in enumerate(segment_rows(task.sightings.times_s, flight.times_s, clear_s=clear_s)):
        if len(np.unique(task.sightings.frame[rows])) >= configuration.minimum_frames:
            own = restricted(task, rows)
            time_s = float(np.sort(own.sightings.times_s)[len(rows) // 2])
            found.append(FreeFlight(number + 1, own, _at(flight, time_s)))
    return tuple(found)


def _at(flight: PiecewiseFlight, time_s: float) -> Flight:
    """The flight of one segment, its state at a time within it."""
    still, times = np.zeros((1, flight.size)), np.array([time_s])
    reached, rates = piecewise_states(flight, still, times), piecewise_velocities(flight, still, times)[0, 0]
    return replace(flight.first, time_s=time_s, x=reached.x[0, 0], q=reached.q[0, 0], v=rates[:3], omega=rates[3:])
