"""Campaigns that cannot be made as they were drawn."""

from pathlib import Path
from typing import Any

import pytest

from datasets.recipes.recipe import Recipe
from tumble.challenge import making
from tumble.challenge.cases import Case, case_folder, read_cases


def item(out: Path) -> dict[str, Any]:
    return making.payload_of(Case("c001", "control", Recipe(seed=5, sequences=1), 12, {}), out)


@pytest.mark.parametrize("error", [ArithmeticError("the flight could not be integrated"), ValueError("the picture has no closed curve")])
def test_another_particle_and_other_flights_are_tried(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception) -> None:
    seeds: list[int] = []

    def fails_once(case: Case, _folder: Path) -> list[Any]:
        seeds.append(case.recipe.seed)
        if len(seeds) == 1:
            raise error
        return []

    monkeypatch.setattr(making, "build_in", fails_once)
    making.make_item(item(tmp_path))
    assert len(set(seeds)) == 2
    (made,) = read_cases(tmp_path)
    assert made.recipe.seed == seeds[1]


def test_what_cannot_be_made_at_all_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(_case: Case, _folder: Path) -> list[Any]:
        raise ArithmeticError("the flight could not be integrated")

    monkeypatch.setattr(making, "build_in", fails)
    with pytest.raises(ArithmeticError, match="could not be integrated"):
        making.make_item(item(tmp_path))
    assert not case_folder(tmp_path, "c001").exists()
