"""From a fitted campaign to what a user reads: an estimate per sequence under the model with its effects, and the effects' values."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import Estimate, Status, VelocityEstimate
from datasets.observation import Observation
from datasets.trajectory import Trajectory
from datasets.vocabulary.effects import Parameter, Scope
from estimator.data.configuration import Configuration
from estimator.data.versions import versions
from estimator.effects.empirical.families import EMPIRICAL
from estimator.effects.parameter_values import WithInterval
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, fit_campaign
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.campaigns.considered import Considered
from estimator.fitting.campaigns.forced_velocities import body_under, motion_under, velocities_under
from estimator.fitting.campaigns.measurement_kind import MeasurementKind
from estimator.fitting.campaigns.registered import Registered
from estimator.likelihood.time_shifts import jitter_test
from estimator.motion.flight import LAYOUT, Flight, fitted_body
from estimator.reports.clock_reporting import clock_sentences, clocks_of_campaign
from estimator.reports.drop_reporting import drop_estimate, flights_of
from estimator.reports.told_parameters import Told, told_parameters
from estimator.search.candidate_flights import MOST_MEAN_SQUARE

Array = NDArray[np.float64]
MOST_TO_GO = 0.3
"""Standard deviations that a fit's next step may have where it counts as converged."""
MORE_FITS = 3
"""Times that a fit goes on which ended before that: its own end asks how little the cost changes."""


@dataclass(frozen=True)
class EffectValue(WithInterval):
    """One parameter of a fitted effect.

    ``sequence``: the name of the sequence it belongs to, ``None`` where sequences share it; ``plausible``: whether its 95% interval
    reaches into the range that the catalogue expects.
    """

    effect: str
    parameter: Parameter
    sequence: str | None
    value: float
    sigma: float


def effect_values(registered: Registered, fit: CampaignFit, covariance: CampaignCovariance) -> tuple[EffectValue, ...]:
    """Values of every effect that is not held near zero, nor stands for something unknown, per group that shares them."""
    campaign = registered.campaign
    found = []
    for effect, part in zip(fit.model.effects, fit.model.slices, strict=True):
        if effect.instrument or effect.entry.key in EMPIRICAL:
            continue
        groups = sorted(set(campaign.sharing(effect.entry.scope)))
        for sequence in groups:
            alone = effect.entry.scope is Scope.CAMPAIGN or len(groups) == 1
            name = None if alone else owner_name(campaign, effect.entry.scope, sequence)
            variance = np.diag(covariance.of(sequence, fit.model.layout.columns([effect.entry.key])))
            if effect.random:
                variance = np.array([jitter_test(campaign.time_shifts(fit.equations)).sigma_error_s ** 2])
            hollow = campaign.kind.hollow(campaign.sequences[sequence])
            reported = effect.reported(fit.state.theta[sequence][part], variance, hollow)
            for parameter, value, sigma in zip(effect.entry.parameters, *reported, strict=True):
                if not value and not sigma and not effect.random and parameter.name not in effect.frozen:
                    continue  # nothing that was measured depends on it
                found.append(EffectValue(effect.entry.key, parameter, name, float(value), float(sigma)))
    return tuple(found)


def owner_name(campaign: Campaign, scope: Scope, sequence: int) -> str:
    """The name of what a value of a ``scope`` belongs to: the recording, or the first sequence that has the value."""
    return campaign.recordings[sequence] if scope is Scope.RECORDING else str(campaign.sequences[sequence].name)


def campaign_estimates(
    registered: Registered,
    observations: Mapping[str, Observation | Trajectory],
    fit: CampaignFit,
    at: Considered,
    configuration: Configuration,
) -> tuple[Estimate, ...]:
    """One estimate per recording that was measured, in the campaign's order; its uncertainty is widened by what is possible."""
    campaign = registered.campaign
    to_go, drops = left_to_go(registered, fit, at.plain), flights_of(registered.campaign, fit, at)
    told = told_parameters(campaign, fit, at.fitted)
    own: dict[str, list[Estimate]] = {}
    for number, (name, sequence) in enumerate(zip(campaign.recordings, campaign.sequences, strict=True)):
        what, state = (campaign.kind, sequence, observations[name]), (fit.state.flights[number], fit.state.theta[number])
        estimate = _with_parameters(_estimate(what, state, fit, (number, at, to_go), configuration), told, number)
        own.setdefault(name, []).append(without(estimate, campaign.kind.unmeasured(sequence)))
    return tuple(drop_estimate(name, drops[name], each, fit, told) if name in drops else each[0] for name, each in own.items())


