"""Numbers, keys and names that no document may hold, each refused with its place."""

import json
from pathlib import Path

import pytest

from datasets.errors import InputError
from datasets.observation_files import read_observation, write_observation
from datasets.recipes.toml_files import load_recipe
from datasets.trajectory_files import read_trajectory

FINITE = "expected a finite number, got Infinity or a number beyond 1.8e308"
HALF = "half a surrogate pair"


@pytest.fixture
def folder(outline_observation, tmp_path) -> Path:
    write_observation(outline_observation, tmp_path / "o")
    return tmp_path / "o"


def refused(folder: Path, before: str, after: str, message: str) -> None:
    """Replace text of observation.json and see it refused."""
    path = folder / "observation.json"
    document = json.loads(path.read_text())
    del document["sha256"]
    text = json.dumps(document)
    assert before in text
    path.write_text(text.replace(before, after, 1))
    with pytest.raises(InputError) as caught:
        read_observation(folder)
    assert str(caught.value).startswith(f"{path}: {message}"), caught.value


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('"mass_kg": 0.0003', '"mass_kg": 1e400', f"at $.mass_kg: {FINITE}"),
        ('"mass_kg": 0.0003', '"mass_kg": ' + "1" * 400, f"at $.mass_kg: {FINITE}"),
        ('"mass_kg": 0.0003', '"mass_kg": ' + "1" * 9000, f"at $.mass_kg: {FINITE}"),
        ('"mass_kg": 0.0003', '"mass_kg": 9223372036854775808', "at $.mass_kg: expected an integer of at most 64 bit"),
        ('"mass_kg": 0.0003', '"mass_kg": NaN', "at $.mass_kg: expected a finite number, got NaN"),
        ('"mass_kg": 0.0003', '"mass_kg": -Infinity', f"at $.mass_kg: {FINITE}"),
        ('"mass_kg": 0.0003', '"mass_kg": 1, "mass_kg": 0.0003', "at $.mass_kg: expected the key once, got twice"),
        ('"mass_kg": 0.0003', '"mass_kg": ' + "[" * 100 + "]" * 100, "at $.mass_kg"),
        ('"mass_kg": 0.0003', '"mass_kg": ' + "[" * 9000 + "]" * 9000, "not a file of this project (nested too deeply)"),
        ('"seq_0000"', '"seq_0000\\n"', "at $.name: expected text of the form"),
        ('"seq_0000"', '"\\ud800"', f"at $.name: expected text in Unicode, got {HALF}"),
        ('"mass_kg": 0.0003', '"\\ud800": 0.0003', f"at $: expected keys in Unicode, got one with {HALF}"),
        ('"width_px": 64', '"width_px": 64.0', "at $.cameras[0].intrinsics.width_px: expected an integer, got 64.0"),
        ('"width_px": 64', '"width_px": 1000000000000000', "at $.cameras[0].intrinsics.width_px: expected a number <= 65536"),
        ('"outlines_hsv.npz"', '".."', "at $.cameras[0].recording.file: expected"),
        ('"outlines_hsv.npz"', '"a\\u0000b"', "at $.cameras[0].recording.file: expected"),
    ],
)
def test_json(folder, before, after, message):
    refused(folder, before, after, message)


def test_a_picture_of_too_many_pixels(folder):
    path = folder / "observation.json"
    document = json.loads(path.read_text())
    del document["sha256"]
    document["cameras"][0]["intrinsics"] |= {"width_px": 60_000, "height_px": 60_000}
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r"cameras\[0\]\.intrinsics: expected a picture of at most 1e\+08 px, got 60000 x 60000 px"):
        read_observation(folder)


def test_cameras_of_one_name(folder):
    path = folder / "observation.json"
    document = json.loads(path.read_text())
    del document["sha256"]
    document["cameras"].append(document["cameras"][0])
    path.write_text(json.dumps(document))
    with pytest.raises(InputError, match=r'\$\.cameras\[1\]\.name: expected a name of its own, got "hsv"'):
        read_observation(folder)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seed = " + "1" * 400, "at seed: expected an integer of at most 64 bit"),
        ("seed = " + "1" * 9000, "expected TOML"),
        ("[motion]\nspeed_ms = [0.0, inf]", f"at motion.speed_ms[1]: {FINITE}"),
        ("[motion]\nspeed_ms = [0.0, 1e400]", f"at motion.speed_ms[1]: {FINITE}"),
        ("[particle]\nsize_mm = [nan, 1.0]", "at particle.size_mm[0]: expected a finite number, got NaN"),
        ("name = " + "[" * 100 + "]" * 100, "at name"),
        ("a = " + "[" * 9000 + "]" * 9000, "expected TOML, got tables nested too deeply"),
        ("seed = 1\nseed = 2", "expected TOML"),
    ],
)
def test_toml(tmp_path, text, message):
    path = tmp_path / "r.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        load_recipe(path)
    assert str(caught.value).startswith(f"{path}: {message}"), caught.value


def test_a_long_integer_on_the_command_line():
    with pytest.raises(InputError, match="distance_m: expected a number of at most 64 bit"):
        load_recipe(None, ["hsv.distance_m=" + "1" * 400])


@pytest.mark.parametrize("cell", ["1_0", "٣", "1 0", "0x1", "1e400"])
def test_cells_of_a_table(tmp_path, cell):
    path = tmp_path / "toss.csv"
    path.write_text("t_s,x_m,y_m,z_m\n" + "".join(f"{0.01 * k},0,{cell if k == 3 else 0},0\n" for k in range(6)), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_trajectory(path, {"gravity_world": (0.0, 0.0, -9.81)})
    assert str(caught.value).startswith(f"{path}: line 5: y_m: expected a")
