"""The issue's list of bad input, each item through the command line: exit code, and a sentence with the file, what was expected, what came.

Pictures are painted exact outlines (dark on bright), so that a dataset of frames takes no renderer.
"""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate
from datasets.observation import Observation
from datasets.observation_files import frames_file, read_observation, write_observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.tiff_frames import write_stack
from scripts.benchmarks.bench_estimate import as_pictures
from synth.sequence import build_silhouette_sequence
from tumble.cli.main import main
from tumble.engine.marks import mark_path
from tumble.output_directory import Run, output_directory

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
FRAMES, SIZE = 20, 320
RECIPE = Recipe(
    seed=5,
    particle=ParticleRecipe(irregularity=0.6, size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=FRAMES, speed_ms=(0.3, 0.8), spin_rads=(120.0, 200.0)),
    hsv=HsvRecipe(width_px=SIZE, height_px=SIZE, focal_mm=80.0),
    rig=RigRecipe(drops=3),
    noise=NoiseRecipe(hsv_boundary_px=0.0),
)
NAME = "cut_stone-0000"
STACK = frames_file("hsv")


@pytest.fixture(scope="module")
def pictures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An observation of frames that nothing is wrong with."""
    folder = tmp_path_factory.mktemp("pictures") / "observations" / NAME
    as_pictures(build_silhouette_sequence(RECIPE, 0)[0], folder, np.random.default_rng(1))
    return folder


@pytest.fixture
def folder(pictures: Path, tmp_path: Path) -> Path:
    """A copy of it to spoil."""
    return Path(shutil.copytree(pictures, tmp_path / "observations" / NAME))


@pytest.fixture
def estimate(tmp_path: Path) -> Callable[..., int]:
    def run(source: Path, *more: str) -> int:
        return main(["estimate", str(source), "--out", str(tmp_path / "estimates"), "--jobs", "1", *more])

    return run


def measured(tmp_path: Path, name: str = NAME) -> Estimate:
    return read_estimate(tmp_path / "estimates" / f"{name}.estimate.json")


def described(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    return document


def edit(folder: Path, change: Callable[[dict[str, Any]], None]) -> None:
    """Change observation.json as a person would, who deletes the sha256 line too."""
    path = folder / "observation.json"
    document = json.loads(path.read_text(encoding="utf-8"))
    change(document)
    del document["sha256"]
    path.write_text(json.dumps(document), encoding="utf-8")


def recorded(folder: Path) -> list[np.ndarray]:
    frames = read_observation(folder).recordings[0]
    return [frames.read(k) for k in range(len(frames))]  # type: ignore[union-attr]


def says(capsys: pytest.CaptureFixture[str], *parts: str) -> None:
    error = capsys.readouterr().err
    assert [part for part in parts if part not in error] == [], error
    assert "Traceback" not in error


def test_nothing_is_wrong_with_the_pictures_themselves(pictures: Path, tmp_path: Path, estimate: Callable[..., int]) -> None:
    assert estimate(pictures, "-q") == 0
    assert measured(tmp_path).status is Status.CONVERGED
    assert all(frame.used for frame in measured(tmp_path).frames)


# Missing or truncated frames


def test_missing_frames(folder: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    write_stack(folder / STACK, recorded(folder)[:14])
    assert estimate(folder) == 2
    says(capsys, f"{NAME} failed", str(folder / STACK), "expected 20 frames", 'camera "hsv"', "got 14; frame 14 and later are missing")


def test_a_missing_stack(folder: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    (folder / STACK).unlink()
    assert estimate(folder) == 2
    says(capsys, f"{NAME} failed", str(folder / STACK), "there is no such file")


def test_truncated_frames_lose_one_sequence_and_run_json_says_so(
    folder: Path, pictures: Path, tmp_path: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    whole = Path(shutil.copytree(pictures, folder.parent / "whole"))
    edit(whole, lambda document: document.update(name="whole"))
    (folder / STACK).write_bytes((folder / STACK).read_bytes()[:-30_000])
    assert estimate(tmp_path, "-q") == 1
    says(capsys, f"{NAME} failed: {folder / STACK}: frame 19 is cut off", "the other items are whole", "--resume tries what failed again")
    assert measured(tmp_path, "whole").status is Status.CONVERGED
    run = described(tmp_path / "estimates")
    assert run["state"] == "finished_with_failures"
    assert [failure["item"] for failure in run["failures"]] == [NAME]
    assert "frame 19 is cut off" in run["failures"][0]["reason"]
    shutil.copy(pictures / STACK, folder / STACK)
    assert estimate(tmp_path, "-q", "--resume") == 0
    assert described(tmp_path / "estimates")["state"] == "finished"
    assert measured(tmp_path).status is Status.CONVERGED


# Meshes


@pytest.fixture
def render(tmp_path: Path) -> Callable[..., int]:
    def run(mesh: trimesh.Trimesh, *settings: str) -> int:
        mesh.export(tmp_path / "stone.ply")
        small = (f'particle.files=["{tmp_path / "stone.ply"}"]', "motion.frames=4", "rig.drops=1", *settings)
        words = [word for setting in small for word in ("--set", setting)]
        return main(["render", *words, "--out", str(tmp_path / "dataset"), "--jobs", "1", "-q"])

    return run


def stone(size: float) -> trimesh.Trimesh:
    """A closed mesh whose largest extent is ``size`` in the file's unit."""
    return trimesh.creation.box(extents=[size, 0.7 * size, 0.5 * size]).subdivide()


