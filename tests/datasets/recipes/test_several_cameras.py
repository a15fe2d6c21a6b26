"""Recipes with several high-speed cameras: what is left out is as in [hsv], and what cannot be is refused by its place."""

from pathlib import Path

import pytest

from datasets.errors import InputError
from datasets.recipes.effects import of_one_camera
from datasets.recipes.recipe import Recipe
from datasets.recipes.several_cameras import filmed_by
from datasets.recipes.toml_files import load_recipe, recipe_to_dict, recipe_to_toml

TEXT = """
[hsv]
f_number = 11.0
[[further_hsv]]
focal_mm = 60.0
exposure_us = 20.0
hidden_offset_frames = [-0.5, 0.5]
offset_sigma_frames = 0.5
[[further_hsv]]
angle_deg = 45.0
around_deg = 90.0
"""


def loaded(folder: Path, text: str) -> Recipe:
    path = folder / "recipe.toml"
    path.write_text(text)
    return load_recipe(path)


def test_what_is_left_out_is_as_in_the_first_camera(tmp_path: Path) -> None:
    recipe = loaded(tmp_path, TEXT)
    first, second, third = (filmed_by(recipe, camera).hsv for camera in range(3))
    assert first == recipe.hsv == third
    assert (second.focal_mm, second.exposure_us, second.f_number) == (60.0, 20.0, 11.0)


def test_what_is_written_is_what_was_read(tmp_path: Path) -> None:
    recipe = loaded(tmp_path, TEXT)
    assert loaded(tmp_path, recipe_to_toml(recipe)) == recipe


def test_recipes_of_one_camera_are_written_as_ever() -> None:
    assert "further_hsv" not in recipe_to_dict(Recipe())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[[further_hsv]]\nangle_deg = 5.0", r"further_hsv\[0\]: angle_deg: expected a value from 10 to 170, got 5"),
        ("[[further_hsv]]\nfocal_mm = 700.0", r"further_hsv\[0\]: hsv.distance_m: expected more than the focal length"),
        ("[[further_hsv]]\nexposure_us = 300.0", r"further_hsv\[0\]: hsv.exposure_us: expected at most 250"),
        ("[[further_hsv]]\nhidden_rate = [1e-4, -1e-4]", r"further_hsv\[0\]: hidden_rate: expected \[lowest, highest\]"),
        ("[[further_hsv]]\n[plate]", "further_hsv: expected one camera for a plate"),
        ("[[further_hsv]]\n[pair]", "further_hsv: expected one camera for a pair"),
        (
            '[[further_hsv]]\n[[effects]]\nkey = "clock_offset"\nvalues = {offset = 1e-4}',
            r"effects\[0\] \(clock_offset\).camera: expected a number from 1, since it is of a further camera, got None",
        ),
        (
            '[[effects]]\nkey = "focal_length"\nvalues = {relative = 0.01}\ncamera = 1',
            r"effects\[0\] \(focal_length\).camera: expected a number from 0",
        ),
        (
            '[[further_hsv]]\n[[effects]]\nkey = "quadratic_drag"\nvalues = {per_length = 1.0}\ncamera = 1',
            r"\(quadratic_drag\).camera: expected none, since all cameras see",
        ),
    ],
)
def test_what_cannot_be(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        loaded(tmp_path, text)


def test_an_effect_may_be_that_of_one_camera(tmp_path: Path) -> None:
    text = "[[further_hsv]]\n" + "".join(
        f'[[effects]]\nkey = "focal_length"\nvalues = {{relative = {size}}}\ncamera = {camera}\n'
        for camera, size in enumerate((0.01, -0.02))
    )
    recipe = loaded(tmp_path, text)
    assert [effect.values["relative"] for effect in of_one_camera(recipe.effects, 1)] == [-0.02]
    with pytest.raises(InputError, match="is there twice"):
        loaded(tmp_path, text.replace("camera = 0", ""))
