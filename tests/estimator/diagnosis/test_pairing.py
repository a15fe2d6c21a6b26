"""Which pairs are proposed, which of them can be a pair at all, and what each member cannot be told from."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimator.diagnosis.pairing import Pairs
from estimator.diagnosis.refits import Refitted, Rules

from estimator.diagnosis import pairing
from estimator.diagnosis.score_tests import Column, EfficientScores, ScoreTest
from estimator.effects.registry import MODELS

NOTHING: Any = None
MOST_ALIKE = 1e4


def trial(number: int, key: str) -> ScoreTest:
    column = (Column(number, 0, 0, None),)
    return ScoreTest(MODELS[key], column, np.ones(1), np.eye(1), 9.0, 1e-4, 9.0, {None: np.zeros(len(MODELS[key].entry.parameters))})


def scores(H: np.ndarray, theta: np.ndarray) -> EfficientScores:
    columns = tuple(Column(i, 0, 0, None) for i in range(len(H)))
    return EfficientScores(columns, -H @ theta, H, H)


def beside(keys: tuple[str, ...], H: np.ndarray, theta: np.ndarray) -> Refitted:
    """A gravity that was refitted, and what the other effects say there."""
    others = tuple(trial(i, key) for i, key in enumerate(keys))
    return Refitted(trial(9, "gravity"), NOTHING, 3, others=others, scores=scores(H, theta), left=5e3, columns=len(keys), cost=5e3)


@pytest.fixture
def search(monkeypatch: pytest.MonkeyPatch) -> Pairs:
    monkeypatch.setattr(pairing, "penalty_of", lambda _campaign: 4.0)
    return Pairs(NOTHING, NOTHING, (), NOTHING, Rules())


def test_a_large_effect_has_the_mates_that_a_linear_look_takes_for_strangers(search: Pairs) -> None:
    """The look is off by a share of what it explains: what leaves 60 more of 10 000 is refitted, what leaves all is not."""
    H = np.eye(3)
    H[0, 1] = H[1, 0] = np.sqrt(1.0 - 60.0 / MOST_ALIKE)
    single = beside(("blooming", "outline_offset", "magnus_lift"), H, np.array([np.sqrt(MOST_ALIKE), 0.0, 0.0]))
    proposed = search._in_place_of("blooming", single)
    assert [sorted(pair.keys) for pair in proposed] == [["gravity", "outline_offset"]]


def test_what_a_linear_look_says_nothing_of_has_no_mates(search: Pairs) -> None:
    single = beside(("blooming", "outline_offset", "magnus_lift"), np.eye(3), np.array([0.1, 0.0, 30.0]))
    assert search._in_place_of("blooming", single) == []
    assert search._in_place_of("gravity", single) == []


def test_where_no_model_fits_a_look_that_says_nothing_still_has_no_mates(search: Pairs) -> None:
    """Every effect leaves a large misfit, in whose unit they are compared: among twenty none that explains nothing has mates."""
    keys = tuple(key for key in MODELS if key not in ("gravity", "uniform_acceleration", "frame_rate", "length_scale"))[:20]
    single = beside(keys, np.eye(20), np.concatenate([[0.3], np.full(19, 6.0)]))
    assert search._in_place_of(keys[0], single) == []


def test_what_contradicts_or_contains_another_is_no_pair(search: Pairs) -> None:
    keys = ("frame_rate", "uniform_acceleration", "magnus_lift")
    single = beside(keys, np.eye(3), np.array([40.0, 40.0, 30.0]))
    assert {pair.keys for pair in search._beside_one([single])} == {frozenset(("gravity", "magnus_lift"))}


def test_a_pair_that_the_second_comparison_refuses_does_not_stand(search: Pairs, monkeypatch: pytest.MonkeyPatch) -> None:
    best = frozenset(("gravity", "magnus_lift"))
    answers = iter([best, None])
    monkeypatch.setattr(Pairs, "_likely", lambda *_: [])
    monkeypatch.setattr(Pairs, "_compared", lambda _self, alone, pairs: (dict(alone), {best: NOTHING, **pairs}))
    monkeypatch.setattr(Pairs, "_with_members", lambda _self, alone, _pair: dict(alone))
    monkeypatch.setattr(Pairs, "_with_mates", lambda _self, _alone, pairs, _best: dict(pairs))
    monkeypatch.setattr(Pairs, "_best", lambda *_: next(answers))
    assert search.better([]) == ()
    assert next(answers, "asked twice") == "asked twice"


def test_a_pair_that_was_led_astray_beside_its_members_does_not_stand(search: Pairs, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its look failed in the noise of a member that costs less: it is no longer among the pairs, whose mates would be asked for."""
    monkeypatch.setattr(Pairs, "_likely", lambda *_: [])
    monkeypatch.setattr(Pairs, "_compared", lambda _self, alone, pairs: (dict(alone), dict(pairs)))
    monkeypatch.setattr(Pairs, "_with_members", lambda _self, alone, _pair: dict(alone))
    monkeypatch.setattr(Pairs, "_best", lambda *_: frozenset(("gravity", "magnus_lift")))
    assert search.better([]) == ()


