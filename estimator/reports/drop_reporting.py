"""From the fitted flights of one recording with impacts to its estimate: segments, and the impacts at which flights meet.

The flights are fitted with their campaign, each with a state of its own. Two that follow one another share one pose at the time of impact
(:mod:`estimator.measurements.trajectories.meeting_flights`), under the campaign's joint covariance: what both have in common, the body,
the camera and the effects, is off by the same in both. What an impact says is corrected by that meeting; segments are as they were fitted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, FrameReport, ImpactEstimate, SegmentEstimate, Status, VelocityEstimate
from datasets.vocabulary.state import Motion
from estimator.appearance.model_errors import SequenceTask
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.considered import Considered
from estimator.fitting.campaigns.forced_velocities import body_under, motion_under, reached_under
from estimator.impacts.chains import LEAST_JUMP
from estimator.measurements.trajectories.impacts import CLEAR_SPREAD, impact_record
from estimator.measurements.trajectories.meeting_flights import Meeting, meeting
from estimator.motion.flight import N_PARAMETERS, Flight, fitted_body
from estimator.motion.reached import Reached
from estimator.motion.rotation import quaternion

Array = NDArray[np.float64]
TIME_STEP_S = 1e-4
STATE = 12


@dataclass(frozen=True)
class FittedFlight:
    """Sequence ``number`` of a fitted campaign, a flight of a recording, with its own ``estimate``; ``wide``: the uncertainty of all."""

    number: int
    sequence: SequenceTask
    flight: Flight
    wide: Considered
    estimate: Estimate

    @property
    def ends_s(self) -> tuple[float, float]:
        """Times of its first and its last sighting."""
        times = self.sequence.task.sightings.times_s
        return float(times.min()), float(times.max())

    @property
    def rows(self) -> NDArray[np.int64]:
        """Where its parameters lie among those of the campaign."""
        return self.wide.covariance.place[self.number][: N_PARAMETERS + self.wide.model.size]

    def at(self, time_s: float) -> Reached:
        """The motion at a time, also beyond its sightings."""
        known = np.diag(self.wide.covariance.covariance)[self.rows][:N_PARAMETERS] == 0.0
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


def drop_estimate(recording: str, flights: Sequence[FittedFlight], fit: CampaignFit, interval_s: float) -> Estimate:
    """The estimate of a recording from its ``flights`` in order of time; ``interval_s`` from one frame to the next."""
    first = flights[0].estimate
    told: dict[str, Any] = {
        "name": recording,
        "frames": _frames([each.estimate for each in flights]),
        "configuration": first.configuration,
        "versions": first.versions,
    }
    failed = [each for each in flights if each.estimate.status is not Status.CONVERGED]
    if failed:
        message = f"{failed[0].sequence.name}: {failed[0].estimate.message}"
        return Estimate(status=failed[0].estimate.status, message=message, statistics=_statistics(flights, (), interval_s), **told)
    met = [(k, _met(a, b)) for k, (a, b) in enumerate(pairwise(flights)) if b.sequence.number == a.sequence.number + 1]
    struck = [(k, each) for k, each in met if each.jump >= LEAST_JUMP]
    times = flights[0].sequence.setting.times_s
    return Estimate(
        status=Status.CONVERGED,
        message=_message(flights, len(struck), fit),
        body=first.body,
        motion=_motion(flights, fit, dict(struck)),
        start=flights[0].velocity(float(times[0]) if flights[0].sequence.number == 1 else flights[0].ends_s[0]),
        middle=_nearest(flights, float(times[(len(times) - 1) // 2])),
        segments=_segments(flights, dict(struck)),
        impacts=tuple(_impact(flights[k], each, fit) for k, each in struck),
        statistics=_statistics(flights, struck, interval_s),
        **told,
        **_parameters(flights),
    )


def _met(a: FittedFlight, b: FittedFlight) -> Meeting:
    rows = np.concatenate([a.rows, b.rows])
    return meeting(a, b, a.wide.covariance.covariance[np.ix_(rows, rows)])


def _impact(before: FittedFlight, met: Meeting, fit: CampaignFit) -> ImpactEstimate:
    return replace(impact_record(met), q_world_body=quaternion(met.R @ _fitted_axes(before, fit)))


def _fitted_axes(each: FittedFlight, fit: CampaignFit) -> Array:
    """Nominal body axes from those of the fitted body."""
    own = body_under(each.flight, fit.model, fit.state.theta[each.number], each.sequence.setting)
    return np.asarray(own.body.R_particle_body.T @ fitted_body(own).R_particle_body)


def _message(flights: Sequence[FittedFlight], impacts: int, fit: CampaignFit) -> str:
    effects = ", ".join(e.entry.title for e in fit.model.effects if not e.instrument)
    parts = f"{len(flights)} flight{'s' if len(flights) != 1 else ''} and {impacts} impact{'s' if impacts != 1 else ''}"
    return f"converged, {parts}, fitted jointly with its campaign; effects in the model: {effects or 'none'}."


def _spans(flights: Sequence[FittedFlight], met: dict[int, Meeting]) -> list[tuple[float, float]]:
    """From when to when each flight lasts: up to its impacts, or to its sightings where none is measured."""
    times = flights[0].sequence.setting.times_s
    spans = []
    for k, each in enumerate(flights):
        first, last = each.ends_s
        start = float(times[0]) if each.sequence.number == 1 else first
        end = float(times[-1]) if k == len(flights) - 1 else last
        spans.append((met[k - 1].time_s if k - 1 in met else start, met[k].time_s if k in met else end))
    return spans


def _segments(flights: Sequence[FittedFlight], met: dict[int, Meeting]) -> tuple[SegmentEstimate, ...]:
    spans = zip(flights, _spans(flights, met), strict=True)
    return tuple(SegmentEstimate(start, end, each.velocity(0.5 * (start + end))) for each, (start, end) in spans)


def _nearest(flights: Sequence[FittedFlight], time_s: float) -> VelocityEstimate:
    """V and omega at a time, or where a flight comes nearest to it."""
    near = [float(np.clip(time_s, *each.ends_s)) for each in flights]
    k = int(np.argmin(np.abs(np.array(near) - time_s)))
    return flights[k].velocity(near[k])


def _motion(flights: Sequence[FittedFlight], fit: CampaignFit, met: dict[int, Meeting]) -> Motion:
    """Poses and velocities at the frames within a flight."""
    parts = []
    for each, (start, end) in zip(flights, _spans(flights, met), strict=True):
        setting = each.sequence.setting
        whole = motion_under(each.flight, fit.model, fit.state.theta[each.number], setting)
        rows = (setting.times_s >= start) & (setting.times_s <= end)
        parts.append({name: getattr(whole, name)[rows] for name in Motion.__dataclass_fields__})
    return Motion(**{name: np.concatenate([part[name] for part in parts]) for name in Motion.__dataclass_fields__})


def _parameters(flights: Sequence[FittedFlight]) -> dict[str, Any]:
    """Names, values and joint covariance: those of the first flight with all that is shared, then the states of the others."""
    own = flights[0].wide.own
    names, values, rows = list(flights[0].estimate.parameters), [flights[0].estimate.values], [flights[0].rows[:own]]
    for each in flights[1:]:
        names += [f"flight_{each.sequence.number}_{name}" for name in each.estimate.parameters[:STATE]]
        values.append(each.estimate.values[:STATE])
        rows.append(each.rows[:STATE])
    at = np.concatenate(rows)
    covariance = flights[0].wide.covariance.covariance[np.ix_(at, at)]
    return {"parameters": tuple(names), "values": np.concatenate(values), "covariance": covariance}


def _frames(estimates: Sequence[Estimate]) -> tuple[FrameReport, ...]:
    """Every picture, as the flight that uses it reports it."""
    return tuple(max(same, key=lambda report: report.used) for same in zip(*(each.frames for each in estimates), strict=True))


def _statistics(flights: Sequence[FittedFlight], struck: Sequence[tuple[int, Meeting]], interval_s: float) -> dict[str, Any]:
    own = [each.estimate.statistics for each in flights]
    pairs = np.array([each["n_pairs"] for each in own])
    square = sum(n * each["rms_ete_px"] ** 2 for n, each in zip(pairs, own, strict=True)) / max(int(pairs.sum()), 1)
    return {
        **own[0],
        "n_pairs": int(pairs.sum()),
        "pairs_without_tangents": sum(each["pairs_without_tangents"] for each in own),
        "rms_ete_px": float(np.sqrt(square)),
        "flights": [
            {"number": each.sequence.number, "sightings": len(each.sequence.task.sightings), "mean_square": s["whitened_mean_square"]}
            for each, s in zip(flights, own, strict=True)
        ],
        "impacts": [
            {
                "between_flights": [flights[k].sequence.number, flights[k + 1].sequence.number],
                "spread_s": met.spread_s,
                "clear": met.spread_s <= CLEAR_SPREAD * interval_s,
                "gap_m": float(np.linalg.norm(met.gap[:3])),
                "gap_rad": float(np.linalg.norm(met.gap[3:])),
                "jump": met.jump,
            }
            for k, met in struck
        ],
    }
