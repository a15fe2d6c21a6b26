"""Rivals measure what they can of a small sequence, through files alone, and stand in a table beside one another."""

import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.dataset_files import observation_folder, read_dataset, truth_folder, write_dataset
from datasets.estimate import Status
from datasets.estimate_files import read_estimate
from datasets.observation import CalibratedView
from datasets.observation_files import read_observation
from datasets.scoring.score import score
from datasets.truth_files import read_truth
from datasets.vocabulary.camera import Intrinsics
from rivals import centroids, epipolar_tangency, pose_by_pose, silhouette_iou
from rivals.flight import Flight, motion_of
from rivals.hull import _inside, hull_of
from rivals.joining import joined
from rivals.seen import area_and_centroid, frames_seen
from tumble.cli.main import main

RECIPE = """
name = "small"
seed = 5
sequences = 1
tier = "silhouette"
[particle]
family = "cut_stone"
[motion]
frames = 40
spin_rads = [150.0, 200.0]
[rig]
drops = 4
"""


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("rivals")
    (folder / "recipe.toml").write_text(RECIPE)
    assert main(["render", "--config", str(folder / "recipe.toml"), "--out", str(folder / "data"), "--jobs", "1", "-q"]) == 0
    return folder / "data"


@pytest.fixture(scope="module")
def sequence(dataset):
    name = read_dataset(dataset).sequences[0]
    return read_observation(observation_folder(dataset, name)), read_truth(truth_folder(dataset, name))


@pytest.fixture(scope="module")
def hull(sequence):
    return hull_of(sequence[0])


def true_flight(obs, truth, hull):
    """The true flight at its first frame, of a body with the hull's axes."""
    particle = Rotation.from_quat(truth.motion.q_world_body[0]) * Rotation.from_matrix(truth.body.R_particle_body).inv()
    q = (particle * Rotation.from_matrix(hull.body.R_particle_body)).as_quat()
    x = truth.motion.x_world[0] + particle.apply(hull.body.com_particle - truth.body.com_particle)
    return Flight(x, truth.motion.v_world[0], q, truth.motion.omega_world[0])


def test_the_hull_is_the_body_and_a_little_more(sequence, hull) -> None:
    _, truth = sequence
    volume = np.abs(np.einsum("ij,ij->i", *_columns(truth)).sum()) / 6
    assert 1.0 < hull.mesh.volume / volume < 1.1
    assert hull.body.com_particle == pytest.approx(truth.body.com_particle, abs=5e-5)
    assert hull.body.inertia_ratios == pytest.approx(truth.body.inertia_ratios, abs=0.02)


def _columns(truth):
    a, b, c = truth.mesh_vertices[truth.mesh_faces].transpose(1, 0, 2)
    return a, np.cross(b, c)


def test_a_flight_without_torque_keeps_its_angular_momentum_and_runs_backwards(sequence, hull) -> None:
    obs, truth = sequence
    motion = motion_of(true_flight(obs, truth, hull), np.array([-0.01, 0.0, 0.02]), truth.body, obs.gravity_world)
    turns = Rotation.from_quat(motion.q_world_body)
    momentum = turns.apply(truth.body.inertia_ratios * turns.apply(motion.omega_world, inverse=True))
    assert np.ptp(momentum, axis=0) == pytest.approx(np.zeros(3), abs=1e-9 * np.linalg.norm(momentum))
    back = Flight(motion.x_world[2], motion.v_world[2], motion.q_world_body[2], motion.omega_world[2])
    again = motion_of(back, np.array([-0.03, -0.02, 0.0]), truth.body, obs.gravity_world)
    assert again.x_world[0] == pytest.approx(motion.x_world[0], abs=1e-12)
    assert (Rotation.from_quat(again.q_world_body[0]) * turns[0].inv()).magnitude() < 2e-5  # of its steps of 0.1 rad


def test_centroids_give_a_velocity_and_no_spin(sequence) -> None:
    obs, truth = sequence
    row = score(centroids.measure(obs), truth)
    assert row["converged"]
    assert row["middle_in_plane_percent"] < 10
    assert row["middle_angular_percent"] == pytest.approx(100)
    assert row["middle_ellipsoid95_omega"]


def test_poses_frame_by_frame_give_both(sequence, monkeypatch) -> None:
    obs, truth = sequence
    monkeypatch.setattr(pose_by_pose, "STARTS", 40)
    monkeypatch.setattr(pose_by_pose, "KEPT", 3)
    row = score(pose_by_pose.measure(obs), truth)
    assert row["orientation_median_deg"] < 5
    assert row["middle_in_plane_percent"] < 3
    assert row["middle_angular_percent"] < 10


def test_overlap_is_largest_near_the_true_flight(sequence, hull) -> None:
    obs, truth = sequence
    seen = frames_seen(obs)
    true = true_flight(obs, truth, hull)
    missed = silhouette_iou._Overlap(obs, hull, seen, np.arange(0, len(seen.rows), 5), (0.0, true))
    least = missed(np.zeros(12))
    assert 0 < least < 0.05
    for k in (0, 1, 3, 6, 8, 9):
        assert missed(40 * np.eye(12)[k]) > 1.2 * least


