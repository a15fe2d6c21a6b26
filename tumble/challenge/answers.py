"""What the solver says of a campaign, as plain values: names, tests, steps, parameters, velocities, held-out errors."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.diagnosis.empirical_fit import fit_empirical
from estimator.diagnosis.explain import Explanation
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.curvature_bias import CurvatureBias
from estimator.fitting.campaign import Campaign, CampaignFit
from estimator.fitting.campaign_covariance import CampaignCovariance, campaign_covariance
from estimator.fitting.held_out import HeldOut
from estimator.motion.flight import N_PARAMETERS, OMEGA, Flight, V
from tumble.challenge.information import all_information

Array = NDArray[np.float64]


def answer(explained: Explanation) -> dict[str, Any]:
    """The whole answer to one campaign."""
    campaign = explained.campaign
    errors = {"base": explained.steps[0].before, "final": explained.held_out} if explained.steps else {}
    first = explained.steps[0].tests if explained.steps else explained.tests
    return {
        "found": list(explained.found),
        "dropped": list(explained.dropped),
        **unexplained(campaign, explained),
        "steps": [
            {
                "added": s.added,
                "group": list(s.group),
                "p": s.p,
                "before_px": s.before.rms_px,
                "after_px": s.after.rms_px,
                "accepted": s.accepted,
            }
            for s in explained.steps
        ],
        "tests": [_test(test) for test in first],
        "information": {key: matrix.tolist() for key, matrix in all_information(explained.begun, explained.base, first).items()},
        "parameters": _with_random(parameters(campaign, explained.fit, explained.covariance), explained),
        "axes": {sequence.name: flight.body.R_particle_body.tolist() for sequence, flight in _flights(campaign, explained.fit)},
        "velocities": {
            "base": velocities(explained.begun, explained.base, campaign_covariance(explained.begun, explained.base)),
            "final": velocities(campaign, explained.fit, explained.covariance),
        },
        "held_out": {name: _held_out(value) for name, value in errors.items()},
    }


def unexplained(campaign: Campaign, explained: Explanation) -> dict[str, Any]:
    """Whether something is left that no effect of the catalogue explains, its stage, and what an empirical term and a law make of it."""
    left = explained.left
    if not left.present:
        return {"unknown": False, "stage": "", "p_left": left.p}
    found = fit_empirical(campaign, explained.fit, left)
    law = found.law
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
        if effect.entry.key == CurvatureBias.entry.key:
            continue
        groups = sorted(set(campaign.sharing(effect.entry.scope)))
        own = effect.entry.scope is Scope.SEQUENCE or len(groups) > 1
        for sequence in groups:
            columns = N_PARAMETERS + np.arange(part.start, part.stop)
            variance = np.diag(covariance.of(sequence, columns))
            hollow = campaign.kind.hollow(campaign.sequences[sequence])
            value, sigma = effect.reported(fit.state.theta[sequence][part], variance, hollow)
            for i, name in enumerate(effect.entry.names):
                rows.append(
                    {
                        "effect": effect.entry.key,
                        "parameter": name,
                        "sequence": campaign.sequences[sequence].name if own else None,
                        "value": float(value[i]),
                        "sigma": float(sigma[i]),
                        "sigma_of_noise": float(np.sqrt(max(variance[i], 0.0))),
                        "is_size": name in effect.entry.sizes,
                    }
                )
    return rows


def _with_random(rows: list[dict[str, Any]], explained: Explanation) -> list[dict[str, Any]]:
    """Rows in which effects that are drawn anew in every frame have the standard deviation of the test that found them."""
    sigmas = {
        step.added: float(np.sqrt(test.covariance[0, 0]))
        for step in explained.steps
        for test in step.tests
        if test.effect.random and test.effect.entry.key == step.added
    }
    both = {key: dict.fromkeys(("sigma", "sigma_of_noise"), sigma) for key, sigma in sigmas.items()}
    return [{**row, **both.get(row["effect"], {})} for row in rows]


def velocities(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance) -> list[dict[str, Any]]:
    """State at the reference time of every sequence: v (m/s), omega (rad/s), world frame, with the covariance (6, 6)."""
    columns = np.r_[np.arange(N_PARAMETERS)[V], np.arange(N_PARAMETERS)[OMEGA]]
    rows: list[dict[str, Any]] = []
    for number, (sequence, flight) in enumerate(_flights(campaign, fit)):
        state = {"v_world": flight.v.tolist(), "omega_world": flight.omega.tolist()}
        rows.append({"sequence": sequence.name, "time_s": flight.time_s, **state, "covariance": covariance.of(number, columns).tolist()})
    return rows


def _flights(campaign: Campaign, fit: CampaignFit) -> list[tuple[Any, Flight]]:
    return list(zip(campaign.sequences, fit.state.flights, strict=True))


def no_answer(reasons: Sequence[str]) -> dict[str, Any]:
    """The answer to a campaign of which nothing could be measured."""
    return {
        "found": [],
        "dropped": [],
        "unknown": False,
        "stage": "",
        "steps": [],
        "tests": [],
        "parameters": [],
        "left_out": [],
        "reasons": list(reasons),
    }
