import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from datasets.dataset_files import Dataset, observation_folder, read_dataset, truth_folder, write_dataset
from datasets.errors import InputError
from datasets.impact_entries import NUMBERS, TABLES, VECTORS
from datasets.mesh_files import write_mesh
from datasets.tiff_frames import TiffFrames, write_stack
from datasets.truth import Impact, MotionBound, Remnant, Truth
from datasets.truth_files import read_truth, write_truth
from datasets.vocabulary.plate import Plate


def assert_same(a: Truth, b: Truth) -> None:
    for name in ("name", "mass_kg", "descriptors", "effects", "notes"):
        assert getattr(a, name) == getattr(b, name)
    for name in ("inertia_kgm2", "mesh_vertices", "mesh_faces", "symmetries"):
        assert np.array_equal(getattr(a, name), getattr(b, name))
    for part in ("motion", "body"):
        for name, value in vars(getattr(a, part)).items():
            assert np.array_equal(value, getattr(getattr(b, part), name))


def test_round_trip_is_exact(truth, tmp_path):
    write_truth(truth, tmp_path / "t")
    assert_same(truth, read_truth(tmp_path / "t"))


def test_the_bound_round_trips(truth, tmp_path):
    covariance = np.cov(np.random.default_rng(2).normal(size=(6, 20)))
    write_truth(replace(truth, bound=MotionBound(0.0005, covariance)), tmp_path / "t")
    bound = read_truth(tmp_path / "t").bound
    assert bound is not None
    assert bound.time_s == 0.0005
    assert np.array_equal(bound.covariance, covariance)


@pytest.mark.parametrize("variance", [-1.0, 0.0])
def test_a_bound_that_is_none_is_refused(truth, tmp_path, variance):
    write_truth(replace(truth, bound=MotionBound(0.0, np.diag([1.0, 1.0, variance, 1.0, 1.0, 1.0]))), tmp_path / "t")
    with pytest.raises(InputError, match=r"truth\.json: at \$\.bound\.covariance: expected .*, got"):
        read_truth(tmp_path / "t")


def test_masks_round_trip(truth, tmp_path):
    pictures = [np.eye(4, dtype=np.uint16) * (k % 2) for k in range(5)]
    write_stack(tmp_path / "m.tif", pictures)
    write_truth(replace(truth, masks=TiffFrames(tmp_path / "m.tif", 1)), tmp_path / "t")
    masks = read_truth(tmp_path / "t").masks
    assert masks is not None
    assert all(np.array_equal(masks.read(k), pictures[k]) for k in range(5))


def test_the_mesh_opens_in_other_programs(truth, tmp_path):
    write_truth(truth, tmp_path / "t")
    assert trimesh.load_mesh(tmp_path / "t" / "mesh.ply").is_watertight


@pytest.mark.parametrize("keep", [0, 20, 150, 500, -3])
@pytest.mark.parametrize("name", ["mesh.ply", "motion.npz", "truth.json"])
def test_truncated_files_are_named(truth, tmp_path, name, keep):
    write_truth(truth, tmp_path / "t")
    path = tmp_path / "t" / name
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError) as caught:
        read_truth(tmp_path / "t")
    assert str(path) in str(caught.value)


@pytest.mark.parametrize("name", ["mesh.ply", "motion.npz", "truth.json"])
def test_missing_files_are_named(truth, tmp_path, name):
    write_truth(truth, tmp_path / "t")
    (tmp_path / "t" / name).unlink()
    with pytest.raises(InputError, match="there is no such file") as caught:
        read_truth(tmp_path / "t")
    assert name in str(caught.value)


def test_symmetries_have_to_be_rotations(truth, tmp_path):
    write_truth(replace(truth, symmetries=np.stack([np.eye(3), np.diag([1.0, 1.0, -1.0])])), tmp_path / "t")
    with pytest.raises(InputError, match=r"at \$\.symmetries\[1\]: expected a rotation"):
        read_truth(tmp_path / "t")


def test_quaternions_have_to_be_unit(truth, tmp_path):
    doubled = replace(truth.motion, q_world_body=truth.motion.q_world_body * 2)
    write_truth(replace(truth, motion=doubled), tmp_path / "t")
    with pytest.raises(InputError, match=r"motion\.npz: expected unit quaternions in q_world_body, got one of length 2"):
        read_truth(tmp_path / "t")


