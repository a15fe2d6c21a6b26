"""Effects in recipes: strict, checked against the catalogue, and written back as they were read."""

import re

import pytest

from datasets.errors import InputError
from datasets.recipes.effects import KNOWN, values_in_sequence
from datasets.recipes.recipe import EffectRecipe
from datasets.recipes.toml_files import load_recipe, recipe_from_dict, recipe_to_dict, recipe_to_toml
from datasets.vocabulary.effects import EFFECTS

TEXT = """
sequences = 2
same_particle = true
[[effects]]
key = "quadratic_drag"
values = {per_length = 1.2}
[[effects]]
key = "uniform_acceleration"
values = {a_x = [1, 2.5], a_z = -1}
[[effects]]
key = "camera_vibration"
values = {sine_x = 0.5, frequency = 300}
"""


@pytest.fixture(name="path")
def recipe_file(tmp_path):
    path = tmp_path / "r.toml"
    path.write_text(TEXT)
    return path


def test_effects_are_read_and_written_back(path, tmp_path) -> None:
    recipe = load_recipe(path)
    assert recipe.same_particle
    assert recipe.effects == (
        EffectRecipe("quadratic_drag", {"per_length": 1.2}),
        EffectRecipe("uniform_acceleration", {"a_x": (1.0, 2.5), "a_z": -1.0}),
        EffectRecipe("camera_vibration", {"sine_x": 0.5, "frequency": 300.0}),
    )
    again = tmp_path / "again.toml"
    again.write_text(recipe_to_toml(recipe))
    assert load_recipe(again) == recipe
    assert recipe_from_dict(recipe_to_dict(recipe), "dataset.json") == recipe


def test_an_override_sets_all_effects(path) -> None:
    recipe = load_recipe(path, ['effects=[{key = "gravity", values = {dg_y = 0.1}}]'])
    assert recipe.effects == (EffectRecipe("gravity", {"dg_y": 0.1}),)
    assert load_recipe(path, ["effects=[]"]).effects == ()


def test_values_of_each_sequence(path) -> None:
    effect = load_recipe(path).effects[1]
    assert [values_in_sequence(effect, k) for k in range(2)] == [{"a_x": x, "a_y": 0.0, "a_z": -1.0} for x in (1.0, 2.5)]
    with pytest.raises(InputError, match="expected a number for sequence 2, got 2 numbers"):
        values_in_sequence(effect, 2)


def test_every_effect_has_a_size() -> None:
    assert all(entry.sizes for entry in KNOWN.values())
    assert EFFECTS["camera_vibration"].sizes == ("sine_x", "sine_y", "cosine_x", "cosine_y")
    assert EFFECTS["trigger_jitter"].sizes == ("sigma",)


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ('[{key = "quadratic_drg"}]', 'effects[0].key: unknown effect "quadratic_drg"; did you mean quadratic_drag'),
        ('[{key = "zzz"}]', 'unknown effect "zzz"; known: frame_rate, dropped_frames,'),
        ('[{key = "gravity"}, {key = "gravity"}]', 'effects[1].key: "gravity" is there twice; expected each effect once'),
        ('[{key = "gravity", values = {dg = 1}}]', 'effects[0] (gravity): unknown parameter "dg"; did you mean dg_'),
        ('[{key = "camera_vibration", values = {sine_x = 1}}]', "(camera_vibration): expected a value for frequency, got sine_x"),
        ('[{key = "wall_attraction"}]', "expected a value for normal_x, normal_y, normal_z, position, got none"),
        ('[{key = "gravity", values = {dg_x = [1, 2]}}]', "dg_x: expected one number, since all sequences share it (scope campaign)"),
        (
            '[{key = "uniform_acceleration", values = {a_x = [1]}}]',
            "a_x: expected a number or a list of 2, one per sequence, got a list of 1",
        ),
        ('[{key = "gravity", values = {dg_x = inf}}]', "dg_x: expected a finite number, got inf"),
        ('[{key = "gravity", values = {dg_x = "a"}}]', 'effects[0].values.dg_x: expected a number, got "a"'),
        ('[{key = "gravity", values = 3}]', "effects[0].values: expected a table, got 3"),
        ('[{kye = "gravity"}]', 'unknown key "effects[0].kye"; did you mean "effects[0].key"?'),
        ('"gravity"', 'effects: expected a list, got "gravity"'),
    ],
)
def test_bad_effects(path, effects: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)):
        load_recipe(path, [f"effects={effects}"])


def test_an_effect_without_a_key(path) -> None:
    with pytest.raises(InputError, match=r"effects\[0\]: expected a value for key"):
        load_recipe(path, ["effects=[{values = {dg_x = 1}}]"])
