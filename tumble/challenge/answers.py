"""What the solver says of a campaign, as plain values: names, tests, steps, parameters, velocities, held-out errors."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.empirical_fit import fit_empirical
from estimator.diagnosis.explain import Explanation, Step
from estimator.diagnosis.score_tests import ScoreTest
from estimator.diagnosis.selection.names import JOINED, possible_names
from estimator.diagnosis.selection.testing import tests_beside
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance
from estimator.fitting.campaigns.considered import Considered, uncertain
from estimator.fitting.campaigns.held_out import HeldOut
from estimator.motion.flight import LAYOUT, Flight
from estimator.reports.campaign_reporting import owner_name
from estimator.reports.drop_reporting import flights_of, impacts_between
from tumble.challenge.information import all_information
from tumble.told_models import doubtful

Array = NDArray[np.float64]
UNKNOWN = "unknown"
"""What a name is called that no effect of the catalogue has, and its probability."""


def answer(explained: Explanation) -> dict[str, Any]:
    """The whole answer to one campaign."""
    best, begun = explained.path[-1], explained.begun
    campaign = best.campaign
    errors = {"base": explained.rungs[0].before, "final": explained.held_out} if explained.rungs else {}
    families = {t.effect.entry.key for t in explained.left.tests} if explained.left is not None else set()
    of = uncertain(campaign, best.fit, catalogue(campaign.cameras), possible_names(best, explained.groups), doubtful(explained))
    first = [t for t in tests_beside(begun.trial.evidence.of) if t.effect.entry.key not in families]
    return {
        "found": list(explained.found),
        "model": keys_told(explained),
        "probability": probabilities(explained),
        **unexplained(explained),
        "steps": [
            {
                "added": s.added,
                "group": _group(s),
                "names": [[UNKNOWN] if name.unknown else name.key.split(JOINED) for name in s.names],
                "odds": list(s.odds),
                "probability": s.probability,
                "sure": s.sure,
                "established": s.established,
                "p": s.p,
                "before_px": s.before.rms_px,
                "after_px": s.after.rms_px,
            }
            for s in explained.steps
        ],
        "tests": [_test(test) for test in first],
        "information": {key: matrix.tolist() for key, matrix in all_information(begun.campaign, begun.fit, first).items()},
        "parameters": [
            *(row for row in parameters(campaign, best.fit, of.of_values) if row["effect"] in explained.found),
            *(row for row in parameters(explained.campaign, explained.fit, explained.covariance) if row["effect"] in explained.in_place),
        ],
        "axes": {
            name: flight.body.R_particle_body.tolist() for name, flight in zip(campaign.recordings, best.fit.state.flights, strict=True)
        },
        "impacts": impacts(campaign, best.fit, of.at),
        "velocities": {
            "base": velocities(
                begun.campaign, begun.fit, uncertain(begun.campaign, begun.fit, catalogue(begun.campaign.cameras)).at.fitted
            ),
            "final": velocities(campaign, best.fit, of.at.fitted),
        },
        "held_out": {name: _held_out(value) for name, value in errors.items()},
    }


def keys_told(explained: Explanation) -> list[str]:
    """Keys of the model that velocities are of, without noise: what is unknown is in it, what is told in its place is not."""
    best = explained.path[-1]
    keys = best.trial.evidence.of.keys
    return [keys[e] for e in best.members if e not in best.trial.noise]


def _group(step: Step) -> list[str]:
    """The step's effect, then all effects of the catalogue that its other names have."""
    keys = [key for name in step.names if not name.unknown for key in name.key.split(JOINED)]
    return list(dict.fromkeys((step.added, *keys)))


def probabilities(explained: Explanation) -> dict[str, float]:
    """Of every effect of the catalogue, and of something unknown, to be in the model."""
    last = explained.path[-1]
    keys = last.trial.evidence.of.keys
    found = {keys[e]: last.posterior.probability(e) for e in range(len(keys)) if e not in last.trial.families}
    return {**found, UNKNOWN: float(sum(last.posterior.probability(e) for e in last.trial.families))}


