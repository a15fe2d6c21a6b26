"""An unknown is looked for early where much is left after two steps, and only there."""

from types import SimpleNamespace
from typing import Any

import pytest

from estimator.diagnosis import explain as module
from estimator.diagnosis.explain import Reached, explain
from estimator.diagnosis.refits import Rules

NOTHING: Any = None
STAGE = SimpleNamespace(stage="optics")


def fit_with(*keys: str) -> Any:
    return SimpleNamespace(model=SimpleNamespace(keys=keys), state=keys)


def step(key: str, *, accepted: bool = True) -> Any:
    return SimpleNamespace(added=key, accepted=accepted, fit=fit_with(key))


class Loop:
    """Replaces what ``explain`` calls; remembers how many effects each climb was allowed and where an unknown was asked for."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, p: float, accepted: bool = True, unknown_wins: bool = True) -> None:
        self.allowed: list[int] = []
        self.asked: list[int] = []
        self.p, self.accepted, self.unknown_wins = p, accepted, unknown_wins
        for name, stub in {
            "following": lambda campaign, fit: (campaign, fit),
            "fit_campaign": lambda *_: fit_with(),
            "start_with": lambda *_: NOTHING,
            "held_out": lambda *_: NOTHING,
            "campaign_covariance": lambda *_: NOTHING,
            "unknown": lambda *_: STAGE,
            "_climbed": self.climbed,
            "_settled": lambda at, last, *_: (at, last),
            "better_unknown": self.better_unknown,
        }.items():
            monkeypatch.setattr(module, name, stub)

    def climbed(self, at: Reached, _catalogue: Any, rules: Rules, _told: Any) -> Any:
        self.allowed.append(rules.most_effects)
        keys = ("gravity", "linear_drag", "magnus_lift")[: rules.most_effects]
        steps = tuple(step(key, accepted=self.accepted) for key in keys)
        p = self.p if rules.most_effects == module.FEW else 1.0
        return Reached(at.campaign, fit_with(*keys), steps, (), NOTHING), ([SimpleNamespace(p=p)], NOTHING)

    def better_unknown(self, _campaign: Any, fits: Any, *_: Any, **__: Any) -> Any:
        self.asked.append(len(fits))
        return SimpleNamespace(unknown=STAGE, fit=fit_with()) if self.unknown_wins else None

    def run(self) -> Any:
        campaign: Any = SimpleNamespace(kind=SimpleNamespace(base=SimpleNamespace(size=0)))
        return explain(campaign, NOTHING, {}, Rules())


def test_an_unknown_that_explains_much_ends_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, p=1e-200)
    found = loop.run()
    assert (loop.allowed, loop.asked) == ([module.FEW], [module.FEW])
    assert found.left is STAGE
    assert found.dropped == ("gravity", "linear_drag")


@pytest.mark.parametrize(("p", "unknown_wins", "asked"), [(1e-200, False, [2, 3]), (1e-6, True, [3])])
def test_the_loop_goes_on_where_none_does_or_little_is_left(
    monkeypatch: pytest.MonkeyPatch, p: float, unknown_wins: bool, asked: list[int]
) -> None:
    loop = Loop(monkeypatch, p=p, unknown_wins=unknown_wins)
    loop.run()
    assert (loop.allowed, loop.asked) == ([module.FEW, Rules().most_effects], asked)


@pytest.mark.parametrize(("p", "accepted"), [(0.5, True), (1e-200, False)])
def test_a_loop_that_ended_is_not_gone_through_again(monkeypatch: pytest.MonkeyPatch, p: float, accepted: bool) -> None:
    loop = Loop(monkeypatch, p=p, accepted=accepted)
    loop.run()
    assert loop.allowed == [module.FEW]
