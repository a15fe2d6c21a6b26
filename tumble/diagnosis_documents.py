"""Diagnoses and fitted campaigns as documents (``diagnosis.json``, ``campaign.json``); the reports are made from these alone."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from estimator.diagnosis.adding import Rung
from estimator.diagnosis.diagnose import Diagnosis, Finding, tested_values
from estimator.diagnosis.explain import Explanation, Step
from estimator.diagnosis.noise_floor import NoiseFloor
from estimator.diagnosis.residual_maps import ResidualMap
from estimator.diagnosis.score_tests import ScoreTest
from estimator.diagnosis.separation import Expected, Separation
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance
from estimator.fitting.campaigns.held_out import HeldOut
from estimator.reports.campaign_reporting import EffectValue
from estimator.reports.told_parameters import told_parameters
from tumble.reports.map_words import sentence_of, title_of
from tumble.reports.noise_floor_words import floor_sentence
from tumble.reports.separation_words import separation_sentence
from tumble.reports.verdict import Verdict

Entry = dict[str, Any]


def keys_of(fit: CampaignFit) -> list[str]:
    """The effects of a fit, what stands for something unknown among them, without what belongs to the instrument."""
    return [e.entry.key for e in fit.model.effects if not e.instrument]


def rms_px(fit: CampaignFit) -> float:
    """RMS of the errors of all sequences: px, or the noise of each sequence."""
    return _rms([each.errors for each in fit.equations])


def _rms_in(campaign: Campaign, fit: CampaignFit) -> float:
    """The same of a fit in a campaign whose noise and surfaces may be those of another."""
    each = zip(fit.state.flights, fit.state.theta, strict=True)
    return _rms([campaign.kind.residuals(campaign, i, flight, fit.model, theta) for i, (flight, theta) in enumerate(each)])


def _rms(errors: Sequence[Any]) -> float:
    count = sum(int(each.seen.sum()) for each in errors)
    return float(np.sqrt(sum(float(np.sum(each.e**2)) for each in errors) / max(count, 1)))


def value_entries(values: Sequence[EffectValue]) -> list[Entry]:
    """Fitted values."""
    return [
        {
            "effect": v.effect,
            "parameter": v.parameter.name,
            "unit": v.parameter.unit,
            "sequence": v.sequence,
            "value": v.value,
            "sigma": v.sigma,
            "interval": list(v.interval),
            "plausible": v.plausible,
        }
        for v in values
    ]


def drop_entries(campaign: Campaign) -> list[Entry]:
    """Of every recording with impacts, the numbers of its flights (from 1) that are in the campaign."""
    flights: dict[str, list[int]] = {}
    for name, sequence in zip(campaign.recording, campaign.sequences, strict=False):
        if sequence.number:
            flights.setdefault(name, []).append(sequence.number)
    return [{"recording": name, "flights": numbers} for name, numbers in flights.items()]


def diagnosis_entry(diagnosis: Diagnosis, names: Sequence[str], apart: Sequence[Separation] = ()) -> Entry:
    """All candidates and how much there is to explain; ``names`` of the sequences, ``apart`` what would separate the group."""
    return {
        "p": diagnosis.p,
        "chi_square": diagnosis.chi_square,
        "degrees_of_freedom": diagnosis.degrees,
        "p_all_together": diagnosis.p_all_together,
        "probability": diagnosis.probability,
        "missing": list(diagnosis.missing),
        "group": list(diagnosis.group),
        "separations": [_separation(each) for each in apart],
        "candidates": [_finding(each, names) for each in diagnosis.findings],
    }


def _separation(separation: Separation) -> Entry:
    """A pair of effects and what would tell it apart."""
    return {
        "pair": list(separation.pair),
        "margin": separation.margin,
        "now": _expected(separation.now),
        "prospects": [
            {"key": p.key, "words": p.words, "drops": p.drops, "frames": p.frames, **_expected(p.expected)} for p in separation.prospects
        ],
        "sentence": separation_sentence(separation),
    }


def _expected(expected: Expected) -> Entry:
    return {"difference": expected.difference, "probability": expected.probability, "separates": expected.separates}


def _finding(finding: Finding, names: Sequence[str]) -> Entry:
    entry = finding.test.effect.entry
    return {
        "effect": entry.key,
        "stage": entry.stage.value,
        "meaning": entry.meaning,
        "share": finding.share,
        "p": finding.p,
        "p_alone": finding.test.p,
        "statistic": finding.test.statistic,
        "log_odds": finding.log_odds,
        "probability": finding.probability,
        "values": _tested_values(finding.test, names),
        "searched": _searched(finding.test, names),
    }


def _tested_values(test: ScoreTest, names: Sequence[str]) -> list[Entry]:
    return [
        {
            "parameter": value.parameter.name,
            "unit": value.parameter.unit,
            "sequence": None if value.sequence is None else names[value.sequence],
            "value": value.value,
            "sigma": value.sigma,
            "interval": list(value.interval),
            "plausible": value.plausible,
            "seen_from": value.seen_from,
        }
        for value in tested_values(test)
    ]


def _searched(test: ScoreTest, names: Sequence[str]) -> list[Entry]:
    """Where the best start of a searched parameter lies."""
    parameters = test.effect.entry.parameters
    return [
        {
            "parameter": p.name,
            "unit": p.unit,
            "sequence": None if sequence is None else names[sequence],
            "value": float(start[i]),
        }
        for sequence, start in test.starts.items()
        for i, p in enumerate(parameters)
        if p.name not in test.effect.entry.sizes
    ]


def map_entry(found: ResidualMap) -> Entry:
    """One map of residuals."""
    return {
        "name": found.axis.name,
        "title": title_of(found),
        "unit": found.axis.unit,
        "kind": found.kind,
        "centre": found.centre,
        "second": found.second,
        "residual_unit": found.unit,
        "mean_px": found.mean_px,
        "sigma_px": found.sigma_px,
        "count": found.count,
        "statistic": found.statistic,
        "p": found.p,
        "significant": found.significant,
        "sentence": sentence_of(found),
    }


def noise_floor_entry(floor: NoiseFloor, campaign: Campaign, at: tuple[float, float]) -> Entry:
    """The noise floor; ``at``: p-value of the tests of all effects and the one below which something is missing."""
    return {
        "rms_px": floor.rms_px,
        "repeated_px": floor.repeated_px,
        "neighbours_px": floor.neighbours_px,
        "floor_px": floor.floor_px,
        "excess_px": floor.excess_px,
        "reduced_chi_square": floor.reduced,
        "interval": list(floor.interval),
        "allowed": floor.allowed,
        "per_sequence": dict(zip((s.name for s in campaign.sequences), floor.per_sequence.tolist(), strict=True)),
        "lags": floor.lags,
        "autocorrelation": floor.autocorrelation,
        "autocorrelation_interval": list(floor.autocorrelation_interval),
        "along_outline_rad": floor.along_outline_rad,
        "expected_along_rad": floor.expected_along_rad,
        "explainable": floor.explainable(*at),
        "sentence": floor_sentence(floor, campaign.kind.unit, at),
    }


def held_out_entry(held: HeldOut, names: Sequence[str]) -> Entry:
    """Errors on what was not fitted."""
    per_sequence = {name: float(value) for name, value in zip(names, held.per_sequence_px, strict=True)}
    return {"rms_px": held.rms_px, "errors": held.errors, "per_sequence_px": per_sequence}


def rung_entry(rung: Rung, names: Sequence[str], velocity: Entry | None, last: Campaign) -> Entry:
    """One rung of a ladder, judged in the campaign of the ``last``."""
    return {
        "added": rung.added,
        "model": keys_of(rung.fit),
        "settled": rung.fit.settled,
        "fitted_rms_px": _rms_in(last, rung.fit),
        "held_out": held_out_entry(rung.held_out, names),
        "velocity": velocity,
    }


def step_entry(step: Step, names: Sequence[str], apart: Sequence[Separation] = ()) -> Entry:
    """One effect of an explanation, and what would separate its group."""
    return {
        "added": step.added,
        "group": list(step.group),
        "odds": list(step.odds),
        "probability": step.probability,
        "sure": step.sure,
        "established": step.established,
        "worth": step.worth,
        "p": step.p,
        "before": held_out_entry(step.before, names),
        "after": held_out_entry(step.after, names),
        "fitted_rms_px": rms_px(step.fit),
        "separations": [_separation(each) for each in apart],
    }


def explanation_ladder(explanation: Explanation, names: Sequence[str]) -> list[Entry]:
    """The effects that were found as rungs of a ladder."""
    steps = explanation.rungs
    if not steps:
        return []
    last = explanation.campaign
    rungs = [Rung(None, last, explanation.begun.fit, steps[0].before), *(Rung(s.added, last, s.fit, s.after) for s in steps)]
    return [rung_entry(rung, names, None, last) for rung in rungs]


def verdict_entry(verdict: Verdict, next_command: str) -> Entry:
    """The verdict and what to type next."""
    return {
        "kind": verdict.kind,
        "sentence": verdict.sentence,
        "remarks": list(verdict.remarks),
        "add": list(verdict.add),
        "next": next_command,
    }


def campaign_content(campaign: Campaign, fit: CampaignFit, covariance: CampaignCovariance, values: Sequence[EffectValue]) -> Entry:
    """Everything of a fitted campaign: the effects and, per sequence, state, parameters and where its rows of the covariance lie."""
    sequences, told = [], told_parameters(campaign, fit, covariance)
    for number, sequence in enumerate(campaign.sequences):
        flight = told.flights[number]
        sequences.append(
            {
                "name": sequence.name,
                "particle": campaign.particle[number],
                "camera": campaign.camera[number],
                "time_s": flight.time_s,
                "x_world": flight.x,
                "q_world_body": flight.q,
                "v_world": flight.v,
                "omega_world": flight.omega,
                "com": flight.com,
                "inertia": flight.inertia,
                "offset_px": flight.offset_px,
                "theta": told.theta[number],
                "whitened_mean_square": fit.equations[number].frames.mean_square,
                "rows": told.covariance.place[number],
            }
        )
    return {
        "effects": [_effect(effect) for effect in told.model.effects],
        "parameters": list(told.model.names),
        "values": value_entries(values),
        "settled": fit.settled,
        "rms_ete_px": rms_px(fit),
        "unit": campaign.kind.unit,
        "sequences": sequences,
        "covariance": told.covariance.covariance,
    }


def _effect(effect: EffectModel) -> Entry:
    entry = effect.entry
    return {
        "key": entry.key,
        "stage": entry.stage.value,
        "scope": entry.scope.value,
        "meaning": entry.meaning,
        "held": effect.instrument,
        "parameters": [{"name": p.name, "unit": p.unit} for p in entry.parameters],
    }