def unexplained(explained: Explanation) -> dict[str, Any]:
    """Whether something is left that no effect of the catalogue explains, its stage, and what an empirical term and a law make of it."""
    left = explained.left
    if left is None or not left.present:
        return {"unknown": False, "stage": "", "p_left": 1.0 if left is None else left.p}
    found = fit_empirical(explained.campaign, explained.fit, left)
    law = found.law if found.described else None
    return {
        "unknown": True,
        "stage": str(left.stage),
        "p_left": left.p,
        "before_px": found.removed.before.rms_px,
        "empirical_px": found.removed.after.rms_px,
        "law": [term.key for term in law.terms] if law else [],
        "law_px": law.removed.after.rms_px if law else None,
    }


def _test(test: ScoreTest) -> dict[str, Any]:
    return {"effect": test.effect.entry.key, "statistic": test.statistic, "columns": len(test.columns), "p": test.p}


def _held_out(value: HeldOut) -> dict[str, Any]:
    return {"rms_px": value.rms_px, "per_sequence_px": value.per_sequence_px.tolist(), "errors": value.errors}


def parameters(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance) -> list[dict[str, Any]]:
    """Value and standard deviation of every parameter of every effect that was added; ``is_size``: not merely searched for."""
    rows = []
    for effect, part in zip(fit.model.effects, fit.model.slices, strict=True):
        if effect.instrument:
            continue
        groups = sorted(set(campaign.sharing(effect.entry.scope)))
        own = effect.entry.scope.own or len(groups) > 1
        for sequence in groups:
            columns = fit.model.layout.columns([effect.entry.key])
            variance = np.diag(covariance.of(sequence, columns))
            hollow = campaign.kind.hollow(campaign.sequences[sequence])
            value, sigma = effect.reported(fit.state.theta[sequence][part], variance, hollow)
            for i, name in enumerate(effect.entry.names):
                rows.append(
                    {
                        "effect": effect.entry.key,
                        "parameter": name,
                        "sequence": owner_name(campaign, effect.entry.scope, sequence) if own else None,
                        "value": float(value[i]),
                        "sigma": float(sigma[i]),
                        "sigma_of_noise": float(np.sqrt(max(variance[i], 0.0))),
                        "is_size": name in effect.entry.sizes,
                    }
                )
    return rows


def velocities(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance) -> list[dict[str, Any]]:
    """State at the reference time of every sequence: v (m/s), omega (rad/s), world frame, with the covariance (6, 6)."""
    columns = LAYOUT.columns(["v", "omega"])
    rows: list[dict[str, Any]] = []
    for number, (sequence, flight) in enumerate(_flights(campaign, fit)):
        state = {"v_world": flight.v.tolist(), "omega_world": flight.omega.tolist()}
        rows.append(
            {
                "sequence": sequence.name,
                "recording": campaign.recordings[number],
                "time_s": flight.time_s,
                **state,
                "covariance": covariance.of(number, columns).tolist(),
            }
        )
    return rows


def impacts(campaign: Campaign, fit: CampaignFit, wide: Considered) -> list[dict[str, Any]]:
    """What is measured of every impact between two flights of a recording: v and omega before and after it, with their covariance (12, 12).

    ``between_s``: the last time at which the flight before it was seen, and the first at which the one after it was.
    """
    rows = []
    for name, flights in flights_of(campaign, fit, wide).items():
        for each in impacts_between(flights):
            met, at = each.meeting, {"recording": name, "between_s": [each.before.ends_s[1], each.after.ends_s[0]]}
            values = {"before": met.before.tolist(), "after": met.after.tolist(), "covariance": met.covariance[6:, 6:].tolist()}
            rows.append({**at, "time_s": met.time_s, "spread_s": met.spread_s, **values})
    return rows


def _flights(campaign: Campaign, fit: CampaignFit) -> list[tuple[Any, Flight]]:
    return list(zip(campaign.sequences, fit.state.flights, strict=True))


def no_answer(reasons: Sequence[str]) -> dict[str, Any]:
    """The answer to a campaign of which nothing could be measured."""
    return {
        "found": [],
        "model": [],
        "unknown": False,
        "stage": "",
        "steps": [],
        "tests": [],
        "parameters": [],
        "left_out": [],
        "reasons": list(reasons),
    }
