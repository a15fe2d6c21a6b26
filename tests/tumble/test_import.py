"""``tumble import``: what a camera wrote becomes the observation it is, and a draft where something is missing."""

import json
import re
import shutil
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from PIL import Image

from datasets.observation import Frames
from datasets.observation_files import FILE, frames_file, read_observation
from datasets.tiff_frames import TiffFrames
from datasets.video.phantom_table import LINEAR_DN
from datasets.video.writing import Recorded, write_cine, write_film, write_mraw
from datasets.vocabulary.outline import Outline
from estimator.readiness import inspect_recording
from scripts.benchmarks.bench_estimate import as_pictures
from synth.sequence import build_silhouette_sequence
from tests.tumble.small_drops import small_drop
from tumble.checking.checked import camera_check
from tumble.cli.main import main
from tumble.cli.outcomes import NOTHING_TO_GO_ON_WITH
from tumble.importing import importing
from tumble.reports import check_page
from tumble.written_files import read_run

pytestmark = pytest.mark.long

SIZE, FRAMES = 160, 12
RECIPE = small_drop(frames=FRAMES, size_px=SIZE)
NAME = "drop"
Pictures = list[NDArray[np.uint16]]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without what views and gravity say and without charts, which take a second; they are tested in test_check.py."""
    monkeypatch.setattr(importing, "geometry_of", lambda *_: None)
    monkeypatch.setattr(check_page, "figure_svg", lambda *_, **__: "")


@pytest.fixture
def blind(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without looking for outlines, nor saying that there are none, where only what is written matters."""
    monkeypatch.setattr(
        importing, "inspect_recording", lambda recording, size, **_: inspect_recording([Outline(np.zeros((0, 2)))] * len(recording), size)
    )
    monkeypatch.setattr(importing, "camera_check", lambda *seen: replace(camera_check(*seen), findings=()))


