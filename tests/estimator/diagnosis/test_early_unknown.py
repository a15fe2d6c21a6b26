"""An unknown is looked for early where much is left after two steps, and only there."""

from types import SimpleNamespace
from typing import Any

import pytest
from estimator.diagnosis.refits import Rules

from estimator.diagnosis import explain as module
from estimator.diagnosis.explain import Reached, explain

NOTHING: Any = None
STAGE = SimpleNamespace(stage="optics")
HERE: Any = SimpleNamespace(kind=SimpleNamespace(base=SimpleNamespace(size=0)))
ELSEWHERE: Any = SimpleNamespace()


def fit_with(*keys: str) -> Any:
    return SimpleNamespace(model=SimpleNamespace(keys=keys), state=keys)


def step(key: str, *, accepted: bool = True) -> Any:
    return SimpleNamespace(added=key, accepted=accepted, fit=fit_with(key))


class Looking:
    """Looks that tell which campaign they were taken of."""

    def __init__(self, _catalogue: Any) -> None:
        pass

    def at(self, campaign: Any, _fit: Any) -> Any:
        return SimpleNamespace(catalogue=([campaign], NOTHING), families=NOTHING)


class Loop:
    """Replaces what ``explain`` calls; remembers how many effects each climb was allowed and where an unknown was asked for."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, p: float, accepted: bool = True, wins: bool = True) -> None:
        self.allowed: list[int] = []
        self.asked: list[int] = []
        self.settled = 0
        self.p, self.accepted, self.wins = p, accepted, wins
        for name, stub in {
            "following": lambda campaign, fit: (campaign, fit),
            "fit_campaign": lambda *_: fit_with(),
            "start_with": lambda *_: NOTHING,
            "held_out": lambda *_: NOTHING,
            "campaign_covariance": lambda *_: NOTHING,
            "outstanding": lambda *_: STAGE,
            "Looks": Looking,
            "_climbed": self.climbed,
            "_settled": self.settle,
            "better_unknown": self.better_unknown,
            "rank": lambda *_, **__: NOTHING,
            "penalty_of": lambda *_: 4.0,
        }.items():
            monkeypatch.setattr(module, name, stub)

    def climbed(self, at: Reached, _catalogue: Any, rules: Rules, _told: Any) -> Any:
        self.allowed.append(rules.most_effects)
        keys = ("gravity", "linear_drag", "magnus_lift")[: rules.most_effects]
        steps = tuple(step(key, accepted=self.accepted) for key in keys)
        p = self.p if rules.most_effects == module.FEW else 1.0
        return Reached(at.campaign, fit_with(*keys), steps, (), NOTHING), ([SimpleNamespace(p=p)], NOTHING)

    def settle(self, at: Reached, last: Any, *_: Any) -> Any:
        self.settled += 1
        return at, last

    def better_unknown(self, _campaign: Any, fits: Any, *_: Any, **__: Any) -> Any:
        self.asked.append(len(fits))
        found = SimpleNamespace(campaign=ELSEWHERE, unknown=STAGE, fit=fit_with("gravity"))
        return found if self.wins else None

    def run(self) -> Any:
        return explain(HERE, NOTHING, {}, Rules())


def test_an_unknown_that_is_better_ends_the_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    loop = Loop(monkeypatch, p=1e-200)
    found = loop.run()
    assert (loop.allowed, loop.asked, loop.settled) == ([module.FEW], [module.FEW], 0)
    assert (found.left, found.dropped, len(found.steps)) == (STAGE, ("linear_drag",), 2)
    assert (found.campaign, found.tests) == (ELSEWHERE, (ELSEWHERE,)), "all is told where the unknown was judged"


@pytest.mark.parametrize(("p", "wins", "asked"), [(1e-200, False, [2, 3]), (1e-6, True, [3])])
def test_the_loop_goes_on_where_none_is_better_or_little_is_left(
    monkeypatch: pytest.MonkeyPatch, p: float, wins: bool, asked: list[int]
) -> None:
    loop = Loop(monkeypatch, p=p, wins=wins)
    found = loop.run()
    assert (loop.allowed, loop.asked, loop.settled) == ([module.FEW, Rules().most_effects], asked, 1)
    assert (found.left, found.campaign) == (STAGE, ELSEWHERE if wins else HERE)


@pytest.mark.parametrize(("p", "accepted"), [(0.5, True), (1e-200, False)])
def test_a_loop_that_ended_is_not_gone_through_again(monkeypatch: pytest.MonkeyPatch, p: float, accepted: bool) -> None:
    loop = Loop(monkeypatch, p=p, accepted=accepted)
    loop.run()
    assert loop.allowed == [module.FEW]
