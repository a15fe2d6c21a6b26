"""What ``tumble explain`` says of drops: flights in use, and of the contact."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from datasets.estimate import Status
from datasets.estimate_files import write_estimate
from datasets.observation import Observation
from datasets.truth import Truth
from estimator.fitting.campaigns.campaign import Campaign
from synth.sequence import build_silhouette_sequence
from tests.estimator.test_measure import RECIPE
from tests.tumble.test_validate_contact import estimate_of
from tumble.diagnosis_documents import drop_entries
from tumble.explained_drops import contact_judged
from tumble.reports.drop_words import drops_sentence
from tumble.result_files import estimate_path


def test_flights_in_use_are_told_by_recording() -> None:
    nothing: Any = None
    flights = tuple(SimpleNamespace(name=f"f{k}", number=number) for k, number in enumerate((1, 3, 0, 1, 2)))
    campaign = Campaign(flights, (0,) * 5, (0,) * 5, 0.0, 0.0, nothing, recording=("a", "a", "b", "c", "c"))
    drops = drop_entries(campaign)
    assert drops == [{"recording": "a", "flights": [1, 3]}, {"recording": "c", "flights": [1, 2]}]
    assert "2 recordings have impacts: 4 flights" in drops_sentence(drops)
    assert "a: 1, 3; c: 1, 2" in drops_sentence(drops)
    assert drop_entries(replace(campaign, recording=())) == []


def test_many_recordings_are_not_all_named() -> None:
    said = drops_sentence([{"recording": f"r{k}", "flights": [1, 2]} for k in range(9)])
    assert "r5" in said
    assert "r6" not in said
    assert "and 3 more" in said


@pytest.fixture(scope="module")
def drop() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(RECIPE, 0)


def test_too_few_impacts_say_nothing_of_the_contact(tmp_path: Path, drop: tuple[Observation, Truth]) -> None:
    observation, truth = drop
    write_estimate(replace(estimate_of(observation, truth, 1), name="a"), estimate_path(tmp_path, "a"))
    failed = replace(estimate_of(observation, truth, 2), name="b", status=Status.NO_CONVERGENCE, message="it ran away", impacts=())
    write_estimate(failed, estimate_path(tmp_path, "b"))
    drops, said = [{"recording": name, "flights": [1, 2]} for name in ("a", "b")], []
    judged = contact_judged(tmp_path, drops, {name: replace(observation, name=name) for name in ("a", "b")}, said.append)
    assert "impacts of 1 recordings can be used, at least 4 are needed (no convergence: it ran away)" in judged.sentence
    assert judged.missing == ()
    assert judged.more is None
    assert said == []