def test_the_epipolar_tangency_error_of_the_true_flight_is_the_noise_and_leads_back_to_it(sequence, hull) -> None:
    obs, truth = sequence
    seen = frames_seen(obs)
    true = true_flight(obs, truth, hull)
    pairs = epipolar_tangency._Pairs(obs, hull, seen, (len(seen.rows), 10, 12))
    assert np.sqrt(np.mean(pairs.errors(true) ** 2)) < 0.5
    off = true.moved(np.repeat([1e-4, 1e-2, 0.05, 20.0], 3))
    assert np.sqrt(np.mean(pairs.errors(off) ** 2)) > 1.5
    found, end = epipolar_tangency._descended(pairs, off)
    assert epipolar_tangency._rms(end) < 0.5
    assert found.omega == pytest.approx(true.omega, abs=0.04 * np.linalg.norm(true.omega))


def test_outlines_of_pictures_are_half_way(monkeypatch) -> None:
    from rivals.seen import _contour

    y, x = np.mgrid[:60, :80]
    inside = np.clip(20.5 - np.hypot(x - 40, y - 30), 0, 1)
    picture = (200 + 3000 * inside).astype(np.uint16)
    area, centre = area_and_centroid(_contour(picture, np.full_like(picture, 200)))
    assert area == pytest.approx(np.pi * 20**2, rel=0.01)
    assert centre == pytest.approx([40, 30], abs=0.02)
    assert len(_contour(np.full_like(picture, 200), None)) == 0


def test_an_instrument_joins_through_files_and_stands_in_the_table(dataset, tmp_path, capsys) -> None:
    out = tmp_path / "centroids"
    assert joined("centroids", centroids.measure, [str(dataset), "--out", str(out)]) == 0
    (path,) = out.glob("*.estimate.json")
    assert read_estimate(path).versions["instrument"] == "centroids"
    kept = path.stat().st_mtime_ns
    assert joined("centroids", centroids.measure, [str(dataset), "--out", str(out)]) == 0
    assert path.stat().st_mtime_ns == kept
    (tmp_path / "nobody").mkdir()
    page = tmp_path / "board"
    words = ["leaderboard", str(dataset), "--of", f"centroids={out}", "--of", f"nobody={tmp_path / 'nobody'}", "--out", str(page)]
    assert main(words) == 0
    assert "| centroids | 1 of 1 |" in (page / "leaderboard.md").read_text()
    assert "| nobody | 0 of 1 | none" in capsys.readouterr().out
    told = json.loads((page / "leaderboard.json").read_text())
    assert {first["first"] for first in told["firsts"]} == {"centroids"}


def test_estimates_of_another_dataset_are_refused(dataset, tmp_path, capsys) -> None:
    out = tmp_path / "centroids"
    assert joined("centroids", centroids.measure, [str(dataset), "--out", str(out)]) == 0
    other = tmp_path / "other"
    shutil.copytree(dataset, other)
    observation = next(other.rglob("observation.json"))
    observation.write_text(observation.read_text() + " ")
    assert joined("centroids", centroids.measure, [str(other), "--out", str(out)]) == 2
    assert "got one of another observation" in capsys.readouterr().err
    write_dataset(replace(read_dataset(other), name="other"), other)
    assert main(["leaderboard", str(dataset), str(other), "--of", f"centroids={out}", "--out", str(tmp_path / "board")]) == 2
    assert "expected a folder of estimates for each of several datasets" in capsys.readouterr().err


def test_a_disc_is_carved_to_its_size() -> None:
    angles = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    lens = Intrinsics(200, 200, 1000.0, 1000.0, 100.0, 100.0)
    view = CalibratedView(lens, np.eye(3), np.array([0.0, 0.0, 1.0]))
    outline = 100.3 + 50 * np.column_stack([np.cos(angles), np.sin(angles)])
    reach = np.linspace(0.045, 0.055, 201)
    edges = []
    for angle in np.linspace(0, 2 * np.pi, 36):
        points = np.column_stack([0.3e-3 + reach * np.cos(angle), 0.3e-3 + reach * np.sin(angle), np.zeros(201)])
        edges.append(np.interp(0.0, -_inside(view, outline, points), 1000 * reach))
    assert np.mean(edges) == pytest.approx(50, abs=0.1)


def test_what_cannot_be_measured_is_told_and_not_raised(dataset, tmp_path) -> None:
    def hopeless(_):
        raise ValueError("expected a body, got fog")

    hopeless.__module__ = centroids.__name__
    assert joined("fog", hopeless, [str(dataset), "--out", str(tmp_path)]) == 0
    (path,) = tmp_path.glob("*.estimate.json")
    assert read_estimate(path).status is Status.NO_CONVERGENCE
    assert "got fog" in read_estimate(path).message


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere", "--of", "a=DATA"], "nowhere"),
        (["DATA", "--of", "a"], "expected NAME=FOLDER, got 'a'"),
        (["DATA", "--of", "a=nowhere"], "expected the folder of a's estimates"),
        (["DATA", "--of", "a=DATA", "--of", "a=DATA"], "'a' twice"),
        (["DATA", "DATA", "--of", "a=DATA"], "different names"),
    ],
)
def test_bad_input_is_named(dataset, tmp_path, capsys, words, said) -> None:
    given = [word.replace("DATA", str(dataset)) for word in words]
    assert main(["leaderboard", *given, "--out", str(tmp_path / "board")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "board").exists()


def test_a_folder_without_observations_is_named(tmp_path) -> None:
    words = [sys.executable, "-m", "rivals.centroids", str(tmp_path), "--out", str(tmp_path / "out")]
    ended = subprocess.run(words, capture_output=True, text=True, check=False, env={**os.environ, "OMP_NUM_THREADS": "1"})
    assert ended.returncode == 2
    assert f"{tmp_path}: expected a dataset" in ended.stderr
