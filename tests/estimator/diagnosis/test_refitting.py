"""What a step refits: effects that come in whole numbers, and have none, are no candidates."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from estimator.diagnosis.refits import Refitted, Rules, key_of
from estimator.diagnosis.refitting import contenders, in_place, random_contender

from estimator.diagnosis import refitting
from estimator.diagnosis.ranking import Hypothesis, Ranking
from estimator.diagnosis.score_tests import EfficientScores, ScoreTest
from estimator.effects.registry import MODELS

NO_SCORES = EfficientScores((), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))


def trial(key: str, *, counts: bool) -> ScoreTest:
    return ScoreTest(MODELS[key], (), np.zeros(1), np.zeros((1, 1)), 9.0, 1e-4, 9.0, {None: np.zeros(2)}, counts)


GAP, JITTER = trial("dropped_frames", counts=False), trial("trigger_jitter", counts=True)
LEADING_GAP = Ranking((Hypothesis(0, 1, 1.0, 5.0), Hypothesis(1, 1, 4.0, 8.0)), 20.0, 2)
NOTHING: Any = None
JITTERED = SimpleNamespace(key="trigger_jitter", holds_it=True)


def refit_of(_campaign: object, _fit: object, test: ScoreTest) -> SimpleNamespace:
    return SimpleNamespace(key=test.effect.entry.key, holds_it=True)


def test_a_gap_of_no_frames_is_no_contender() -> None:
    assert contenders(NOTHING, NOTHING, ([GAP, JITTER], NO_SCORES, LEADING_GAP), Rules()) == ()


def test_jitter_behind_a_gap_of_no_frames_leads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refitting, "refit", refit_of)
    assert random_contender(NOTHING, NOTHING, ([GAP, JITTER], NO_SCORES, LEADING_GAP), Rules()) == (JITTERED,)
    whole = [replace(GAP, counts=True), JITTER]
    assert random_contender(NOTHING, NOTHING, (whole, NO_SCORES, LEADING_GAP), Rules()) == ()


def test_jitter_that_alone_is_significant_leads(monkeypatch: pytest.MonkeyPatch) -> None:
    """One fast sequence among slow ones shows it in its second differences; sums over misfits hardly do."""
    monkeypatch.setattr(refitting, "refit", refit_of)
    chance = [replace(GAP, counts=True, p=0.3), JITTER]
    assert random_contender(NOTHING, NOTHING, (chance, NO_SCORES, LEADING_GAP), Rules()) == (JITTERED,)


def test_jitter_under_which_flights_run_away_is_no_contender(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refitting, "refit", lambda *_given: SimpleNamespace(key="trigger_jitter", holds_it=False))
    assert random_contender(NOTHING, NOTHING, ([GAP, JITTER], NO_SCORES, LEADING_GAP), Rules()) == ()


def test_what_explains_most_is_refitted_even_if_a_look_leaves_more() -> None:
    keys = ("radial_distortion", "gravity", "spin_damping", "quadratic_drag", "focal_length", "rolling_shutter")
    tests = [replace(trial(key, counts=True), explained=600.0 if key == "rolling_shutter" else 100.0) for key in keys]
    known = [Hypothesis(number, 1, 60.0 + number, 70.0 + number) for number in range(len(keys))]
    chosen = refitting._shortlist(known, tests, Rules())
    assert [test.effect.entry.key for test in chosen] == [*keys[:4], "rolling_shutter"]


@pytest.mark.parametrize(
    ("lower", "group"), [(-10.0, ("gravity",)), (-2.0, ("gravity", "rim_light_leak")), (40.0, ("gravity", "rim_light_leak"))]
)
def test_what_the_cost_prefers_or_cannot_tell_apart_is_in_the_group(
    lower: float, group: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The scores leave less beside a gravity, three numbers, the fit with a leak, one number, costs less by ``lower``.

    Two more for two numbers fewer tells nothing.
    """
    tests = [trial(key, counts=True) for key in ("gravity", "rim_light_leak", "blooming")]
    sizes = zip(tests, (3, 1, 1), (500.0, 500.0 - lower, 600.0), (50.0, 90.0, 95.0), strict=True)
    refits = [Refitted(test, NOTHING, n, cost=cost, left=left, columns=46) for test, n, cost, left in sizes]
    monkeypatch.setattr(refitting, "refit", lambda _campaign, _fit, test: next(r for r in refits if r.test is test))
    monkeypatch.setattr(refitting, "looked", lambda _campaign, found, _tests: list(found))
    monkeypatch.setattr(refitting, "penalty_of", lambda _campaign: 4.0)
    look = Ranking(tuple(Hypothesis(i, 1, 1.0 + i, 5.0 + i) for i in range(3)), 20.0, 2)
    (found,) = contenders(NOTHING, NOTHING, (tests, NO_SCORES, look), Rules())
    assert found.group == group


