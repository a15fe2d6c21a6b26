"""What a model pays for its parameters in the contest with something unknown, and which of two nested effects stands."""

from dataclasses import replace

import numpy as np
import pytest
from estimator.diagnosis.contest import better_unknown, schwarz_penalty, spread_worth, surprise_in
from estimator.diagnosis.looks import Looks
from estimator.diagnosis.refits import Refitted

from estimator.diagnosis import contest, refitting
from estimator.diagnosis.adding import with_effect
from estimator.diagnosis.score_tests import ScoreTest
from estimator.diagnosis.unknown import Unknown
from estimator.effects.empirical import EMPIRICAL
from estimator.effects.parameter_values import IMPOSSIBLE
from estimator.effects.registry import MODELS
from estimator.fitting.campaign import CampaignState
from estimator.fitting.campaign_covariance import campaign_covariance
from estimator.side_by_side import processes
from tests.estimator.small_campaign import fitted, registered


def one_number() -> float:
    return float(np.log(registered().campaign.kind.independent(registered().campaign)))


def test_a_shared_parameter_costs_what_all_measurements_say() -> None:
    campaign = registered().campaign
    assert schwarz_penalty(campaign, with_effect(campaign, fitted(), MODELS["gravity"])) == pytest.approx(3 * one_number())


def test_values_of_sequences_cost_by_their_spread_and_never_more_than_for_themselves() -> None:
    campaign, fit = registered().campaign, with_effect(registered().campaign, fitted(), MODELS["uniform_acceleration"])
    part = fit.model.slices[-1]

    def at(size: float) -> float:
        thetas = tuple(np.where(np.isin(np.arange(len(t)), np.r_[part]), size, t) for t in fit.state.theta)
        return schwarz_penalty(campaign, replace(fit, state=CampaignState(fit.state.flights, thetas)))

    none, some, much = at(0.0), at(20.0), at(1e6)
    assert none == pytest.approx(one_number())
    assert none < some < much
    assert much == pytest.approx(6 * (one_number() - np.log(2)))


def test_surprises_of_every_sequence_add_up_and_those_of_shared_values_count_once() -> None:
    campaign = registered().campaign

    def at(key: str, size: float) -> float:
        fit = with_effect(campaign, fitted(), MODELS[key])
        part = fit.model.slices[-1]
        thetas = tuple(np.concatenate([t[: part.start], [size], np.zeros(part.stop - part.start - 1)]) for t in fit.state.theta)
        there = replace(fit, state=CampaignState(fit.state.flights, thetas))
        return surprise_in(campaign, there, campaign_covariance(campaign, there))

    assert at("uniform_acceleration", 1.0) == pytest.approx(0.0, abs=1e-9)
    far = 1e4  # two thousand times what is plausible; the error bar tells nothing there
    assert at("uniform_acceleration", far) == pytest.approx(2 * 2.0 * np.log(0.5 + 0.5 * (far / 5.0) ** 2), rel=0.01)
    assert at("linear_drag", -far) == pytest.approx(IMPOSSIBLE)


def test_values_that_do_not_depend_on_one_another_are_worth_the_logarithms_of_their_squares() -> None:
    C = np.diag([1.0, 4.0, 9.0])
    values = [np.array([10.0, -0.5, 20.0]), np.array([-20.0, 0.3, 9.0]), np.array([5.0, 0.1, -12.0])]
    z2 = np.mean([v**2 / np.diag(C) for v in values], axis=0)
    assert spread_worth(values, [C] * 3) == pytest.approx(3 * np.sum(np.log(np.maximum(z2, 1.0))), rel=1e-4)


def test_values_that_are_known_together_alone_are_worth_what_is_known() -> None:
    """Each of two is within its own error; their difference, known ten thousand times as well, is not."""
    C = np.array([[1.0, 1.0 - 5e-5], [1.0 - 5e-5, 1.0]])
    values = [np.array([0.5 + d, 0.5]) for d in (0.2, -0.1, 0.3)]
    alone = 3 * np.log(np.mean([0.2**2, 0.1**2, 0.3**2]) / 1e-4)
    assert spread_worth(values, [C] * 3) > 0.5 * alone
    assert spread_worth([np.zeros(2)] * 3, [C] * 3) == pytest.approx(0.0, abs=1e-3)


def test_what_is_searched_for_is_worth_nothing() -> None:
    C = np.diag([1.0, 0.0])
    assert spread_worth([np.array([9.0, 40.0])] * 2, [C] * 2) == pytest.approx(2 * np.log(81.0), rel=1e-4)
    assert spread_worth([np.array([9.0, 40.0])] * 2, [C, np.zeros((2, 2))]) == pytest.approx(np.log(81.0), rel=1e-4)


def trial(key: str) -> Refitted:
    test = ScoreTest(MODELS[key], (), np.zeros(1), np.zeros((1, 1)), 9.0, 1e-4, 9.0, {None: np.zeros(3)})
    return Refitted(test, replace(fitted(), cost=1.0 if key == "gravity" else 2.0), 3)


@pytest.mark.parametrize(("better", "stands"), [("gravity", "gravity"), ("uniform_acceleration", "uniform_acceleration")])
def test_what_an_effect_contains_stands_where_it_is_the_better_model(monkeypatch: pytest.MonkeyPatch, better: str, stands: str) -> None:
    costs = {1.0: 0.0 if better == "gravity" else 9.0, 2.0: 5.0}
    monkeypatch.setattr(refitting, "criterion_of", lambda _campaign, fit, _known: costs[fit.cost])
    wide, narrow = trial("uniform_acceleration"), trial("gravity")
    found = refitting._simplest(registered().campaign, wide, [wide, narrow], [wide.test, narrow.test])
    assert found.test.effect.entry.key == stands


