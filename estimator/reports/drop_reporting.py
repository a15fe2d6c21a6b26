"""From the fitted flights of one recording with impacts to its estimate: segments, and the impacts at which flights meet.

The flights are fitted with their campaign, each with a state of its own. Two that follow one another share one pose at the time of impact
(:mod:`estimator.measurements.trajectories.meeting_flights`), under the campaign's joint covariance: what both have in common, the body,
the camera and the effects, is off by the same in both. What an impact says is corrected by that meeting; segments are as they were fitted.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, FrameReport, ImpactEstimate, SegmentEstimate, Status, VelocityEstimate
from datasets.vocabulary.effects import Scope
from datasets.vocabulary.state import Motion
from estimator.appearance.model_errors import SequenceTask
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.considered import Considered
from estimator.fitting.campaigns.forced_velocities import body_under, motion_under, reached_under
from estimator.impacts.chains import LEAST_JUMP
from estimator.measurements.trajectories.impacts import impact_record
from estimator.measurements.trajectories.meeting_flights import Meeting, meeting
from estimator.motion.flight import LAYOUT, Flight
from estimator.motion.reached import Reached
from estimator.motion.rotation import quaternion
from estimator.reports.reporting import fitted_axes
from estimator.reports.told_parameters import Told

Array = NDArray[np.float64]
TIME_STEP_S = 1e-4
"""Step of central differences of a velocity by time: a flight turns by a hundredth of a radian in it."""
COUNTED = ("n_pairs", "pairs_without_tangents", "sectors")
"""Statistics of flights that add up, whatever the kind of their residuals is."""
POOLED = {"rms_ete_px": "n_pairs", "rms_px": "sectors", "noise_px": "sectors"}
"""Root mean squares among them, and over how many each is."""


@dataclass(frozen=True)
class FittedFlight:
    """Sequence ``number`` of a fitted campaign, a flight of a recording; ``wide``: the uncertainty of all."""

    number: int
    sequence: SequenceTask
    flight: Flight
    wide: Considered

    @property
    def ends_s(self) -> tuple[float, float]:
        """Times of its first and its last sighting."""
        times = self.sequence.task.sightings.times_s
        return float(times.min()), float(times.max())

    @property
    def rows(self) -> NDArray[np.int64]:
        """Where its parameters lie among those of the campaign."""
        return self.wide.covariance.place[self.number][: self.wide.model.layout.size]

    def at(self, time_s: float) -> Reached:
        """The motion at a time, also beyond its sightings."""
        known = np.diag(self.wide.covariance.covariance)[self.rows][: LAYOUT.size] == 0.0
        model, theta = self.wide.model, self.wide.theta[self.number]
        return reached_under(self.flight, model, theta, self.sequence.setting, time_s, known=known)

    def change_at(self, time_s: float) -> Array:
        """Rate (6,) of v and omega at a time."""
        later, sooner = (self.at(time_s + h).velocity for h in (TIME_STEP_S, -TIME_STEP_S))
        return np.asarray((later - sooner) / (2.0 * TIME_STEP_S))

    def velocity(self, time_s: float) -> VelocityEstimate:
        """V and omega at a time, as fitted."""
        there, C = self.at(time_s), self.wide.covariance.covariance[np.ix_(self.rows, self.rows)]
        covariance = there.velocity_J @ C @ there.velocity_J.T
        return VelocityEstimate(time_s, there.velocity[:3], there.velocity[3:], 0.5 * (covariance + covariance.T), np.full((6, 6), np.nan))


@dataclass(frozen=True)
class Struck:
    """An impact between two flights that follow one another."""

    before: FittedFlight
    after: FittedFlight
    meeting: Meeting


def flights_of(campaign: Campaign, fit: CampaignFit, wide: Considered) -> dict[str, tuple[FittedFlight, ...]]:
    """The flights of every recording that has impacts, in order of time."""
    found: dict[str, tuple[FittedFlight, ...]] = {}
    for number, (name, sequence) in enumerate(zip(campaign.recording, campaign.sequences, strict=False)):
        if sequence.number:
            found[name] = (*found.get(name, ()), FittedFlight(number, sequence, fit.state.flights[number], wide))
    return found


def impacts_between(flights: Sequence[FittedFlight]) -> tuple[Struck, ...]:
    """The impacts at which flights meet and velocities jump; none between flights of which one that lay between them is missing."""
    pairs = [(a, b) for a, b in pairwise(flights) if b.sequence.number == a.sequence.number + 1]
    met = (Struck(a, b, _met(a, b)) for a, b in pairs)
    return tuple(each for each in met if each.meeting.jump >= LEAST_JUMP)


def drop_estimate(recording: str, flights: Sequence[FittedFlight], own: Sequence[Estimate], fit: CampaignFit, parameters: Told) -> Estimate:
    """The estimate of a recording from its ``flights`` in order of time and the estimate of each; ``parameters`` of all sequences."""
    told: dict[str, Any] = {
        "name": recording,
        "frames": _frames(own),
        "configuration": own[0].configuration,
        "versions": own[0].versions,
    }
    failed = [(f, each) for f, each in zip(flights, own, strict=True) if each.status is not Status.CONVERGED]
    if failed:
        (flight, why), *_ = failed
        message = f"{flight.sequence.name}: {why.message}"
        return Estimate(status=why.status, message=message, statistics=_statistics(flights, own, ()), **told)
    struck = impacts_between(flights)
    times, spans = flights[0].sequence.setting.times_s, _spans(flights, struck)
    return Estimate(
        status=Status.CONVERGED,
        message=_message(flights, len(struck), fit),
        body=own[0].body,
        motion=_motion(flights, spans, fit),
        start=flights[0].velocity(spans[0][0]),
        middle=_nearest(flights, float(times[(len(times) - 1) // 2])),
        segments=tuple(SegmentEstimate(*span, f.velocity(0.5 * sum(span))) for f, span in zip(flights, spans, strict=True)),
        impacts=tuple(_impact(each, fit) for each in struck),
        statistics=_statistics(flights, own, struck),
        **told,
        **_parameters(flights, own, parameters),
    )


def _met(a: FittedFlight, b: FittedFlight) -> Meeting:
    rows = np.concatenate([a.rows, b.rows])
    return meeting(a, b, a.wide.covariance.covariance[np.ix_(rows, rows)])


def _impact(struck: Struck, fit: CampaignFit) -> ImpactEstimate:
    met, each = struck.meeting, struck.before
    own = body_under(each.flight, fit.model, fit.state.theta[each.number], each.sequence.setting)
    return replace(impact_record(met), q_world_body=quaternion(met.R @ fitted_axes(own)))


def _message(flights: Sequence[FittedFlight], impacts: int, fit: CampaignFit) -> str:
    effects = ", ".join(e.entry.title for e in fit.model.effects if not e.instrument)
    parts = f"{len(flights)} flight{'s' if len(flights) != 1 else ''} and {impacts} impact{'s' if impacts != 1 else ''}"
    return f"converged, {parts}, fitted jointly with its campaign; effects in the model: {effects or 'none'}."


def _spans(flights: Sequence[FittedFlight], struck: Sequence[Struck]) -> list[tuple[float, float]]:
    """From when to when each flight lasts: up to its impacts, or to its sightings where none is measured; outermost ones to the ends."""
    times = flights[0].sequence.setting.times_s
    begin = {each.after.number: each.meeting.time_s for each in struck}
    end = {each.before.number: each.meeting.time_s for each in struck}
    if flights[0].sequence.number == 1:
        begin[flights[0].number] = float(times[0])
    return [(begin.get(each.number, each.ends_s[0]), end.get(each.number, each.ends_s[1])) for each in flights]


def _nearest(flights: Sequence[FittedFlight], time_s: float) -> VelocityEstimate:
    """V and omega at a time, or where a flight comes nearest to it."""
    near = [float(np.clip(time_s, *each.ends_s)) for each in flights]
    k = int(np.argmin(np.abs(np.array(near) - time_s)))
    return flights[k].velocity(near[k])


def _motion(flights: Sequence[FittedFlight], spans: Sequence[tuple[float, float]], fit: CampaignFit) -> Motion:
    """Poses and velocities at the frames within a flight."""
    parts = []
    for each, (start, end) in zip(flights, spans, strict=True):
        setting = each.sequence.setting
        whole = motion_under(each.flight, fit.model, fit.state.theta[each.number], setting)
        rows = (setting.times_s >= start) & (setting.times_s <= end)
        parts.append({name: getattr(whole, name)[rows] for name in Motion.__dataclass_fields__})
    return Motion(**{name: np.concatenate([part[name] for part in parts]) for name in Motion.__dataclass_fields__})


def _parameters(flights: Sequence[FittedFlight], own: Sequence[Estimate], told: Told) -> dict[str, Any]:
    """Names, values and joint covariance: those of the first flight with all that is shared, then the states of the others."""
    place, state = told.covariance.place, LAYOUT.of(Scope.SEQUENCE)
    names, values, rows = list(own[0].parameters), [own[0].values], [place[flights[0].number]]
    for each, estimate in zip(flights[1:], own[1:], strict=True):
        names += [f"flight_{each.sequence.number}_{name}" for name in np.array(estimate.parameters)[state]]
        values.append(estimate.values[state])
        rows.append(place[each.number][state])
    at = np.concatenate(rows)
    return {"parameters": tuple(names), "values": np.concatenate(values), "covariance": told.covariance.covariance[np.ix_(at, at)]}


def _frames(estimates: Sequence[Estimate]) -> tuple[FrameReport, ...]:
    """Every picture, as the flight that uses it reports it."""
    return tuple(max(same, key=lambda report: report.used) for same in zip(*(each.frames for each in estimates), strict=True))


def _statistics(flights: Sequence[FittedFlight], estimates: Sequence[Estimate], struck: Sequence[Struck]) -> dict[str, Any]:
    own = [each.statistics for each in estimates]
    return {
        **own[0],
        **{name: sum(each[name] for each in own) for name in COUNTED if name in own[0]},
        **{name: _pooled(own, name, by) for name, by in POOLED.items() if name in own[0]},
        "flights": [
            {"number": each.sequence.number, "sightings": len(each.sequence.task.sightings), "mean_square": s["whitened_mean_square"]}
            for each, s in zip(flights, own, strict=True)
        ],
        "impacts": [_impact_statistics(each) for each in struck],
    }


def _pooled(own: Sequence[Mapping[str, Any]], name: str, by: str) -> float:
    """Root mean square of all flights together, of each of which there are so many."""
    square = sum(each[by] * each[name] ** 2 for each in own) / max(sum(each[by] for each in own), 1)
    return float(np.sqrt(square))


def _impact_statistics(struck: Struck) -> dict[str, Any]:
    met = struck.meeting
    return {
        "between_flights": [struck.before.sequence.number, struck.after.sequence.number],
        "spread_s": met.spread_s,
        "chi_square": met.chi_square,
        "gap_m": float(np.linalg.norm(met.gap[:3])),
        "gap_rad": float(np.linalg.norm(met.gap[3:])),
        "jump": met.jump,
    }
