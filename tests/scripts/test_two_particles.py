"""The page of two particles is what its script makes of the committed figures."""

import json
from pathlib import Path

from scripts.acceptance.two_particles import RECIPE, page, recipe_of

DOCS = Path(__file__).resolve().parents[2] / "docs"


def test_the_page_is_that_of_the_figures() -> None:
    figures = json.loads((DOCS / "results" / "two_particles.json").read_text(encoding="utf-8"))
    assert (DOCS / "studies" / "two_particles.md").read_text(encoding="utf-8") == page(figures)
    assert figures["pairs"] == len(figures["each"]) == 6
    assert figures["seed"] == recipe_of(None, 6).seed


def test_a_pair_that_was_not_found_has_a_row() -> None:
    figures = json.loads((DOCS / "results" / "two_particles.json").read_text(encoding="utf-8"))
    lost = {"sequence": "lost", "found": False, "status": "ambiguous", "merged": 3, "frames": 90}
    text = page({**figures, "each": [lost]})
    assert "| lost | 3 of 90 | ambiguous | | | | | |" in text


def test_other_seeds_and_numbers() -> None:
    assert RECIPE.name == "two_particles.toml"
    recipe = recipe_of(5, 3)
    assert (recipe.seed, recipe.sequences) == (5, 3)
