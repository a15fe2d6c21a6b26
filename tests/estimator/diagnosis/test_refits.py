"""Refits are compared in one noise: that of the best of them."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimator.diagnosis.refits import (
    MOST_NAMED,
    Refitted,
    alike,
    judged,
    key_of,
    looked,
    named,
    refit,
    refit_pair,
    twins_of,
    wider,
    with_twins,
)
from scipy.stats import chi2

from estimator.diagnosis import refits
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.effects.registry import MODELS
from estimator.fitting.campaign import CampaignFit
from estimator.fitting.campaign_noise import body_noise_px
from tests.estimator.small_campaign import fitted, registered

NOTHING: Any = None
ASKED = ("gravity", "linear_drag", "magnus_lift")


def poorer(fit: CampaignFit) -> CampaignFit:
    """The fit with a body-fixed error that is not there: every pair off to the same side."""
    worse = [replace(each, errors=replace(each.errors, e=each.errors.e + 0.3 * each.errors.seen)) for each in fit.equations]
    return replace(fit, equations=tuple(worse))


def trials(like: CampaignFit | None) -> tuple[list[ScoreTest], np.ndarray, np.ndarray]:
    campaign = registered().campaign
    tests, scores = score_tests(campaign, fitted(), Candidates.of(campaign, [MODELS[k] for k in ASKED]), like=like)
    return tests, scores.H, scores.M


def test_a_fit_is_tested_in_the_noise_of_another() -> None:
    own, H, M = trials(None)
    same, _, again = trials(fitted())
    assert np.array_equal(M, again)
    assert [t.statistic for t in own] == [t.statistic for t in same]
    noisy, H_noisy, M_noisy = trials(poorer(fitted()))
    assert np.array_equal(H, H_noisy)
    assert np.all(np.diag(M_noisy) > 1.2 * np.diag(M))
    assert all(t.statistic < o.statistic for t, o in zip(noisy, own, strict=True))


def test_a_poor_fit_shows_more_noise() -> None:
    campaign, fit = registered().campaign, fitted()
    here, there = (body_noise_px(campaign, [e.errors for e in each.equations]) for each in (fit, poorer(fit)))
    assert np.all(there > here)


def test_all_are_looked_at_in_the_noise_of_the_least_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[str, float]] = []

    def look(_campaign: object, refitted: Refitted, _tests: Sequence[ScoreTest], like: CampaignFit) -> Refitted:
        seen.append((refits.key_of(refitted), like.cost))
        return replace(refitted, like=like, left=refitted.cost)

    monkeypatch.setattr(refits, "_looked", look)
    tests = trials(None)[0]
    costs = dict(zip(ASKED, (7.0, 5.0, np.inf), strict=True))
    made = [Refitted(t, replace(fitted(), cost=costs[t.effect.entry.key]), 1, cost=costs[t.effect.entry.key]) for t in tests]
    found = looked(registered().campaign, made, tests)
    assert seen == [("gravity", 5.0), ("linear_drag", 5.0)]
    assert [r.flew for r in found] == [True, True, False]
    seen.clear()
    looked(registered().campaign, found, tests)
    assert not seen  # nothing has changed
    better = Refitted(tests[2], replace(fitted(), cost=1.0), 1, cost=1.0)
    looked(registered().campaign, [*found[:2], better], tests)
    assert [like for _, like in seen] == [1.0] * 3


def test_a_refit_that_nothing_asks_for_leaves_what_was_left() -> None:
    """Nothing is missing: with any effect more, chance is left of the others, and the cost hardly falls."""
    campaign, fit = registered().campaign, fitted()
    tests = trials(None)[0]
    found = looked(campaign, [refit(campaign, fit, test) for test in tests], tests)
    assert all(r.flew for r in found)
    assert all(fit.cost - r.cost < 10.0 for r in found)
    assert all(chi2.sf(r.left, r.columns) > 1e-3 for r in found)


def test_a_pair_that_costs_more_than_nothing_is_astray(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, fit = registered().campaign, fitted()
    pair = (trials(None)[0][0], trials(None)[0][1])
    monkeypatch.setattr(refits, "fit_extended", lambda *_: replace(fit, cost=0.0))
    for risen, flew in ((-1.0, True), (1.0, False)):
        monkeypatch.setattr(refits, "cost_like", lambda *_, risen=risen: fit.cost + risen)
        monkeypatch.setattr(refits, "surprise_of", lambda *_: 0.0)
        monkeypatch.setattr(refits, "_values", lambda _fit, test: np.zeros(len(test.columns)))
        assert np.isfinite(refit_pair(campaign, fit, fit, pair).cost) is np.bool_(flew)


@pytest.mark.parametrize(("count", "flew"), [(0.39, False), (0.41, True)])
def test_a_gap_of_a_part_of_a_frame_explains_nothing(monkeypatch: pytest.MonkeyPatch, count: float, flew: bool) -> None:
    """Fitted gaps of a part of a frame in every sequence imitate what pushes it; that is no gap, alone or beside another effect."""
    campaign, fit = registered().campaign, fitted()
    gap = score_tests(campaign, fit, Candidates.of(campaign, [MODELS["dropped_frames"]]))[0][0]
    found = np.array([count if MODELS["dropped_frames"].entry.parameters[c.parameter].name == "count" else 40.0 for c in gap.columns])
    gravity = trials(None)[0][0]
    monkeypatch.setattr(refits, "fit_extended", lambda *_: replace(fit, cost=0.0))
    monkeypatch.setattr(refits, "cost_like", lambda *_: fit.cost - 1.0)
    monkeypatch.setattr(refits, "_values", lambda _fit, test: found if test is gap else np.zeros(len(test.columns)))
    assert np.isfinite(refit(campaign, fit, gap).cost) is np.bool_(flew)
    assert np.isfinite(refit_pair(campaign, fit, fit, (gravity, gap)).cost) is np.bool_(flew)


@pytest.mark.parametrize(
    ("left", "cost", "unit", "says_more"),
    [(95.4, 1100.0, 1.0, True), (98.0, 1100.0, 1.0, False), (113.0, 1091.0, 1.0, True), (95.4, 1091.0, 1.5, False)],
)
def test_what_contains_the_chosen_and_says_more_is_its_rival(left: float, cost: float, unit: float, says_more: bool) -> None:
    """Nine parameters more, of which chance makes 16.9 once in twenty times: by the scores, or by the cost, in the unit of misfits."""

    def left_by(key: str, parameters: int, left: float, cost: float) -> Refitted:
        test = ScoreTest(MODELS[key], (), np.zeros(1), np.zeros((1, 1)), 9.0, 1e-4, 9.0, {None: np.zeros(3)})
        return Refitted(test, NOTHING, parameters, cost=cost, left=left, columns=46, unit=unit)

    gravity, drag = left_by("gravity", 3, 113.6, 1100.0), left_by("linear_drag", 12, left, cost)
    wide = left_by("uniform_acceleration", 12, left, cost)
    assert wider([gravity, drag, wide], gravity, 0.05) == ([wide] if says_more else [])
    assert wider([gravity, drag, wide], wide, 0.05) == []
    assert wider([gravity, replace(wide, left=np.inf)], gravity, 0.05) == []


def test_what_was_led_astray_is_last_and_a_number_all_the_same() -> None:
    """Where both were, the criterion of neither is a number that compares; that of the one that flew is."""
    tests = trials(None)[0]
    flew = Refitted(tests[0], fitted(), 1, cost=10.0, left=50.0, columns=10)
    astray = [Refitted(test, fitted(), 1) for test in tests[1:]]
    assert [r.criterion for r in judged(astray, 4.0)] == [np.inf, np.inf]
    assert judged([*astray, flew], 4.0)[0].test is tests[0]


def test_what_either_way_of_judging_cannot_tell_apart_is_one_group() -> None:
    """Scores and cost may disagree where models are inexact: only what both tell apart is apart, and the cheapest beyond belongs to it."""
    test = ScoreTest(MODELS["gravity"], (), np.zeros(1), np.zeros((1, 1)), 9.0, 1e-4, 9.0, {None: np.zeros(3)})

    def judged_as(evidence: float, cost: float, parameters: int = 2) -> Refitted:
        return Refitted(test, NOTHING, parameters, cost=cost, evidence=evidence)

    chosen = judged_as(50.0, 1100.0)
    by_scores, by_cost, apart = judged_as(55.0, 1300.0), judged_as(90.0, 1101.0), judged_as(90.0, 1110.0)
    assert alike([chosen, by_scores, by_cost, apart], chosen, 4.0, 6.0) == [chosen, by_scores, by_cost]
    more_words = judged_as(90.0, 1101.0, parameters=4)
    assert alike([chosen, more_words], chosen, 4.0, 6.0) == [chosen]
    cheap, cheaper, nearly = judged_as(90.0, 1090.0), judged_as(90.0, 1080.0), judged_as(90.0, 1082.0)
    assert alike([chosen, cheap, cheaper, nearly], chosen, 4.0, 6.0) == [chosen, cheaper, nearly]
    assert alike([chosen, apart], replace(chosen, unit=5.0), 4.0, 6.0) == [chosen, apart], "where models leave five times what chance does"


def test_of_many_that_are_alike_the_likeliest_are_named() -> None:
    keys = ("gravity", "length_scale", "gravity", "frame_rate", "linear_drag")
    assert named(keys) == ("gravity", "length_scale", "frame_rate")
    assert len(named(keys)) == MOST_NAMED


class Body:
    """A campaign of which only the hollows count."""

    def __init__(self, hollow: float) -> None:
        self.sequences, self.kind, self.share = (None,), self, hollow

    def hollow(self, _sequence: Any) -> float:
        return self.share


@pytest.mark.parametrize(
    ("hollow", "leaks", "twins"),
    [(0.0, 60.0, {"view_outline_offset"}), (0.03, 60.0, {"view_outline_offset", "rim_light_leak"}), (0.03, 40.0, {"view_outline_offset"})],
)
def test_twins_are_told_together_where_they_explain_half_as_much(hollow: float, leaks: float, twins: set[str]) -> None:
    """What tells them apart is less than what the reduced models are off by; on bodies without hollows leaks are well known."""
    explained = {"outline_offset": 100.0, "view_outline_offset": 70.0, "rim_light_leak": leaks, "blooming": 99.0}
    tests = [
        ScoreTest(MODELS[key], (), np.zeros(1), np.zeros((1, 1)), 9.0, 1e-4, size, {None: np.zeros(1)}) for key, size in explained.items()
    ]
    body: Any = Body(hollow)
    assert twins_of(body, tests[0], tests) == twins
    chosen, *others = [Refitted(test, NOTHING, 1) for test in tests]
    assert {key_of(r) for r in with_twins(body, [chosen], [chosen, *others], chosen)} == {"outline_offset", *twins}


def test_twins_are_mutual() -> None:
    for key, effect in MODELS.items():
        for hollow in (0.0, 1.0):
            assert all(key in MODELS[twin].twins_on(hollow) for twin in effect.twins_on(hollow))
