"""Registrations are kept once and taken again only for the same files and configuration."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from datasets.dataset_files import observation_folder
from datasets.observation_files import write_observation
from estimator.fitting.campaigns.registered import Registered
from tests.estimator.small_campaign import observations, registered
from tumble.challenge import registering
from tumble.challenge.registering import registered_campaign


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    for observation in observations():
        write_observation(observation, observation_folder(tmp_path / "c001", observation.name))
    return tmp_path / "c001"


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What was registered anew."""
    calls: list[Any] = []

    def register(seen: Any, _configuration: Any) -> Registered:
        calls.append(seen)
        return registered()

    monkeypatch.setattr(registering, "register", register)
    return calls


def test_a_kept_registration_is_taken_again(campaign: Path, made: list[Any], tmp_path: Path) -> None:
    first, second = (registered_campaign(campaign, {}, tmp_path / "kept") for _ in range(2))
    assert len(made) == 1
    assert [each.x.tolist() for each in second.start.flights] == [each.x.tolist() for each in first.start.flights]


def test_other_files_another_configuration_and_broken_files_are_registered_anew(campaign: Path, made: list[Any], tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    registered_campaign(campaign, {}, kept)
    registered_campaign(campaign, {"seed": 3}, kept)
    shutil.rmtree(sorted((campaign / "observations").iterdir())[1])
    registered_campaign(campaign, {"seed": 3}, kept)
    (file,) = kept.iterdir()
    file.write_bytes(b"broken")
    registered_campaign(campaign, {"seed": 3}, kept)
    assert [len(each) for each in made] == [2, 2, 1, 1]


def test_nothing_is_kept_where_no_folder_is_given(campaign: Path, made: list[Any], tmp_path: Path) -> None:
    registered_campaign(campaign, {})
    assert len(made) == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["c001"]
