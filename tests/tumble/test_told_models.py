"""What is told beside the models of an explanation: effects in the place of something unknown, and values without one that is suspected."""

from collections.abc import Mapping
from types import SimpleNamespace as Stub
from typing import Any

import pytest

from estimator.effects.choosing import catalogue
from estimator.reports.campaign_reporting import EffectValue
from tumble import told_models
from tumble.reports.verdict import Verdict
from tumble.told_models import told_beside, without_suspected

FRAME_RATE = catalogue()["frame_rate"].entry.parameters[0]


def explanation(**changed: Any) -> Any:
    """Frame rate is established, linear drag beside it is suspected, and of the others gravity is not improbable."""
    findings = [Stub(key=key, probability=p) for key, p in (("gravity", 0.17), ("frame_rate", 0.9), ("pixel_aspect", 0.01))]
    path = (at("frame_rate"), at("frame_rate", "linear_drag"))
    steps = (step("frame_rate", established=True), step("linear_drag", established=False))
    given = {"left": Stub(present=True), "found": ("frame_rate",), "path": path, "steps": steps, "diagnosis": Stub(findings=findings)}
    return Stub(**given, fit=Stub(model=Stub(keys=("frame_rate", "linear_drag"))), **changed)


def at(*keys: str) -> Any:
    return Stub(keys=keys, members=(), trial=Stub(evidence=Stub(acting=list)))


def step(key: str, *, established: bool) -> Any:
    return Stub(added=key, established=established, group=(key,))


@pytest.fixture
def values(monkeypatch: pytest.MonkeyPatch) -> dict[tuple[str, ...], tuple[float, float]]:
    """Value and standard deviation of the frame rate by the effects in a model."""
    known: dict[tuple[str, ...], tuple[float, float]] = {}

    def fitted(at: Any, _campaign: Any) -> tuple[EffectValue, ...]:
        value, sigma = known[at.keys]
        return (EffectValue("frame_rate", FRAME_RATE, None, value, sigma),)

    monkeypatch.setattr(told_models, "_values", fitted)
    return known


@pytest.mark.parametrize(("alone", "told"), [((0.0102, 0.0007), True), ((0.0075, 0.0007), False)])
def test_a_value_that_rests_on_an_effect_that_is_not_established_is_told_without_it(
    values: dict[tuple[str, ...], tuple[float, float]], alone: tuple[float, float], told: bool
) -> None:
    values |= {("frame_rate",): alone, ("frame_rate", "linear_drag"): (0.0071, 0.0010)}
    said = list(without_suspected(explanation(), Stub()))
    assert len(said) == told
    if told:
        assert said[0].startswith("Without linear drag, which is not established, values would be others: frame rate relative ")


def test_what_may_be_in_the_place_of_something_unknown_is_told_first(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(told_models, "value_words", lambda finding: f"value of {finding.key}")
    verdict = Verdict("unknown", "Something is missing.", ("Another remark.",), ())
    assert told_beside(verdict, explanation()).remarks == (
        "In its place, or beside it, may be: gravity (17.0%; value of gravity).",
        "Another remark.",
    )


def test_nothing_is_told_in_the_place_of_nothing() -> None:
    verdict = Verdict("found", "Explained.", (), ())
    nothing: Mapping[str, Any] = vars(explanation()) | {"left": None}
    assert told_beside(verdict, Stub(**nothing)) is verdict  # type: ignore[arg-type]
