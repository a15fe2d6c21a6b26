"""What was found first is looked at again beside what was found later."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from estimator.diagnosis.refits import Refitted, Rules, key_of, named

from estimator.diagnosis import explain
from estimator.diagnosis.explain import MOST_EXCHANGED, Reached, Step
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.registry import MODELS

NOTHING: Any = None
ERROR: Any = SimpleNamespace(rms_px=0.136)
TESTED = ("view_outline_offset", "outline_offset", "uniform_acceleration", "gravity")


def trial(key: str) -> ScoreTest:
    return ScoreTest(MODELS[key], (), np.zeros(1), np.zeros((1, 1)), 9.0, 1e-4, 9.0, {None: np.zeros(2)})


def fit_with(*keys: str, rms_px: float = 0.136) -> Any:
    model = SimpleNamespace(keys=keys, effects=tuple(MODELS[key] for key in keys))
    return SimpleNamespace(model=model, state=rms_px)


def reached(*keys: str) -> Reached:
    fit, tests = fit_with(*keys), tuple(trial(key) for key in TESTED)
    steps = tuple(Step(key, (key,), 1e-9, tests, NOTHING, ERROR, ERROR, True, fit) for key in keys)
    return Reached(NOTHING, fit, steps, (), ERROR)


@pytest.fixture
def leading(monkeypatch: pytest.MonkeyPatch) -> dict[str, Refitted]:
    """What leads in place of each effect, to be filled by a test; the effect itself where nothing is."""
    found: dict[str, Refitted] = {}

    def in_place(*given: Any) -> Refitted:
        key = given[-1]
        return found.get(key, Refitted(trial(key), NOTHING, 1, group=(key,)))

    monkeypatch.setattr(explain, "in_place", in_place)
    monkeypatch.setattr(explain, "without_effect", lambda *_: NOTHING)
    monkeypatch.setattr(explain, "tests_at", lambda *_: ((), NOTHING))
    monkeypatch.setattr(explain, "rank", lambda *_, **__: NOTHING)
    monkeypatch.setattr(explain, "penalty_of", lambda _: 4.0)
    monkeypatch.setattr(explain, "following", lambda campaign, fit: (campaign, fit))
    monkeypatch.setattr(explain, "held_out", lambda _campaign, state, _model: SimpleNamespace(rms_px=state))
    return found


def exchanged(at: Reached) -> Reached:
    return explain._exchanged(at, {}, Rules(), lambda _: None)


def test_what_explains_more_beside_the_others_takes_the_place(leading: dict[str, Refitted]) -> None:
    at = reached("view_outline_offset", "uniform_acceleration")
    better = fit_with("uniform_acceleration", "outline_offset", rms_px=0.120)
    leading["view_outline_offset"] = Refitted(trial("outline_offset"), better, 1, group=("outline_offset",))
    found = exchanged(at)
    assert found.fit is better
    assert found.dropped == ("view_outline_offset",)
    assert (found.steps[-1].added, found.steps[-1].accepted, found.error.rms_px) == ("outline_offset", True, 0.120)


def test_what_held_out_errors_refuse_belongs_to_the_group(leading: dict[str, Refitted]) -> None:
    at = reached("view_outline_offset", "uniform_acceleration")
    worse = fit_with("uniform_acceleration", "outline_offset", rms_px=0.140)
    leading["view_outline_offset"] = Refitted(trial("outline_offset"), worse, 1, group=("outline_offset",))
    found = exchanged(at)
    assert found.fit is at.fit
    assert [step.group for step in found.steps] == [("view_outline_offset", "outline_offset"), ("uniform_acceleration",)]


@pytest.mark.parametrize("others", [(), ("uniform_acceleration", "gravity")])
def test_what_cannot_be_told_apart_any_more_leaves_the_name(others: tuple[str, ...], leading: dict[str, Refitted]) -> None:
    """The leader is one of a group: names do not change where the data do not decide, however many are alike."""
    at = reached("view_outline_offset", "uniform_acceleration")
    rivals = tuple(Refitted(trial(key), NOTHING, 1) for key in (*others, "view_outline_offset"))
    group = named(("outline_offset", *map(key_of, rivals)))
    leading["view_outline_offset"] = Refitted(trial("outline_offset"), fit_with(rms_px=0.1), 1, group=group, rivals=rivals)
    found = exchanged(at)
    assert found.fit is at.fit
    assert [step.group for step in found.steps] == [named(("view_outline_offset", *group)), ("uniform_acceleration",)]


@pytest.mark.parametrize("count", [1, MOST_EXCHANGED + 1])
def test_one_effect_alone_and_too_many_are_left_as_they_are(count: int, leading: dict[str, Refitted]) -> None:
    leading["gravity"] = Refitted(trial("outline_offset"), fit_with("outline_offset", rms_px=0.1), 1, group=("outline_offset",))
    at = reached(*("gravity", "uniform_acceleration", "view_outline_offset", "spin_damping")[:count])
    assert exchanged(at) is at


def test_what_contains_an_effect_stays_in_its_group(leading: dict[str, Refitted], monkeypatch: pytest.MonkeyPatch) -> None:
    """A gravity and a drag imitate every sequence's own acceleration in fewer words; beside the drag nothing tells of that any more."""
    monkeypatch.setattr(explain, "tests_at", lambda *_: ([trial(key) for key in TESTED], NOTHING))
    at = reached("gravity", "linear_drag")
    first = replace(at.steps[0], group=("gravity", "length_scale", "uniform_acceleration"))
    leading["gravity"] = Refitted(trial("gravity"), NOTHING, 3, group=("gravity", "frame_rate"))
    found = exchanged(replace(at, steps=(first, at.steps[1])))
    assert [step.group for step in found.steps] == [("gravity", "uniform_acceleration", "frame_rate"), ("linear_drag",)]
    assert exchanged(at).steps[0].group == ("gravity", "frame_rate"), "what was never in it does not come in"
