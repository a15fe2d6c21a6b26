"""A plate in an observation: written and read back, left out where there is none, refused where it cannot be true."""

import json
from dataclasses import replace

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.observation_files import read_observation, write_observation
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.plate import Plate

PLATE = Plate(np.array([0.01, 0.02, 0.6]), np.array([0.6, -0.8, 0.0]), np.array([0.0, 0.1, 0.0]), 0.002, 1e-5)
EDGE = Outline(np.array([[0.0, 40.0], [63.0, 40.0], [63.0, 47.0], [0.0, 47.0]]))


@pytest.fixture(name="folder")
def written(outline_observation, tmp_path):
    write_observation(replace(outline_observation, plate=PLATE, plate_outlines=(EDGE,)), tmp_path / "o")
    return tmp_path / "o"


def edited(folder, **changes) -> None:
    path = folder / "observation.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    document["plate"] |= changes
    del document["sha256"]
    path.write_text(json.dumps(document), encoding="utf-8")


def test_round_trip(folder) -> None:
    again = read_observation(folder)
    assert again.plate is not None
    for name, value in vars(PLATE).items():
        assert np.array_equal(value, getattr(again.plate, name)), name
    assert again.plate_outlines[0] is not None
    assert np.array_equal(again.plate_outlines[0].points_px, EDGE.points_px)


def test_without_a_plate_nothing_is_said_of_one(outline_observation, tmp_path) -> None:
    write_observation(outline_observation, tmp_path / "o")
    assert "plate" not in (tmp_path / "o" / "observation.json").read_text(encoding="utf-8")
    again = read_observation(tmp_path / "o")
    assert (again.plate, again.plate_outlines) == (None, ())


def test_a_plate_that_stands_still_need_not_say_so(folder) -> None:
    path = folder / "observation.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    document["plate"] = {name: document["plate"][name] for name in ("point_world", "normal_world")}
    del document["sha256"]
    path.write_text(json.dumps(document), encoding="utf-8")
    plate = read_observation(folder).plate
    assert plate is not None
    assert np.array_equal(plate.velocity_world, np.zeros(3))
    assert (plate.normal_sigma_rad, plate.offset_sigma_m) == (0.0, 0.0)


def test_height_above_a_moving_plate() -> None:
    np.testing.assert_allclose(PLATE.height_m(PLATE.point_world + 0.3 * PLATE.normal_world, 0.5), 0.3 + 0.8 * 0.1 * 0.5)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"normal_world": [0, -2, 0]}, r"at \$\.plate\.normal_world: expected a vector of length 1, got one of length 2"),
        ({"point_world": [10, 20, 600]}, r"at \$\.plate\.point_world: expected metres \(at most 50\), got 600"),
        ({"velocity_world": [0, 500, 0]}, r"at \$\.plate\.velocity_world: expected m/s \(at most 100\), got 500"),
        ({"normal_sigma_rad": -1}, r"at \$\.plate\.normal_sigma_rad: expected a number >= 0, got -1"),
        ({"normal": [0, -1, 0]}, r'at \$\.plate: expected one of the keys .*got "normal"'),
        ({"point_world": [0, 0]}, r"at \$\.plate\.point_world: expected at least 3 entries, got 2"),
    ],
)
def test_plates_that_cannot_be_true(folder, changes, message) -> None:
    edited(folder, **changes)
    with pytest.raises(InputError, match=message):
        read_observation(folder)
