"""Refits are compared in one noise: that of the best of them."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis import refits
from estimator.diagnosis.refits import Refitted, looked, refit
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.effects.registry import MODELS
from estimator.fitting.campaign import CampaignFit
from estimator.fitting.campaign_noise import body_noise_px
from tests.estimator.small_campaign import fitted, registered

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
    assert all(r.left < 5.0 * r.columns for r in found)