def test_a_mesh_that_is_not_watertight(tmp_path: Path, render: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    mesh = stone(6.0)
    mesh.update_faces(np.arange(len(mesh.faces)) > 1)
    assert render(mesh) == 2
    says(capsys, str(tmp_path / "stone.ply"), "expected a closed mesh", "not watertight: 6 open edges", "--set particle.repair=true")
    assert described(tmp_path / "dataset")["state"] == "finished_with_failures"


def test_a_mesh_in_millimetres_taken_for_metres(tmp_path: Path, render: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    assert render(stone(6.0), 'particle.unit="m"', "particle.size_mm=[0.0, 0.0]") == 2
    says(capsys, str(tmp_path / "stone.ply"), "the particle is 6 m across", "expected 0.01 mm to 100 mm", "millimetres taken for metres")


# Cameras and calibrated views


def test_views_in_millimetres_taken_for_metres(folder: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    def in_millimetres(document: dict[str, Any]) -> None:
        for view in document["views"]["cameras"]:
            view["t_cam_particle"] = [1e3 * value for value in view["t_cam_particle"]]

    edit(folder, in_millimetres)
    assert estimate(folder) == 2
    says(capsys, str(folder / "observation.json"), "$.views.cameras[0].t_cam_particle", "expected", "got", "millimetres taken for metres")


def test_a_camera_with_the_wrong_image_size(folder: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    edit(folder, lambda document: document["cameras"][0]["intrinsics"].update(width_px=1280, height_px=1024, cx_px=639.5, cy_px=511.5))
    assert estimate(folder) == 2
    says(capsys, str(folder / STACK), "frame 0: expected 1280 x 1024 px", "got 320 x 320")


def test_a_view_that_does_not_belong_is_named_by_its_ete(
    folder: Path, tmp_path: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    def swapped(document: dict[str, Any]) -> None:
        views = document["views"]["cameras"]
        views[4]["R_cam_particle"], views[4]["t_cam_particle"] = views[9]["R_cam_particle"], views[9]["t_cam_particle"]

    edit(folder, swapped)
    assert estimate(folder) == 0
    out = capsys.readouterr().out
    assert f"{NAME}: left out as not belonging to this particle or calibration: view 4 (RMS ETE " in out
    assert measured(tmp_path).statistics["views_left_out"] == [4]
    assert measured(tmp_path).statistics["n_views"] == 17


def test_a_view_without_an_outline_does_not_shift_the_names_of_the_others(
    tmp_path: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    observation, _ = build_silhouette_sequence(RECIPE, 0)
    outlines = list(observation.view_recording)  # type: ignore[arg-type]
    outlines[2] = replace(outlines[2], points_px=np.zeros((0, 2)))
    outlines[8] = replace(outlines[8], points_px=outlines[8].points_px + np.array([150.0, -90.0]))
    write_observation(replace(observation, view_recording=tuple(outlines)), tmp_path / NAME)
    assert estimate(tmp_path / NAME) == 0
    out = capsys.readouterr().out
    assert "calibration: view 8 (RMS ETE " in out
    assert "left out without a usable outline: view 2." in out
    assert measured(tmp_path).statistics["views_left_out"] == [8]
    assert measured(tmp_path).statistics["views_without_outline"] == [2]


# Pictures that show no particle, or only a part of it


def test_an_all_black_frame_is_left_out_by_name(
    folder: Path, tmp_path: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    frames = recorded(folder)
    frames[7] = np.zeros_like(frames[7])
    write_stack(folder / STACK, frames)
    assert estimate(folder) == 0
    assert f"{NAME}: 1 of 20 frames left out: 1 black picture." in capsys.readouterr().out
    assert measured(tmp_path).status is Status.CONVERGED
    assert [(frame.frame, frame.reason) for frame in measured(tmp_path).frames if not frame.used] == [(7, "black picture")]


def test_nothing_but_black_frames_is_no_measurement(
    folder: Path, tmp_path: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]
) -> None:
    write_stack(folder / STACK, [np.zeros((SIZE, SIZE), np.uint16)] * FRAMES)
    assert estimate(folder) == 1
    assert "0 usable pictures, at least 8 are needed; left out: 20 black picture." in capsys.readouterr().out
    assert measured(tmp_path).status is Status.NOT_ENOUGH_FRAMES
    assert measured(tmp_path).middle is None


@pytest.mark.parametrize(("last", "status"), [(12, Status.CONVERGED), (5, Status.OUT_OF_VIEW)])
def test_a_particle_that_leaves_the_picture(
    folder: Path, tmp_path: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str], last: int, status: Status
) -> None:
    frames = recorded(folder)
    beyond = np.full_like(frames[0], np.median(frames[0]))
    middle = int(np.median(np.flatnonzero(frames[last + 1].min(axis=0) < frames[0].max() // 2)))
    halved = np.roll(frames[last + 1], SIZE - middle, axis=1)
    halved[:, : SIZE // 2] = beyond[:, : SIZE // 2]
    frames[last + 1 :] = [halved] + [beyond] * (FRAMES - last - 2)
    write_stack(folder / STACK, frames)
    assert estimate(folder) == int(status is not Status.CONVERGED)
    out = capsys.readouterr().out
    assert f"{19 - last} of 20 frames left out: 1 cut off by the picture's edge, {18 - last} absent." in out
    assert measured(tmp_path).status is status
    assert (measured(tmp_path).middle is None) == (status is Status.OUT_OF_VIEW)


# Disks, kills, two runs


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three sequences of outlines."""
    root = tmp_path_factory.mktemp("three")
    for index in range(3):
        observation: Observation = build_silhouette_sequence(RECIPE, index)[0]
        write_observation(observation, root / "observations" / observation.name)
    return root


def test_a_full_disk_loses_nothing_else(
    three: Path, tmp_path: Path, estimate: Callable[..., int], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = os.replace

    def full(source: object, target: object, **options: object) -> None:
        if "-0001.estimate" in str(target):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        real(source, target, **options)  # type: ignore[arg-type]

    with monkeypatch.context() as patched:
        patched.setattr(os, "replace", full)
        assert estimate(three, "-q") == 1
    says(capsys, "cut_stone-0001 failed", "cut_stone-0001.estimate.json: the disk is full", "--resume")
    assert [failure["item"] for failure in described(tmp_path / "estimates")["failures"]] == ["cut_stone-0001"]
    assert list((tmp_path / "estimates").glob("*.partial")) == []
    assert len(list((tmp_path / "estimates").glob("*.estimate.json"))) == 2
    assert estimate(three, "-q", "--resume") == 0
    assert len(list((tmp_path / "estimates").glob("*.estimate.json"))) == 3


def test_a_killed_estimate_is_resumed_with_the_same_result(three: Path, tmp_path: Path, estimate: Callable[..., int]) -> None:
    words = ["estimate", str(three), "--out", str(tmp_path / "killed"), "--jobs", "1", "-q"]
    first = tmp_path / "killed" / f"{NAME}.estimate.json"
    process = subprocess.Popen([sys.executable, "-m", "tumble.cli.main", *words], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    while not mark_path(first).exists():
        assert process.poll() is None, process.communicate()[1]
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert described(tmp_path / "killed")["state"] == "unfinished"
    written = first.stat().st_mtime_ns
    assert main([*words, "--resume"]) == 0
    assert first.stat().st_mtime_ns == written
    assert estimate(three, "-q") == 0
    for path in (tmp_path / "estimates").glob("*.estimate.json"):
        assert (tmp_path / "killed" / path.name).read_bytes() == path.read_bytes()


def test_two_runs_into_one_directory(three: Path, tmp_path: Path, estimate: Callable[..., int], capsys: pytest.CaptureFixture[str]) -> None:
    with output_directory(tmp_path / "estimates", Run("estimate", {}, reads=()), resume=False, force=False):
        assert estimate(three, "--force") == 2
        says(capsys, f"{tmp_path / 'estimates'}: process {os.getpid()} is writing there. Wait for it, or choose another --out.")
    assert estimate(three) == 2
    says(capsys, str(tmp_path / "estimates"), "holds the finished run of `tumble estimate`. Add --resume", "or --force to replace it")