@pytest.fixture(scope="module")
def known(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The observation that everything here is a recording of."""
    folder = tmp_path_factory.mktemp("known") / "observations" / NAME
    observation = build_silhouette_sequence(RECIPE, 0)[0]
    as_pictures(type(observation)(**{**vars(observation), "name": NAME}), folder, np.random.default_rng(1))
    return folder


@pytest.fixture(scope="module")
def pictures(known: Path) -> Pictures:
    (recording,) = read_observation(known).recordings
    assert isinstance(recording, Frames)
    return [recording.read(k) for k in range(len(recording))]


@pytest.fixture(scope="module")
def how(known: Path) -> Recorded:
    clock = read_observation(known).clock
    return Recorded(rate_hz=RECIPE.motion.frame_rate_hz, exposure_s=clock.exposure_s, depth=12)


def imported(videos: Path | list[Path], known: Path, out: Path, *more: str) -> int:
    stated = ["--camera", str(known), "--particle", str(known), "--gravity", "down"]
    return main(["import", *map(str, videos if isinstance(videos, list) else [videos]), *stated, "--out", str(out), "--jobs", "1", *more])


def tiff(**settings: object) -> Callable[[Path, Pictures, Recorded], tuple[Path, list[str]]]:
    def write(folder: Path, pictures: Pictures, how: Recorded) -> tuple[Path, list[str]]:
        tifffile.imwrite(folder / f"{NAME}.tif", np.stack(pictures), photometric="minisblack", **settings)
        return folder / f"{NAME}.tif", ["--rate", "4kHz", "--exposure", f"{how.exposure_s!r}"]

    return write


def mraw(bits: int) -> Callable[[Path, Pictures, Recorded], tuple[Path, list[str]]]:
    def write(folder: Path, pictures: Pictures, how: Recorded) -> tuple[Path, list[str]]:
        write_mraw(folder / f"{NAME}.mraw", pictures, how, bits=bits)
        return folder / f"{NAME}.mraw", []

    return write


def film(folder: Path, pictures: Pictures, how: Recorded) -> tuple[Path, list[str]]:
    write_film(folder / f"{NAME}.avi", pictures, 30.0, bits=16)
    return folder / f"{NAME}.avi", ["--rate", "4000", "--exposure", f"{how.exposure_s!r}"]


def cine(bits: int) -> Callable[[Path, Pictures, Recorded], tuple[Path, list[str]]]:
    """With the nominal clock: its own stamps are kept to half a nanosecond."""

    def write(folder: Path, pictures: Pictures, how: Recorded) -> tuple[Path, list[str]]:
        write_cine(folder / f"{NAME}.cine", pictures, how, bits=bits)
        return folder / f"{NAME}.cine", ["--rate", "4kHz", "--exposure", f"{how.exposure_s!r}", "--stamps", "middle"]

    return write


FORMS = {
    **{f"cine {bits}": cine(bits) for bits in (12, 16)},
    **{f"mraw {bits}": mraw(bits) for bits in (12, 16)},
    **{f"TIFF {name}": tiff(compression=name) for name in (None, "zlib", "lzw")},
    "FFV1": film,
}


@pytest.mark.usefixtures("blind")
@pytest.mark.parametrize("form", list(FORMS))
def test_a_recording_becomes_the_very_same_observation(form: str, known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    """The same document to the byte, and the same pixels: an estimate from there on cannot differ."""
    video, words = FORMS[form](tmp_path, pictures, how)
    assert imported(video, known, tmp_path / "out", "-q", *words) == 0
    made = tmp_path / "out" / "observations" / NAME
    assert (made / FILE).read_bytes() == (known / FILE).read_bytes()
    frames = TiffFrames(made / frames_file("hsv"), 12)
    for k, picture in enumerate(pictures):
        np.testing.assert_array_equal(frames.read(k), picture)


@pytest.mark.usefixtures("blind")
@pytest.mark.parametrize("bits", [8, 10, 12, 16])
def test_a_phantom_recording(bits: int, known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    """The same pixels; times to half a nanosecond, the camera's own resolution, and half an exposure after its stamps."""
    shown = {8: [p >> 4 for p in pictures], 10: [LINEAR_DN[p >> 2] for p in pictures]}.get(bits, pictures)
    times = read_observation(known).clock.times_s
    write_cine(tmp_path / f"{NAME}.cine", shown, how, bits=bits, stamps_s=times - 0.5 * how.exposure_s)
    assert imported(tmp_path / f"{NAME}.cine", known, tmp_path / "out", "-q") == 0
    made = read_observation(tmp_path / "out" / "observations" / NAME)
    (frames,) = made.recordings
    assert isinstance(frames, Frames)
    assert frames.bit_depth == (8 if bits == 8 else 12)
    for k, picture in enumerate(shown):
        np.testing.assert_array_equal(frames.read(k), picture)
    np.testing.assert_allclose(made.clock.times_s, times, rtol=0, atol=5e-10)
    np.testing.assert_allclose(made.clock.exposure_s, how.exposure_s, rtol=0, atol=2.0**-32)


def test_what_is_missing_is_named_with_what_to_type(
    pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_mraw(tmp_path / f"{NAME}.mraw", pictures, how, bits=12)
    assert main(["import", str(tmp_path / f"{NAME}.mraw"), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr().out
    draft = tomllib.loads((tmp_path / "out" / "draft.toml").read_text())
    assert set(draft["missing"]) == {"camera", "particle", "gravity"}
    for name, each in draft["missing"].items():
        assert f"--{name}" in each["type"]
        assert each["type"] in said
    assert draft["frame_rate"] == {"value": 4000.0, "origin": "read", "note": f"{NAME}.cih, record rate"}
    assert draft["background"]["origin"] == "assumed"
    assert re.search(rf"frames used +{FRAMES} of {FRAMES}", said)
    assert (tmp_path / "out" / f"{NAME}.check.html").is_file()
    assert not (tmp_path / "out" / "observations").exists()
    assert (read_run(tmp_path / "out") or {})["state"] == "finished"


@pytest.mark.usefixtures("blind")
def test_a_draft_is_completed_by_the_command_it_names(known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    write_mraw(tmp_path / f"{NAME}.mraw", pictures, how, bits=12)
    assert main(["import", str(tmp_path / f"{NAME}.mraw"), "--frames", "2:11", "--out", str(tmp_path / "out"), "-q"]) == 1
    text = (tmp_path / "out" / "draft.toml").read_text()
    line = text.splitlines()[-1].removeprefix("# tumble ").replace("CAMERA", str(known)).replace("PARTICLE", str(known))
    assert main(line.split()) == 0
    assert not (tmp_path / "out" / "draft.toml").exists()
    assert len(read_observation(tmp_path / "out" / "observations" / NAME).clock.times_s) == 9


def test_a_dry_run_says_the_header_and_writes_nothing(
    pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_cine(tmp_path / f"{NAME}.cine", pictures, how, bits=12)
    words = ["import", str(tmp_path / f"{NAME}.cine"), "--dry-run", "--out", str(tmp_path / "out")]
    assert main([*words, "--json"]) == 0
    (told,) = json.loads(capsys.readouterr().out)
    values = {value["name"]: (value["value"], value["origin"]) for value in told["values"]}
    assert values["bit_depth"] == (12, "read")
    assert values["frame_rate"] == (4000.0, "read")
    assert values["stamped"] == ("start", "assumed")
    assert [missing["name"] for missing in told["missing"]] == ["camera", "particle", "gravity"]
    assert main(words) == 0
    assert "missing: camera" in capsys.readouterr().out
    assert not (tmp_path / "out").exists()


@pytest.mark.usefixtures("blind")
def test_values_that_are_given_are_taken_and_said_to_be(known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    write_cine(tmp_path / f"{NAME}.cine", pictures, how, bits=16)
    words = ["--rate", "2kHz", "--exposure", "40us", "--stamps", "middle", "--frames", "3:", "-q"]
    assert imported(tmp_path / f"{NAME}.cine", known, tmp_path / "out", *words, "--gravity=0,9.7,0.1") == 0
    made = read_observation(tmp_path / "out" / "observations" / NAME)
    np.testing.assert_array_equal(made.clock.times_s, np.arange(3, FRAMES) / 2000.0)
    np.testing.assert_array_equal(made.gravity_world, [0.0, 9.7, 0.1])
    assert made.clock.exposure_s == 40e-6
    told = tomllib.loads((tmp_path / "out" / "observations" / NAME / "import.toml").read_text())
    assert {told[name]["origin"] for name in ("frame_rate", "exposure", "stamped", "gravity", "camera", "particle", "frames")} == {"given"}
    assert told["bit_depth"]["origin"] == "read"


@pytest.mark.usefixtures("blind")
def test_gravity_from_a_file_and_a_draft_for_each_of_several(known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    (tmp_path / "level.toml").write_text("gravity_world = [0.1, 9.7, 0.2]\n")
    (tmp_path / "camera.json").write_text(
        json.dumps({"intrinsics": {"width_px": SIZE, "height_px": SIZE, "fx_px": 3333.0, "fy_px": 3333.0}})
    )
    for name in ("one", "two"):
        write_mraw(tmp_path / f"{name}.mraw", pictures, how, bits=12)
    words = ["import", str(tmp_path / "one.mraw"), str(tmp_path / "two.mraw"), "--gravity", str(tmp_path / "level.toml")]
    assert main([*words, "--camera", str(tmp_path / "camera.json"), "--out", str(tmp_path / "out"), "--jobs", "1", "-q"]) == 1
    for name in ("one", "two"):
        draft = tomllib.loads((tmp_path / "out" / f"{name}.draft.toml").read_text())
        assert set(draft["missing"]) == {"particle"}
        assert draft["gravity"]["value"] == [0.1, 9.7, 0.2]
        assert "focal" not in draft["camera"]["value"]


def test_what_speaks_against_a_measurement_is_no_success(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The observation is written; code and last line are those of ``tumble check``."""
    write_cine(tmp_path / f"{NAME}.cine", [pictures[0]] * FRAMES, how, bits=12)
    out = tmp_path / "out"
    assert imported(tmp_path / f"{NAME}.cine", known, out) == 1
    said = capsys.readouterr().out
    assert "bad: " in said
    assert said.splitlines()[-1] == NOTHING_TO_GO_ON_WITH
    assert (out / "observations" / NAME / FILE).is_file()
    assert main(["check", str(out), "--out", str(tmp_path / "check")]) == 1
    assert capsys.readouterr().out.splitlines()[-1] == NOTHING_TO_GO_ON_WITH


@pytest.mark.usefixtures("blind")
def test_what_is_proposed_next_has_a_folder_of_its_own(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_cine(tmp_path / f"{NAME}.cine", pictures, how, bits=12)
    for name in ("first", "second"):
        assert imported(tmp_path / f"{NAME}.cine", known, tmp_path / name) == 0
        last = capsys.readouterr().out.splitlines()[-1]
        assert last == f"next: tumble estimate {tmp_path / name} --out {tmp_path / f'{name}_estimates'}"


@pytest.mark.usefixtures("blind")
def test_all_places_where_pictures_are_missing_are_named(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    numbers = {"few": [*range(4), *range(6, 9), *range(10, 15)], "many": range(0, 3 * FRAMES, 3)}
    for name, taken in numbers.items():
        folder = tmp_path / name
        folder.mkdir()
        for number, picture in zip([*taken[:-1], taken[-2] + 1] if name == "many" else taken, pictures, strict=True):
            tifffile.imwrite(folder / f"f_{number}.tif", picture)
        assert main(["import", str(folder), "--dry-run", "--out", str(tmp_path / "out")]) == 0
        said = " ".join(capsys.readouterr().out.split())
        if name == "few":
            assert "the names jump from f_3.tif to f_6.tif, from f_8.tif to f_10.tif: pictures are missing there" in said
        else:
            assert "from f_12.tif to f_15.tif and at 5 further places: pictures are missing there" in said


@pytest.mark.usefixtures("blind")
def test_time_stamps_that_contradict_the_frame_rate_are_said(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stamps = 10.0 * np.arange(FRAMES) / how.rate_hz
    write_cine(tmp_path / f"{NAME}.cine", pictures, how, bits=16, stamps_s=stamps)
    imported(tmp_path / f"{NAME}.cine", known, tmp_path / "out")
    assert "time stamps say 400 pictures per second, its header 4000" in capsys.readouterr().out


def test_masks_and_outlines_that_a_user_has(known: Path, pictures: Pictures, tmp_path: Path) -> None:
    folder = tmp_path / NAME
    folder.mkdir()
    middle = 0.5 * (float(np.median(pictures[0])) + float(min(picture.min() for picture in pictures)))
    for k, picture in enumerate(pictures):
        Image.fromarray(((picture < middle) * 255).astype(np.uint8)).save(folder / f"mask_{k}.png")
    words = ["--masks", "--rate", "4000", "--exposure", "0", "-q"]
    assert imported(folder, known, tmp_path / "out", *words) == 0
    made = tmp_path / "out" / "observations" / NAME
    first = read_observation(made).recordings[0]
    assert imported(made / "outlines_hsv.npz", known, tmp_path / "again", "--rate", "4000", "--exposure", "0", "-q") == 0
    second = read_observation(tmp_path / "again" / "observations" / "outlines_hsv").recordings[0]
    seen = read_observation(known).recordings[0]
    assert isinstance(seen, Frames)
    for k, (a, b) in enumerate(zip(first, second, strict=True)):  # type: ignore[call-overload]
        np.testing.assert_array_equal(a.points_px, b.points_px)
        dark = np.argwhere(pictures[k] < middle)
        np.testing.assert_allclose(a.points_px.min(axis=0), dark.min(axis=0)[::-1] - 0.5, atol=0.01)
        np.testing.assert_allclose(a.points_px.max(axis=0), dark.max(axis=0)[::-1] + 0.5, atol=0.01)


def still(pictures: Pictures) -> Pictures:
    """The first picture five times before the flight."""
    return [*[pictures[0]] * 5, *pictures]


@pytest.mark.parametrize("taken", ["first:5", "FILE"])
def test_a_particle_that_stands_still_is_no_background(
    taken: str, known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_mraw(tmp_path / f"{NAME}.mraw", still(pictures), how, bits=12)
    tifffile.imwrite(tmp_path / "background.tif", pictures[0], photometric="minisblack")
    said = taken if taken != "FILE" else str(tmp_path / "background.tif")
    assert imported(tmp_path / f"{NAME}.mraw", known, tmp_path / "out", "--background", said) == 2
    assert "a particle that stands still is not background" in capsys.readouterr().err
    assert not (tmp_path / "out" / "observations").exists()


@pytest.mark.usefixtures("blind")
@pytest.mark.parametrize("taken", ["first:3", "FILE"])
def test_a_background_without_the_particle(taken: str, known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    empty = np.full_like(pictures[0], int(np.median(pictures[0])))
    write_mraw(tmp_path / f"{NAME}.mraw", [empty] * 3 + pictures, how, bits=12)
    Image.fromarray(empty).save(tmp_path / "background.png")
    said = taken if taken != "FILE" else str(tmp_path / "background.png")
    assert imported(tmp_path / f"{NAME}.mraw", known, tmp_path / "out", "--background", said, "-q") == 0
    (recording,) = read_observation(tmp_path / "out" / "observations" / NAME).recordings
    assert isinstance(recording, Frames)
    np.testing.assert_array_equal(recording.background(), empty)


BAD = {
    "frames beyond the end": (["--frames", "5:99"], "--frames 5:99: expected pictures of 0:12"),
    "a range that is none": (["--frames", "7:5"], "--frames 7:5: expected FIRST:END"),
    "bits that are too few": (["--bits", "8"], "frame 0: expected values of 8 bit, got"),
    "a rate that is none": (["--rate", "fast"], "--rate fast: expected a number with Hz, fps, kHz, MHz"),
    "gravity that is none": (["--gravity", "up"], "--gravity up: expected down, three numbers"),
    "an exposure longer than a frame": (
        ["--exposure", "1ms"],
        "drop.mraw: at $.clock.exposure_s: expected at most the time between two frames",
    ),
    "too many background pictures": (["--background", "first:99"], "expected first:N with N from 1 to 12"),
    "no such background": (["--background", "nothing.png"], "nothing.png: there is no such file"),
    "two cameras of one": (["--camera", "x.toml"], "--camera: expected one calibration for all videos"),
}


@pytest.mark.parametrize("what", list(BAD))
def test_what_is_refused(
    what: str, known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words, said = BAD[what]
    write_mraw(tmp_path / f"{NAME}.mraw", pictures, how, bits=12)
    assert imported(tmp_path / f"{NAME}.mraw", known, tmp_path / "out", *words) == 2
    assert said in capsys.readouterr().err
    assert {path.name for path in (tmp_path / "out").rglob("*")} <= {"run.json", ".tumble-lock"}


def test_a_calibration_of_another_picture_size_is_refused(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_mraw(tmp_path / f"{NAME}.mraw", [picture[:100] for picture in pictures], how, bits=12)
    assert imported(tmp_path / f"{NAME}.mraw", known, tmp_path / "out") == 2
    assert "expected a calibration of pictures of 160 x 100 px" in capsys.readouterr().err


@pytest.mark.usefixtures("blind")
def test_of_several_recordings_a_damaged_one_loses_no_other(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("one", "two"):
        write_cine(tmp_path / f"{name}.cine", pictures, how, bits=12)
    (tmp_path / "three.cine").write_bytes((tmp_path / "one.cine").read_bytes()[:-1000])
    out = tmp_path / "out"
    videos = [tmp_path / f"{name}.cine" for name in ("one", "three", "two")]
    assert imported(videos, known, out) == 1
    assert "three.cine" in capsys.readouterr().err
    assert sorted(path.parent.name for path in out.glob(f"observations/*/{FILE}")) == ["one", "two"]
    shutil.copy(tmp_path / "one.cine", tmp_path / "three.cine")
    assert imported(videos, known, out, "--resume", "-q") == 0
    assert len(list(out.glob(f"observations/*/{FILE}"))) == 3


@pytest.mark.usefixtures("blind")
def test_two_cameras_of_one_flight(known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    for name in ("left", "right"):
        write_cine(tmp_path / f"{name}.cine", pictures, how, bits=12)
    out = tmp_path / "out"
    assert imported([tmp_path / "left.cine", tmp_path / "right.cine"], known, out, "--camera", str(known), "-q") == 0
    made = read_observation(out / "observations" / "left")
    assert [camera.name for camera in made.cameras] == ["hsv_1", "hsv_2"]


@pytest.mark.parametrize(("file", "count"), [("ball_12bit.mraw", 15), ("cine_781.cine", 15)])
def test_real_recordings_import_with_one_command(file: str, count: int, shared_data: Path, tmp_path: Path) -> None:
    assert main(["import", str(shared_data / "video" / file), "--out", str(tmp_path / "out"), "-q"]) == 1
    draft = tomllib.loads((tmp_path / "out" / "draft.toml").read_text())
    assert set(draft["missing"]) == {"camera", "particle", "gravity"}
    assert draft["frames"]["value"] == f"0:{count} of {count}"


def test_the_real_balls_centre_moves_on_a_line(shared_data: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from datasets.video import open_video
    from tumble.importing.clip import clip_of

    clip, _ = clip_of(open_video(shared_data / "video" / "ball_12bit.mraw"), (None, None), None)
    path = inspect_recording(clip, (384, 384)).path
    line = np.column_stack([np.ones(15), path.frame])
    off = path.c - line @ np.linalg.lstsq(line, path.c, rcond=None)[0]
    with capsys.disabled():
        print(f"\nthe real ball's centre is {np.abs(off).max():.4f} px from a line at most")
    assert np.abs(off).max() < 0.02


@pytest.mark.usefixtures("blind")
def test_cameras_of_one_flight_keep_their_own_times(known: Path, pictures: Pictures, how: Recorded, tmp_path: Path) -> None:
    stamps = np.arange(len(pictures)) / how.rate_hz
    for name, taken, later in (("left", pictures, 0.0), ("right", pictures[:-2], 40e-6)):
        write_cine(tmp_path / f"{name}.cine", taken, how, bits=12, stamps_s=stamps[: len(taken)] + later)
    videos, out = [tmp_path / "left.cine", tmp_path / "right.cine"], tmp_path / "out"
    assert imported(videos, known, out, "--camera", str(known), "--clock-sigma", "20us", "-q") == 0
    made = read_observation(out / "observations" / "left")
    first, second = made.clocks
    assert second.times_s == pytest.approx(first.times_s[: len(second.times_s)] + 40e-6, abs=2e-9)
    assert (len(first.times_s) - len(second.times_s), second.offset_sigma_s) == (2, pytest.approx(20e-6))
    told = tomllib.loads((out / "observations" / "left" / "import.toml").read_text())
    assert told["clock_of_hsv_2"]["origin"] == "read"
    assert [told[name]["value"].rsplit("/")[-1] for name in ("video", "video_2")] == ["left.cine", "right.cine"]


@pytest.mark.usefixtures("blind")
def test_cameras_whose_clocks_do_not_overlap(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    stamps = np.arange(len(pictures)) / how.rate_hz
    for name, later in (("left", 0.0), ("right", 1.0)):
        write_cine(tmp_path / f"{name}.cine", pictures, how, bits=12, stamps_s=stamps + later)
    videos, out = [tmp_path / "left.cine", tmp_path / "right.cine"], tmp_path / "out"
    assert imported(videos, known, out, "--camera", str(known), "-q") == 2
    assert "their clocks do not overlap" in capsys.readouterr().err


@pytest.mark.usefixtures("blind")
def test_a_camera_without_times_has_those_of_the_first(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_cine(tmp_path / "left.cine", pictures, how, bits=12)
    tifffile.imwrite(tmp_path / "right.tif", np.stack(pictures[:-1]))
    videos = [tmp_path / "left.cine", tmp_path / "right.tif"]
    assert imported(videos, known, tmp_path / "out", "--camera", str(known), "--bits", "12", "-q") == 2
    assert "expected as many pictures as the flight's first camera took" in capsys.readouterr().err
    tifffile.imwrite(tmp_path / "right.tif", np.stack(pictures))
    assert imported(videos, known, tmp_path / "out", "--camera", str(known), "--bits", "12", "--force", "-q") == 0
    assert read_observation(tmp_path / "out" / "observations" / "left").camera_clocks == ()
    tifffile.imwrite(tmp_path / "right.tif", np.stack(pictures[:-1]))
    words = ["--camera", str(known), "--bits", "12", "--rate", "4kHz", "--exposure", "20us", "--force", "-q"]
    assert imported(videos, known, tmp_path / "out", *words) == 2
    assert "expected as many pictures as the flight's first camera took" in capsys.readouterr().err


@pytest.mark.usefixtures("blind")
def test_a_spread_of_clocks_needs_several_cameras(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_cine(tmp_path / "left.cine", pictures, how, bits=12)
    assert imported([tmp_path / "left.cine"], known, tmp_path / "out", "--clock-sigma", "50us", "-q") == 2
    assert "expected several cameras of one flight, got one" in capsys.readouterr().err


@pytest.mark.usefixtures("blind")
def test_how_well_lengths_are_known(
    known: Path, pictures: Pictures, how: Recorded, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A share, in per cent where that is written; what cannot be one leaves no observation behind."""
    write_cine(tmp_path / "left.cine", pictures, how, bits=12)
    out = tmp_path / "out"
    made = out / "observations" / "left"
    for wrong in ("1", "20%", "0.1mm"):
        assert imported([tmp_path / "left.cine"], known, out, "--length-sigma", wrong, "-q") == 2
        assert "expected" in capsys.readouterr().err
        assert not made.exists()
    for said, sigma in (("0.1%", 1e-3), ("2e-3", 2e-3), ("0", None)):
        assert imported([tmp_path / "left.cine"], known, out, "--length-sigma", said, "--force", "-q") == 0
        assert read_observation(made).sigma_length_scale == (None if sigma is None else pytest.approx(sigma))
        assert ("lengths" in tomllib.loads((made / "import.toml").read_text())) is (sigma is not None)
