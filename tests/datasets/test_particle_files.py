"""A particle file: what is written is read again to the last bit; what is damaged is refused by name."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.made_files import MADE_FILE, PARTICLE_FILE
from datasets.observation import CalibratedView, Observation
from datasets.observation_files import read_observation, write_observation
from datasets.particle_files import ParticleFile, is_particle, read_particle, with_particle, write_particle
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from tests.datasets.conftest import square_outline

CAMERA = Intrinsics(64, 48, 100.0, 100.0, 31.5, 23.5)
VIEWS = tuple(CalibratedView(CAMERA, np.eye(3), np.array([0.0, 0.0, 0.1 + 0.01 * k]), drop=k) for k in range(3))
PARTICLE = ParticleFile(
    "stone", VIEWS, (square_outline(30.0, 20.0),) * 3, 1e-3, {"settled": True, "mean_square": float("inf")}, notes=("a note",)
)
ARRAYS = {"hollow": np.array([0.1]), "hull_faces": np.arange(6).reshape(2, 3)}


def test_what_is_written_is_read(tmp_path: Path) -> None:
    write_particle(PARTICLE, tmp_path / "stone", ("ab" * 32, ARRAYS))
    read = read_particle(tmp_path / "stone")
    assert is_particle(tmp_path / "stone")
    assert (read.name, read.mass_kg, read.merging, read.notes) == (PARTICLE.name, 1e-3, PARTICLE.merging, PARTICLE.notes)
    assert [v.drop for v in read.views] == [0, 1, 2]
    np.testing.assert_array_equal(read.outlines[1].points_px, square_outline(30.0, 20.0).points_px)
    assert read.made is not None
    assert read.made.load("cd" * 32) is None
    arrays = read.made.load("ab" * 32)
    assert arrays is not None
    np.testing.assert_array_equal(arrays["hull_faces"], ARRAYS["hull_faces"])


def test_arrays_that_were_changed_are_refused(tmp_path: Path) -> None:
    write_particle(PARTICLE, tmp_path, ("ab" * 32, ARRAYS))
    (tmp_path / MADE_FILE).write_bytes((tmp_path / MADE_FILE).read_bytes() + b" ")
    made = read_particle(tmp_path).made
    assert made is not None
    with pytest.raises(InputError, match="run tumble shape again"):
        made.load("ab" * 32)


def test_arrays_that_have_gone_are_made_again(tmp_path: Path) -> None:
    write_particle(PARTICLE, tmp_path, ("ab" * 32, ARRAYS))
    (tmp_path / MADE_FILE).unlink()
    made = read_particle(tmp_path).made
    assert made is not None
    assert made.load("ab" * 32) is None


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("views", {"recording": {"kind": "frames", "file": "v.tif"}, "cameras": []}, "at \\$.views.recording.kind"),
        ("made", {"of": "x", "sha256": "y", "names": []}, "at \\$.made.of"),
        ("name", "../stone", "at \\$.name"),
    ],
)
def test_other_documents_are_refused(tmp_path: Path, key: str, value: object, said: str) -> None:
    write_particle(PARTICLE, tmp_path)
    document = {k: v for k, v in json.loads((tmp_path / PARTICLE_FILE).read_text()).items() if k != "sha256"}
    (tmp_path / PARTICLE_FILE).write_text(json.dumps({**document, key: value}))
    with pytest.raises(InputError, match=said):
        read_particle(tmp_path)


def test_an_observation_names_its_particle(tmp_path: Path) -> None:
    write_particle(PARTICLE, tmp_path / "stone", ("ab" * 32, ARRAYS))
    camera = HsvCamera("hsv", CAMERA, np.eye(3), np.zeros(3))
    bare = Observation("one", (camera,), ((square_outline(30.0, 20.0),) * 2,), Clock(np.array([0.0, 1e-3]), 1e-5), np.zeros(3), (), ())
    named = with_particle(bare, read_particle(tmp_path / "stone"))
    write_observation(named, tmp_path / "run" / "one")
    assert '"particle": "../../stone"' in (tmp_path / "run" / "one" / "observation.json").read_text()
    read = read_observation(tmp_path / "run" / "one")
    assert read.mass_kg == PARTICLE.mass_kg
    assert read.made is not None
    assert read.made.load("ab" * 32) is not None
    (tmp_path / "stone" / PARTICLE_FILE).unlink()
    assert read_observation(tmp_path / "run" / "one").made is None
    write_observation(replace(bare, name="two"), tmp_path / "run" / "two")
    assert "particle" not in json.loads((tmp_path / "run" / "two" / "observation.json").read_text())
