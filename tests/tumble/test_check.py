"""``tumble check``: what a person would see is wrong with a recording is said before anything is fitted."""

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.observation import Frames, Observation
from datasets.observation_files import frames_file, read_observation, write_observation
from datasets.tiff_frames import TiffFrames, write_stack
from estimator.data.configuration import Configuration
from estimator.readiness.inspection import OddStep
from scripts.benchmarks.bench_estimate import as_pictures
from synth.sequence import build_silhouette_sequence
from tests.tumble.browsing import opened, serious_findings
from tests.tumble.small_drops import small_drop
from tumble.checking import geometry
from tumble.checking.findings import _steps
from tumble.cli.main import main
from tumble.reports import check_page
from tumble.written_files import read_run

SIZE, FRAMES, NAME = 200, 24, "cut_stone-0000"
RECIPE = small_drop(frames=FRAMES, size_px=SIZE)
Pictures = list[NDArray[np.uint16]]


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without charts and the promise, which take a second; the good recording's page has them."""
    monkeypatch.setattr(check_page, "figure_svg", lambda *_, **__: "")
    monkeypatch.setattr(geometry, "promise_of", lambda *_: None)
    monkeypatch.setattr(geometry, "Configuration", lambda: Configuration(hull_resolution=24, directions=20))


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An observation of pictures that nothing is wrong with."""
    folder = tmp_path_factory.mktemp("good") / NAME
    as_pictures(build_silhouette_sequence(RECIPE, 0)[0], folder, np.random.default_rng(1))
    return folder


def spoiled(good: Path, folder: Path, pictures: Callable[[Pictures], Pictures], **changes: object) -> Path:
    """The observation with its pictures and fields changed."""
    observation = read_observation(good)
    (recording,) = observation.recordings
    assert isinstance(recording, Frames)
    folder.mkdir()
    write_stack(folder / frames_file("hsv"), pictures([recording.read(k) for k in range(len(recording))]))
    stack = TiffFrames(folder / frames_file("hsv"), 12)
    clock = observation.clock
    changed = replace(observation, recordings=(stack,), clock=replace(clock, times_s=clock.times_s[: len(stack)]), **changes)  # type: ignore[arg-type]
    write_observation(changed, folder)
    return folder


def checked(folder: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, object]]:
    out = folder.parent / f"check of {folder.name}"
    capsys.readouterr()
    code = main(["check", str(folder), "--out", str(out), "--json"])
    (told,) = json.loads(capsys.readouterr().out)
    assert (out / f"{folder.name}.check.html").is_file()
    return code, told


def bad(told: dict[str, object]) -> str:
    return " ".join(finding["sentence"] for finding in told["findings"] if finding["bad"])  # type: ignore[attr-defined]


def test_a_good_recording(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(good), "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert f"{FRAMES} of {FRAMES}" in said
    assert f"next: tumble estimate {good}" in said
    page = (tmp_path / "out" / f"{NAME}.check.html").read_text()
    assert "Nothing speaks against a measurement." in page
    assert page.count("data:image/webp") == FRAMES + 1
    assert page.count("<polygon") == FRAMES + 12
    assert "promised: each component of omega" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page
    assert len(page) < 1_000_000
    described = read_run(tmp_path / "out") or {}
    assert f"{NAME}.check.html" in described["files"]


def test_the_page_can_be_used_by_everybody(quick: None, good: Path, tmp_path: Path) -> None:
    main(["check", str(good), "--out", str(tmp_path / "out"), "-q"])
    with opened(tmp_path / "out" / f"{NAME}.check.html") as tab:
        assert serious_findings(tab) == []


def brighter(pictures: Pictures) -> Pictures:
    return [np.minimum(picture.astype(np.uint32) * 3 // 2, 4095).astype(np.uint16) for picture in pictures]


@pytest.mark.usefixtures("quick")
def test_a_saturated_recording(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, told = checked(spoiled(good, tmp_path / "bright", brighter), capsys)
    assert code == 1
    assert "of the pixels are at full scale (saturated)" in bad(told)


@pytest.mark.usefixtures("quick")
def test_a_lost_picture_is_named(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, told = checked(spoiled(good, tmp_path / "lost", lambda pictures: [*pictures[:10], *pictures[11:]]), capsys)
    assert code == 1
    assert "between frames 9 and 10 the particle moved 2.0 times as far" in bad(told)


def test_a_picture_that_is_there_twice_moves_by_nothing() -> None:
    (told,) = _steps(SimpleNamespace(odd_steps=(OddStep(29, 30, -0.04),)))  # type: ignore[arg-type]
    assert "the particle moved 0.0 times as far" in told.sentence


@pytest.mark.usefixtures("quick")
def test_a_wrong_frame_rate_is_named(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    clock = read_observation(good).clock
    slow = replace(clock, times_s=10.0 * clock.times_s)
    folder = shutil.copytree(good, tmp_path / "slow")
    write_observation(replace(observation_of(folder), clock=slow), folder)
    code, told = checked(folder, capsys)
    assert code == 1
    assert "of the stated gravity: the times would have to be" in bad(told)


def observation_of(folder: Path) -> Observation:
    return read_observation(folder)


@pytest.mark.usefixtures("quick")
def test_a_particle_that_rests_is_named(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, told = checked(spoiled(good, tmp_path / "still", lambda pictures: [pictures[0]] * FRAMES), capsys)
    assert code == 1
    assert "does not move" in bad(told)


@pytest.mark.usefixtures("quick")
def test_frames_that_are_left_out_are_named_with_the_reason(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    def without(pictures: Pictures) -> Pictures:
        empty = np.full_like(pictures[0], int(np.median(pictures[0])))
        return [*pictures[:4], *[np.zeros_like(empty)] * 2, *pictures[6:-3], *[empty] * 3]

    _, told = checked(spoiled(good, tmp_path / "gaps", without), capsys)
    figures = told["figures"]["camera hsv"]  # type: ignore[index]
    assert figures["left out: black picture"] == "4-5"
    assert figures["left out: absent"] == f"{FRAMES - 3}-{FRAMES - 1}"


@pytest.mark.usefixtures("quick")
def test_a_low_threshold_on_a_faint_particle(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    code, told = checked(spoiled(good, tmp_path / "faint", lambda pictures: [picture // 25 + 3000 for picture in pictures]), capsys)
    assert code == 1
    assert "0 usable frames, and a measurement needs 8" in bad(told)


@pytest.mark.usefixtures("quick")
def test_views_of_another_particle_or_rig(good: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    observation = read_observation(good)
    views = tuple(replace(view, R_cam_particle=view.R_cam_particle.T) for view in observation.views)
    code, told = checked(spoiled(good, tmp_path / "views", list, views=views), capsys)
    assert code == 1
    assert "views" in bad(told)
    code, told = checked(spoiled(good, tmp_path / "none", list, views=(), view_recording=()), capsys)
    assert code == 1
    assert "there are no calibrated views" in bad(told)


@pytest.mark.usefixtures("quick")
def test_a_page_for_every_observation_of_a_folder(good: Path, tmp_path: Path) -> None:
    for name in ("a", "b"):
        shutil.copytree(good, tmp_path / "all" / name)
    (tmp_path / "all" / "b" / "frames_hsv.tif").write_bytes(b"II*\0")
    assert main(["check", str(tmp_path / "all"), "--out", str(tmp_path / "out"), "--jobs", "1", "-q"]) == 1
    assert [path.name for path in sorted((tmp_path / "out").glob("*.html"))] == ["a.check.html"]
    assert [failure["item"] for failure in (read_run(tmp_path / "out") or {})["failures"]] == ["b"]