@pytest.mark.parametrize(
    ("left", "cost", "leader"),
    [
        (40.0, 484.0, ("gravity",)),
        (48.0, 484.0, ("gravity", "blooming")),
        (53.0, 476.0, ("blooming", "gravity")),
        (70.0, 476.0, ("blooming",)),
    ],
)
def test_an_effect_beside_others_is_judged_as_it_is(
    left: float, cost: float, leader: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is not refitted, though a look would not have it on the shortlist; scores ``left`` beside it decide.

    The ``cost`` of a blooming in its place tells them apart.
    """
    keys = ("blooming", "rolling_shutter", "rim_light_leak", "spin_damping", "quadratic_drag", "gravity")
    tests = [trial(key, counts=True) for key in keys]
    as_it_is = Refitted(tests[-1], NOTHING, 1, cost=480.0, left=left, columns=46)
    asked: list[str] = []

    def refit_one(_campaign: object, _fit: object, test: ScoreTest) -> Refitted:
        key = test.effect.entry.key
        asked.append(key)
        bloomed = key == "blooming"
        return Refitted(test, NOTHING, 1, cost=cost if bloomed else 600.0, left=50.0 if bloomed else 300.0, columns=46)

    monkeypatch.setattr(refitting, "as_it_is", lambda *_: as_it_is)
    monkeypatch.setattr(refitting, "refit", refit_one)
    monkeypatch.setattr(refitting, "looked", lambda _campaign, found, _tests: list(found))
    monkeypatch.setattr(refitting, "penalty_of", lambda _campaign: 4.0)
    look = Ranking(tuple(Hypothesis(i, 1, 50.0 + 40.0 * i, 54.0 + 40.0 * i) for i in range(len(keys))), 500.0, 46)
    found = in_place(NOTHING, NOTHING, NOTHING, (tests, NO_SCORES, look), Rules(), "gravity")
    assert found is not None
    assert found.group == leader
    assert "gravity" not in asked
    assert in_place(NOTHING, NOTHING, NOTHING, (tests[:-1], NO_SCORES, look), Rules(), "gravity") is None


def test_twins_are_named_before_the_likeliest_and_all_are_rivals(monkeypatch: pytest.MonkeyPatch) -> None:
    keys = ("outline_offset", "gravity", "linear_drag", "blooming", "view_outline_offset")
    refits = [
        Refitted(trial(key, counts=True), NOTHING, 1, cost=500.0, left=50.0, columns=46, evidence=54.0 + i, criterion=54.0 + i)
        for i, key in enumerate(keys)
    ]
    monkeypatch.setattr(refitting, "penalty_of", lambda _campaign: 4.0)
    body: Any = SimpleNamespace(sequences=(None,), kind=SimpleNamespace(hollow=lambda _sequence: 0.0))
    leader = refitting._leader(body, refits, [r.test for r in refits], Rules())
    assert leader.group == ("outline_offset", "view_outline_offset", "gravity")
    assert [key_of(r) for r in leader.rivals] == ["view_outline_offset", "gravity", "linear_drag", "blooming"]


def test_of_many_rivals_those_are_named_that_both_measures_like(monkeypatch: pytest.MonkeyPatch) -> None:
    """Scores put a tangential distortion fifth, where it costs less than the four before it: it is no less likely than the second."""
    keys = ("radial_distortion", "focal_length", "principal_point", "pixel_aspect", "tangential_distortion")
    refits = [
        Refitted(trial(key, counts=True), NOTHING, 1, cost=cost, left=50.0, columns=46, evidence=54.0 + i, criterion=54.0 + i)
        for i, (key, cost) in enumerate(zip(keys, (500.0, 500.0, 500.0, 500.0, 495.0), strict=True))
    ]
    monkeypatch.setattr(refitting, "penalty_of", lambda _campaign: 4.0)
    body: Any = SimpleNamespace(sequences=(None,), kind=SimpleNamespace(hollow=lambda _sequence: 0.0))
    leader = refitting._leader(body, refits, [r.test for r in refits], Rules())
    assert leader.group == ("radial_distortion", "tangential_distortion", "focal_length")


def test_what_contains_the_leader_and_says_more_is_named_before_the_likeliest(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every sequence's own acceleration, of nine parameters more than a gravity that leaves 20 more: no data speak against it."""
    keys = ("gravity", "linear_drag", "quadratic_drag", "uniform_acceleration")
    left = dict(zip(keys, (100.0, 100.0, 100.0, 80.0), strict=True))
    sizes = dict(zip(keys, (3, 3, 3, 12), strict=True))
    refits = [
        Refitted(trial(key, counts=True), NOTHING, sizes[key], 500.0, left=left[key], columns=46, evidence=left[key] + 4.0 * sizes[key])
        for key in keys
    ]
    refits = [replace(r, criterion=r.evidence) for r in refits]
    monkeypatch.setattr(refitting, "penalty_of", lambda _campaign: 4.0)
    body: Any = SimpleNamespace(sequences=(None,), kind=SimpleNamespace(hollow=lambda _sequence: 0.0))
    leader = refitting._leader(body, refits, [r.test for r in refits], Rules())
    assert leader.group == ("gravity", "uniform_acceleration", "linear_drag")
