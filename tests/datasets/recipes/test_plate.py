"""Recipes with a plate: read strictly, written back, and left out of recipes without one."""

import re
from pathlib import Path

import pytest

from datasets.errors import InputError
from datasets.recipes.effects import hidden_in_contact
from datasets.recipes.recipe import EffectRecipe, PlateRecipe, Recipe
from datasets.recipes.toml_files import load_recipe, recipe_from_dict, recipe_to_dict, recipe_to_toml

TEXT = """
sequences = 6
[plate]
tilt_deg = [5, 15]
stated = false
[dropper]
runs = 3
[contact]
restitution = 0.8
[[contact_physics]]
key = "adhesion"
values = {pull_off = 0.2, reach = 1e-5}
"""


def test_round_trip(tmp_path) -> None:
    path = tmp_path / "r.toml"
    path.write_text(TEXT)
    recipe = load_recipe(path, ["plate.elevation_deg=1.5"])
    assert recipe.plate == PlateRecipe(tilt_deg=(5.0, 15.0), stated=False, elevation_deg=1.5)
    assert recipe.contact_physics == (EffectRecipe("adhesion", {"pull_off": 0.2, "reach": 1e-5}),)
    path.write_text(recipe_to_toml(recipe))
    assert load_recipe(path) == recipe
    assert recipe_from_dict(recipe_to_dict(recipe), "dataset.json") == recipe


def test_the_example_of_the_documentation() -> None:
    recipe = load_recipe(Path(__file__).parents[3] / "docs" / "tutorial_files" / "impacts.toml")
    assert recipe.plate is not None
    assert (recipe.sequences, recipe.dropper.runs) == (6, 3)


def test_a_recipe_without_a_plate_is_written_as_ever() -> None:
    assert not {"plate", "dropper", "contact", "contact_physics"} & set(recipe_to_dict(Recipe()))
    assert load_recipe(None, ["plate.stated=false"]).plate == PlateRecipe(stated=False)


def test_physics_of_no_size_is_none() -> None:
    assert hidden_in_contact((EffectRecipe("chip", {"depth": 0.0}), EffectRecipe("adhesion", {"reach": 1e-5}))) == {}
    assert hidden_in_contact((EffectRecipe("chip", {"depth": 0.1}),)) == {"chip": {"depth": 0.1}}


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["contact.restitution=1.1"], "contact.restitution: expected a value from 0.05 to 1, got 1.1; no contact gives back more"),
        (["contact.friction=-0.1"], "contact.friction: expected a value from 0 to 2, got -0.1"),
        (["contact.youngs_gpa=70e9"], "contact.youngs_gpa: expected a value from 0.001 to 2000, got 7e+10; gigapascals are meant"),
        (["contact.poisson=0.6"], "contact.poisson: expected a value from -0.99 to 0.5, got 0.6"),
        (["plate.tilt_deg=[20, 10]"], "plate.tilt_deg: expected [lowest, highest], got [20, 10]"),
        (["plate.tilt_deg=[0, 95]"], "plate.tilt_deg: expected a value from 0 to 80, got 95"),
        (["plate.tlt_deg=3"], 'unknown key "tlt_deg"; did you mean "tilt_deg"?'),
        (["dropper.runs=0"], "dropper.runs: expected a value from 1"),
        (["dropper.frames_before=[40.5, 60]"], "frames_before[0]: expected an integer, got 40.5"),
        (["dropper.frames_before=[60, 40]"], "dropper.frames_before: expected [lowest, highest], got [60, 40]"),
        (["dropper.height_mm=[5, 10]"], "dropper.frames_before: expected at most 57 frames, as long as the shortest fall"),
        (['tier="rendered"', "plate.velocity_ms=[0, 0.1, 0]"], 'tier: expected "silhouette" for a plate that moves and for effects'),
        (['tier="rendered"', 'effects=[{key = "outline_offset", values = {offset = 1}}]'], 'tier: expected "silhouette" for a plate that'),
        (["motion.gravity_ms2=[0, 0, 9.8]"], "motion.gravity_ms2: expected gravity across the viewing direction, got [0.0, 0.0, 9.8]"),
        (['contact_physics=[{key = "adhesive"}]'], 'contact_physics[0].key: unknown effect "adhesive"; did you mean adhesion'),
        (['contact_physics=[{key = "adhesion", values = {pull_off = 1}}]'], "contact_physics[0] (adhesion): expected a value for reach"),
        (['contact_physics=[{key = "chip", values = {depth = -0.1}}]'], "(chip): depth: expected no negative number, got -0.1"),
        (['contact_physics=[{key = "chip", values = {depth = [0.1]}}]'], "depth: expected one number, since all sequences share it"),
        (["plate=none"], "plate: expected the table of a plate, since dropper, contact, contact_physics need one, got none"),
    ],
)
def test_bad_values(tmp_path, overrides: list[str], message: str) -> None:
    path = tmp_path / "r.toml"
    path.write_text(TEXT)
    with pytest.raises(InputError, match=re.escape(message)):
        load_recipe(path, overrides)