def _estimate(
    what: tuple[MeasurementKind, Any, Observation | Trajectory],
    state: tuple[Flight, Array],
    fit: CampaignFit,
    at: tuple[int, Considered, float],
    configuration: Configuration,
) -> Estimate:
    (kind, sequence, observation), (flight, theta), (number, wide, to_go) = what, state, at
    setting = sequence.setting
    times = setting.times_s
    frames = fit.equations[number].frames
    status, message = _judged(fit, kind.misses(sequence, frames.mean_square), to_go)
    clocks = clocks_of_campaign(fit, number, wide.plain)
    told: dict[str, Any] = {
        "frames": kind.frame_reports(sequence, observation, fit.equations[number]),
        "statistics": {**kind.statistics(fit.equations[number]), **_of_fit(fit, number), **({"clocks": clocks} if clocks else {})},
        "configuration": dataclasses.asdict(configuration),
        "versions": versions(),
    }
    if status is not Status.CONVERGED:
        return Estimate(name=sequence.name, status=status, message=message, **told)
    middle = float(times[(len(times) - 1) // 2])
    return Estimate(
        name=sequence.name,
        status=status,
        message=" ".join([message, *clock_sentences(clocks)]),
        body=fitted_body(body_under(flight, fit.model, theta, setting)),
        motion=motion_under(flight, fit.model, theta, setting),
        start=_velocity(flight, (number, wide), float(times[0]), sequence),
        middle=_velocity(flight, (number, wide), middle, sequence),
        **told,
    )


def _with_parameters(estimate: Estimate, told: Told, number: int) -> Estimate:
    """The estimate of sequence ``number``, with its parameters where it was measured."""
    if estimate.status is not Status.CONVERGED:
        return estimate
    covariance = told.covariance.of(number, np.arange(len(told.names)))
    return replace(estimate, parameters=told.names, values=told.values(number), covariance=covariance)


def without(estimate: Estimate, columns: NDArray[np.int64]) -> Estimate:
    """The estimate with nothing said of the flight's parameters ``columns`` (c,) that were not measured: NaN."""
    if not len(columns) or estimate.status is not Status.CONVERGED:
        return estimate
    covariance, values = estimate.covariance.copy(), estimate.values.copy()
    covariance[columns], covariance[:, columns], values[columns] = np.nan, np.nan, np.nan
    estimate = replace(estimate, covariance=covariance, values=values)
    unknown = np.isin(LAYOUT.columns(["v", "omega"]), columns)
    if not unknown.any() or estimate.start is None or estimate.middle is None:
        return estimate
    said = [said for said, part in NOT_MEASURED if unknown[part].all()] or [NOT_ALL_MEASURED]
    start, middle = (_without_parts(each, unknown) for each in (estimate.start, estimate.middle))
    return replace(estimate, message=" ".join([estimate.message, *said]), motion=None, start=start, middle=middle)


NOT_MEASURED = (
    ("Orientation and spin were not measured.", slice(3, 6)),
    ("Positions were not measured; angular velocities are along the axes that the tracked frame has in the middle row.", slice(0, 3)),
)
NOT_ALL_MEASURED = "Not every coordinate was measured."


def _without_parts(velocity: VelocityEstimate, unknown: NDArray[np.bool_]) -> VelocityEstimate:
    """Velocities without the components ``unknown`` (6,) of v and omega."""
    covariance = velocity.covariance.copy()
    covariance[unknown], covariance[:, unknown] = np.nan, np.nan
    known = np.where(unknown, np.nan, np.concatenate([velocity.v_world, velocity.omega_world]))
    return replace(velocity, v_world=known[:3], omega_world=known[3:], covariance=covariance)


def left_to_go(registered: Registered, fit: CampaignFit, covariance: CampaignCovariance) -> float:
    """The largest step that the fit would take next, in standard deviations.

    Tangencies that change from vertex to vertex keep some fits going round at a tenth of one: their ``settled`` asks too much.
    """
    sigma = np.sqrt(np.maximum(np.diag(covariance.covariance), 1e-300))
    return float(np.max(np.abs(fit.system(registered.campaign).solved().step) / sigma))


def settled_fit(registered: Registered, fit: CampaignFit) -> CampaignFit:
    """A fit, gone on with as long as its next step is too large to count as converged."""
    for _ in range(MORE_FITS):
        if left_to_go(registered, fit, campaign_covariance(registered.campaign, fit)) < MOST_TO_GO:
            break
        fit = fit_campaign(registered.campaign, fit.state, fit.model)
    return fit


def _judged(fit: CampaignFit, misses: float, to_go: float) -> tuple[Status, str]:
    if not to_go < MOST_TO_GO:
        return Status.NO_CONVERGENCE, f"the campaign's fit did not settle: its next step would be {to_go:.1f} standard deviations."
    if misses**2 > MOST_MEAN_SQUARE:
        return Status.NO_CONVERGENCE, f"the fit misses what was measured by {misses:.1f} times its noise."
    effects = ", ".join(e.entry.title for e in fit.model.effects if not e.instrument)
    return Status.CONVERGED, f"converged, fitted jointly with its campaign; effects in the model: {effects or 'none'}."


def _velocity(flight: Flight, at: tuple[int, Considered], time_s: float, sequence: Any) -> VelocityEstimate:
    number, wide = at
    C = wide.covariance.of(number, np.arange(wide.model.layout.size))
    known = np.diag(C)[: LAYOUT.size] == 0.0
    value, J = velocities_under(flight, wide.model, wide.theta[number], sequence.setting, time_s, known=known)
    covariance = J @ C @ J.T
    return VelocityEstimate(time_s, value[:3], value[3:], 0.5 * (covariance + covariance.T), np.full((6, 6), np.nan))


def _of_fit(fit: CampaignFit, number: int) -> dict[str, Any]:
    return {
        "whitened_mean_square": fit.equations[number].frames.mean_square,
        "campaign_effects": [e.entry.key for e in fit.model.effects if not e.instrument],
    }