def test_effects_that_contain_nothing_stand_without_a_contest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refitting, "criterion_of", None)
    narrow = trial("gravity")
    assert refitting._simplest(registered().campaign, narrow, [narrow, trial("linear_drag")], []) is narrow


@pytest.mark.parametrize(("left", "better"), [((100.0, 60.0), True), ((420.0, 380.0), False), ((420.0, 60.0), True)])
def test_an_unknown_wins_by_what_it_leaves_in_units_of_what_the_best_leaves(
    monkeypatch: pytest.MonkeyPatch, left: tuple[float, float], better: bool
) -> None:
    """Forty for twenty of penalty is strong evidence where the best leaves what chance does, and none where all leave eight times that."""
    campaign, last = registered().campaign, with_effect(registered().campaign, fitted(), MODELS["gravity"])
    test = replace(trial("gravity").test, effect=EMPIRICAL["smooth_force"])
    own, family = (contest._Judged(each, 50, penalty) for each, penalty in zip(left, (30.0, 50.0), strict=True))
    monkeypatch.setattr(contest, "_judged", lambda _campaign, _fit, _catalogue: own)
    monkeypatch.setattr(contest, "_likely", lambda _campaign, _fit, _catalogue: [(test, (), 1e-6, np.inf)])
    monkeypatch.setattr(contest, "_of_family", lambda _campaign, _fit, _test, _catalogue: iter([(fitted(), family)]))
    assert (better_unknown(campaign, [fitted()], last, MODELS) is not None) == better


@pytest.mark.parametrize(("fallen", "left", "followed"), [(0.1, 400.0, True), (0.9, 400.0, False), (0.1, 40.0, False)])
def test_a_family_that_falls_deep_is_judged_where_its_own_flights_were_followed(
    monkeypatch: pytest.MonkeyPatch, fallen: float, left: float, followed: bool
) -> None:
    """Not one that explains little, or that leaves no more than chance does."""
    campaign, fit = registered().campaign, fitted()
    test = replace(trial("gravity").test, effect=EMPIRICAL["zoom_in_time"])
    there = replace(fit, cost=fallen * fit.cost)
    elsewhere = replace(campaign)
    monkeypatch.setattr(contest, "fit_extended", lambda *_: there)
    monkeypatch.setattr(contest, "following", lambda *_: (elsewhere, fit))
    monkeypatch.setattr(contest, "_judged", lambda where, _fit, _known: contest._Judged(1.0 if where is elsewhere else left, 50, 30.0))
    hope = (0.0, Unknown(test, 1e-6, ()))
    found = [
        (simpler.campaign is elsewhere, judged.left) for judged, simpler in contest._refitted(campaign, fit, [hope], 500.0, Looks(MODELS))
    ]
    assert found == [(False, left), (True, 1.0)][: 1 + followed]


def test_an_unknown_that_was_judged_elsewhere_is_told_there(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, last = registered().campaign, with_effect(registered().campaign, fitted(), MODELS["gravity"])
    elsewhere = replace(campaign)
    test = replace(trial("gravity").test, effect=EMPIRICAL["zoom_in_time"])
    monkeypatch.setattr(contest, "_judged", lambda *_: contest._Judged(400.0, 50, 30.0))
    monkeypatch.setattr(contest, "_likely", lambda *_: [(test, (), 1e-6, np.inf)])
    refitted = replace(fitted(), cost=0.1 * fitted().cost)
    monkeypatch.setattr(contest, "_of_family", lambda *_: iter([(refitted, contest._Judged(390.0, 50, 40.0))]))
    monkeypatch.setattr(contest, "_followed", lambda *_: (elsewhere, contest._Judged(40.0, 50, 40.0)))
    monkeypatch.setattr(contest, "fit_campaign", lambda where, *_: replace(fitted(), cost=7.0 if where is elsewhere else 0.0))
    found = better_unknown(campaign, [fitted()], last, MODELS)
    assert found is not None
    assert (found.campaign is elsewhere, found.fit.cost) == (True, 7.0)


@pytest.mark.parametrize(("promised", "refitted"), [(-200.0, True), (np.inf, False)])
def test_a_family_is_refitted_where_a_look_promises_what_chance_would_not(
    promised: float, refitted: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With fewer numbers than the last model it may leave more degrees of freedom, and so less than that one does."""
    campaign, last = registered().campaign, with_effect(registered().campaign, fitted(), MODELS["gravity"])
    test = replace(trial("gravity").test, effect=EMPIRICAL["body_thrust"])
    asked = []
    monkeypatch.setattr(contest, "_judged", lambda *_: contest._Judged(110.0, 111, 10.0))
    monkeypatch.setattr(contest, "_likely", lambda *_: [(test, (), 1e-6, promised)])
    monkeypatch.setattr(contest, "_of_family", lambda *_: asked.append(1) or iter(()))
    better_unknown(campaign, [fitted()], last, Looks(MODELS))
    assert bool(asked) is refitted


def test_of_families_that_are_refitted_at_once_one_that_another_made_needless_is_not_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    """It may cost 90 at least; the first costs 40."""
    hopes = [(least, Unknown(trial(key).test, 1e-6, ())) for least, key in ((10.0, "gravity"), (90.0, "linear_drag"))]
    monkeypatch.setattr(contest, "_of_family", lambda *_: iter([(fitted(), contest._Judged(40.0, 50, 50.0))]))
    with processes(2):
        together = contest._refitted(registered().campaign, fitted(), hopes, 100.0, Looks(MODELS))
    alone = contest._refitted(registered().campaign, fitted(), hopes, 100.0, Looks(MODELS))
    keys = [[simpler.unknown.test.effect.entry.key for _, simpler in found] for found in (together, alone)]
    assert keys == [["gravity"], ["gravity"]]