def test_of_a_pair_proposed_from_two_sides_the_lower_cost_counts(search: Pairs, monkeypatch: pytest.MonkeyPatch) -> None:
    tests = (trial(0, "gravity"), trial(1, "magnus_lift"))
    proposed = [pairing.Proposed(fit, tests, 0.0, 1) for fit in ("low", "high", "low")]
    asked: list[str] = []

    def refit(_campaign: Any, _before: Any, fit: Any, pair: Any) -> Refitted:
        asked.append(fit)
        return Refitted(pair[1], fit, 4, cost=3.0 if fit == "low" else 7.0)

    monkeypatch.setattr(pairing, "refit_pair", refit)
    (found,) = search._refitted(proposed).values()
    assert (found.fit, asked) == ("low", ["low", "high"])


@pytest.mark.parametrize(("left", "stands"), [(77.0, False), (72.0, True)])
def test_the_best_of_many_pairs_has_to_be_better_by_their_number(search: Pairs, left: float, stands: bool) -> None:
    """Of 25 effects there are twelve pairs for each: the best of so many has to be better by 5 more than the best of three."""
    key = frozenset(("magnus_lift", "radial_distortion"))
    many = replace(search, tests=tuple(trial(i, "gravity") for i in range(25)))
    single = Refitted(trial(0, "uniform_acceleration"), NOTHING, 12, cost=1105.0, left=48.0, columns=46)
    pair = Refitted(trial(1, "magnus_lift"), "another fit", 3, cost=1120.0, left=left, columns=46)  # type: ignore[arg-type]
    assert (many._best([single], {key: pair}) == key) is stands
    assert replace(search, tests=many.tests[:3])._best([single], {key: pair}) == key


def test_groups_of_a_pair() -> None:
    """A twin of either member in place of it, with the other one or with the other's twin."""
    near = [frozenset(pair) for pair in (("a", "b"), ("a2", "b"), ("a2", "b2"), ("a3", "b2"))]
    best = near[0]
    assert pairing._group(near, best, "a") == ("a", "a2")
    assert pairing._group(near, best, "b") == ("b", "b2")
    assert pairing._group([best], best, "a") == ("a",)


def test_the_pair_that_promises_the_least_cost_is_refitted_whatever_a_look_leaves(search: Pairs) -> None:
    """Noise behind a poor fit hides what explains most of it."""
    single = beside(("blooming", "rolling_shutter", "magnus_lift"), np.eye(3), np.array([70.0, 5.0, 4.0]))
    hidden = replace(single, others=(single.others[0], replace(single.others[1], explained=600.0), single.others[2]), cost=2600.0)
    assert [sorted(pair.keys) for pair in search._beside_one([hidden])] == [["blooming", "gravity"], ["gravity", "rolling_shutter"]]


@pytest.mark.parametrize(("cost", "counts"), [(1548.0, 1548.0), (6000.0, 5270.0)])
def test_a_mate_that_was_led_astray_from_one_side_is_tried_from_the_other(
    search: Pairs, monkeypatch: pytest.MonkeyPatch, cost: float, counts: float
) -> None:
    keys = ("blooming", "outline_offset", "magnus_lift")
    single = beside(keys, np.array([[1.0, 0.99, 0.0], [0.99, 1.0, 0.0], [0.0, 0.0, 1.0]]), np.array([60.0, 0.0, 0.0]))
    best, mate = frozenset(("gravity", "blooming")), frozenset(("gravity", "outline_offset"))
    fits: list[Any] = [object(), object(), object()]
    pairs = {
        best: Refitted(single.test, fits[0], 5, cost=1547.0, left=40.0, columns=44),
        mate: Refitted(single.test, fits[1], 5, cost=5270.0, left=3750.0, columns=44),
    }
    monkeypatch.setattr(pairing, "refit_pair", lambda *_given: Refitted(single.test, fits[2], 5, cost=cost))
    found = search._with_mates({"gravity": single, "blooming": single}, pairs, best)
    assert found[mate].cost == counts
    assert found[best] is pairs[best]
