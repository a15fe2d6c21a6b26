import re
import typing
from dataclasses import fields, is_dataclass, replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from datasets.errors import InputError
from datasets.recipes.checks import BOUNDS, check_recipe, value_of
from datasets.recipes.recipe import MotionRecipe, NoiseRecipe, PairRecipe, ParticleRecipe, PlateRecipe, Recipe
from datasets.recipes.toml_files import load_recipe, recipe_from_dict, recipe_to_dict, recipe_to_toml


def test_no_file_is_the_defaults():
    assert load_recipe(None) == Recipe()


def test_a_file_and_overrides(tmp_path):
    path = tmp_path / "r.toml"
    path.write_text('name = "x"\n[motion]\nframes = 30\nspeed_ms = [1, 2]\n[particle]\nfiles = ["a.ply"]\n')
    recipe = load_recipe(path, ["motion.frames=40", "hsv.light=front", "motion.out_of_plane_ms=[0, 0.5]", "particle.repair=true"])
    assert recipe.name == "x"
    assert recipe.motion == MotionRecipe(frames=40, speed_ms=(1.0, 2.0), out_of_plane_ms=(0.0, 0.5))
    assert recipe.hsv.light == "front"
    assert recipe.particle == ParticleRecipe(files=("a.ply",), repair=True)
    assert load_recipe(path, ["motion.out_of_plane_ms=[0, 0.5]", "motion.out_of_plane_ms=none"]).motion.out_of_plane_ms is None


@settings(max_examples=50, deadline=None)
@given(
    name=st.text(min_size=1).filter(str.strip),
    frames=st.integers(3, 10**6),
    speeds=st.tuples(st.floats(0, 150), st.floats(0, 150)).map(sorted),
    noise=st.floats(0, 100),
    files=st.lists(st.text(), max_size=3),
    out_of_plane=st.none() | st.just((0.0, 0.0)),
)
def test_any_recipe_round_trips(name, frames, speeds, noise, files, out_of_plane, tmp_path_factory):
    recipe = replace(
        Recipe(name=name),
        motion=MotionRecipe(frames=frames, speed_ms=tuple(speeds), out_of_plane_ms=out_of_plane),
        noise=NoiseRecipe(hsv_boundary_px=noise),
        particle=ParticleRecipe(files=tuple(files)),
    )
    path = tmp_path_factory.mktemp("r") / "r.toml"
    path.write_text(recipe_to_toml(recipe), encoding="utf-8", newline="\n")
    assert load_recipe(path) == recipe
    assert recipe_from_dict(recipe_to_dict(recipe), "dataset.json") == recipe


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("motion.frmes=3", 'unknown key "frmes"; did you mean "frames"?'),
        ("zzz=3", 'unknown key "zzz"; known here: name, seed,'),
        ("motion.frames=2", "motion.frames: expected a value from 3 to 1e+06, got 2; a motion needs at least three frames"),
        ("motion.frames=2.5", "frames: expected an integer, got 2.5"),
        ("motion.frames=true", "frames: expected an integer, got true"),
        ("motion.frames", "expected key=value"),
        ("motion.frames.x=1", "frames is a value and has no part x"),
        ("motion=3", "motion: expected a table, got 3"),
        ("hsv.light=side", 'light: expected one of "back", "front", got "side"'),
        ("sensor.bit_depth=9", "bit_depth: expected one of 8, 10, 12, got 9"),
        ("hsv.focal_mm=long", 'focal_mm: expected a number, got "long"'),
        ("hsv.focal_mm=nan", "hsv.focal_mm: expected a value from 0.5 to 10000, got nan"),
        ("particle.repair=1", "repair: expected true or false, got 1"),
        ("particle.size_mm=[4]", "size_mm: expected a list of 2, got [4]"),
        ("particle.size_mm=4", "size_mm: expected a list, got 4"),
        ("particle.size_mm=[4000, 8000]", "got 4000; it looks like micrometres taken for millimetres"),
        ("particle.size_mm=[0, 0]", "expected positive sizes"),
        ("motion.speed_ms=[3, 1]", "motion.speed_ms: expected [lowest, highest], got [3, 1]"),
        ("motion.gravity_ms2=[0, 9806.65, 0]", "it looks like millimetres taken for metres"),
        ("hsv.exposure_us=300", "hsv.exposure_us: expected at most 250 (the time between two frames at 4000 Hz), got 300"),
        ("hsv.distance_m=600", "hsv.distance_m: expected a value from 0.01 to 50, got 600; it looks like millimetres taken for metres"),
        ("hsv.focal_mm=900", "expected more than the focal length (0.9 m), got 0.6"),
        ("motion.out_of_plane_ms=[5, 6]", "expected at most the highest speed (4 m/s)"),
        ("sensor.dark_offset_dn=5000", "sensor.dark_offset_dn: expected at most 2048 (half of full scale at 12 bit), got 5000"),
        ("hsv.distortion=[-100, 0, 0, 0, 0]", "hsv.distortion: expected one that can be undone all over the picture"),
        ("sequences=0", "sequences: expected a value from 1"),
        ('name="  "', "name: expected some text"),
    ],
)
def test_bad_overrides(override, message):
    with pytest.raises(InputError, match=re.escape(message)):
        load_recipe(None, [override])


def test_bad_files(tmp_path):
    path = tmp_path / "r.toml"
    with pytest.raises(InputError, match=r"r\.toml: there is no such file"):
        load_recipe(path)
    path.write_text("a = = 3")
    with pytest.raises(InputError, match=r"r\.toml: expected TOML \(.*line 1"):
        load_recipe(path)
    path.write_text("[hsv]\nfocal_mn = 3\n")
    with pytest.raises(InputError, match=r'r\.toml: unknown key "hsv\.focal_mn"; did you mean "hsv\.focal_mm"'):
        load_recipe(path)


def test_every_number_of_a_recipe_has_bounds():
    bounded = {bounds.key for bounds in BOUNDS}
    numbers = set()
    whole = Recipe(plate=PlateRecipe(), pair=PairRecipe())
    for field in fields(Recipe):
        value = getattr(whole, field.name)
        parts = fields(value) if is_dataclass(value) else ()
        hints = typing.get_type_hints(type(value)) if is_dataclass(value) else {}
        numbers |= {f"{field.name}.{part.name}" for part in parts if "float" in str(hints[part.name]) or hints[part.name] is int}
    assert numbers <= bounded
    assert all(value_of(whole, key) is not None or key == "motion.out_of_plane_ms" for key in bounded)


def test_a_files_own_size_may_be_kept():
    check_recipe(replace(Recipe(), particle=ParticleRecipe(files=("a.ply",), size_mm=(0.0, 0.0))), "recipe")