def test_dataset_round_trip_and_layout(tmp_path, truth, outline_observation):
    dataset = Dataset("demo", ("seq_0000", "seq_0001"), 7, {"motion": {"frames": 5}}, {"tumble": "0.1.0"}, "scalar_rgb")
    write_dataset(dataset, tmp_path)
    assert read_dataset(tmp_path) == dataset
    assert observation_folder(tmp_path, "seq_0000") == tmp_path / "observations" / "seq_0000"
    assert truth_folder(tmp_path, "seq_0000") == tmp_path / "truth" / "seq_0000"


def test_bad_datasets(tmp_path):
    with pytest.raises(InputError, match="expected the folder of a dataset, got nothing"):
        read_dataset(tmp_path / "none")
    write_dataset(Dataset("demo", ("a", "b"), 7), tmp_path)
    path = tmp_path / "dataset.json"
    document = json.loads(path.read_text())
    del document["sha256"]
    path.write_text(json.dumps({**document, "sequences": ["a", "../b"]}))
    with pytest.raises(InputError, match=r"at \$\.sequences\[1\]: expected text of the form"):
        read_dataset(tmp_path)


def test_an_observation_is_read_where_there_is_no_truth(tmp_path, truth, outline_observation):
    from datasets.observation_files import read_observation, write_observation

    write_observation(outline_observation, observation_folder(tmp_path, "seq_0000"))
    write_truth(truth, truth_folder(tmp_path, "seq_0000"))
    shutil.rmtree(tmp_path / "truth")
    assert read_observation(observation_folder(tmp_path, "seq_0000")).name == "seq_0000"


def impact(**changes) -> Impact:
    vectors = {name: np.arange(3) + 0.1 * k for k, name in enumerate(VECTORS)}
    tables = {name: np.arange(6.0).reshape(2, 3) / 7 for name in TABLES}
    numbers = {name: 0.3 * k for k, name in enumerate(NUMBERS)}
    return Impact(**{**vectors, "q_world_body": np.array([0.0, 0, 0, 1]), **tables, **numbers, "compression_work_J": -2.0, **changes})


def test_a_plate_impacts_and_what_is_left_round_trip(truth, tmp_path):
    plate = Plate(np.array([0.01, 0.02, 0.6]), np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 0.1]))
    rest = Remnant(0.01, truth.mesh_vertices * 0.9, truth.body, 2e-4, truth.inertia_kgm2 * 0.6)
    broken = replace(truth, plate=plate, impacts=(impact(), impact(time_s=0.02)), remnant=rest)
    write_truth(broken, tmp_path / "t")
    again = read_truth(tmp_path / "t")
    assert_same(broken, again)
    for a, b in zip((plate, *broken.impacts, rest), (again.plate, *again.impacts, again.remnant), strict=True):
        for name, value in vars(a).items():
            if name != "body":
                assert np.array_equal(value, getattr(b, name)), name
    assert again.impacts[1].restitution == broken.impacts[1].restitution


def test_without_a_plate_nothing_is_said_of_one(truth, tmp_path):
    write_truth(truth, tmp_path / "t")
    assert not {"plate", "impacts", "remnant"} & set(json.loads((tmp_path / "t" / "truth.json").read_text(encoding="utf-8")))
    assert read_truth(tmp_path / "t").impacts == ()


def test_a_remnant_of_another_mesh_is_named(truth, tmp_path):
    rest = Remnant(0.01, truth.mesh_vertices, truth.body, 2e-4, truth.inertia_kgm2)
    write_truth(replace(truth, plate=Plate(np.zeros(3), np.array([0.0, -1.0, 0.0])), remnant=rest), tmp_path / "t")
    box = trimesh.creation.box()
    write_mesh(tmp_path / "t" / "mesh_remnant.ply", np.asarray(box.vertices), np.asarray(box.faces))
    with pytest.raises(InputError, match=r"mesh_remnant\.ply: expected the 42 vertices of the whole particle, got 8"):
        read_truth(tmp_path / "t")
