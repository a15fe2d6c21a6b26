"""The page of two cameras is what its script makes of the committed figures, and the figures are those of their rows."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from scripts import study_two_cameras
from scripts.study_two_cameras import ARRANGEMENTS, figures_of, one_sequence, page, recipe_of

DOCS = Path(__file__).resolve().parents[2] / "docs"


def committed() -> dict[str, dict[str, dict[str, object]]]:
    figures: dict[str, dict[str, dict[str, object]]] = json.loads((DOCS / "results" / "study_two_cameras.json").read_text(encoding="utf-8"))
    return figures


def test_the_page_is_that_of_the_figures() -> None:
    assert (DOCS / "studies" / "study_two_cameras.md").read_text(encoding="utf-8") == page(committed())


@pytest.mark.parametrize("name", ARRANGEMENTS)
def test_figures_are_those_of_the_rows(name: str) -> None:
    told = committed()["arrangements"][name]
    again = figures_of(told["each"])  # type: ignore[arg-type]
    assert {key: value for key, value in told.items() if key != "each"} == pytest.approx(again)


def test_what_was_asked_for() -> None:
    """Depth within 1.5 times the plane, half a frame found to a fiftieth, intervals that hold."""
    told = committed()["arrangements"]["90°, clock half a frame off"]
    assert told["ratio"] < 1.5  # type: ignore[operator]
    assert told["offset_largest_frames"] < 0.02  # type: ignore[operator]
    assert 0.92 <= told["v_held"] <= 0.98  # type: ignore[operator]
    assert 0.92 <= told["omega_held"] <= 0.98  # type: ignore[operator]


def test_arrangements_are_of_one_recipe() -> None:
    assert recipe_of("one camera", None, 1).further_hsv == ()
    assert recipe_of("30°", 5, 1).further_hsv[0].angle_deg == 30.0
    assert recipe_of("90°", None, 3).motion == recipe_of("10°", None, 3).motion


def test_one_sequence_is_made_and_scored(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recipe = recipe_of("90°, clock half a frame off", 31, 1)
    quick = replace(recipe, motion=replace(recipe.motion, frames=24), rig=replace(recipe.rig, drops=3))
    monkeypatch.setattr(study_two_cameras, "recipe_of", lambda *_: quick)
    product = tmp_path / "row.json"
    one_sequence({"arrangement": "", "seed": 31, "sequences": 1, "index": 0, "product": product})
    row = json.loads(product.read_text())
    assert row["status"] == "converged"
    assert abs(row["offset_error_frames"]) < 0.05
    assert figures_of([row])["sequences"] == 1
