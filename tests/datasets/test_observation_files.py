import ast
import json
import pickle
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.observation import CalibratedView, Frames, Observation
from datasets.observation_files import frames_file, read_observation, write_observation
from datasets.outline_files import read_outlines, write_outlines
from datasets.plausibility import LARGEST_UNDISTORTION_ERROR_PX, undistortion_error_px
from datasets.plausible_pace import check_pace
from datasets.tiff_frames import FrameStackWriter, TiffFrames
from datasets.vocabulary.camera import HsvCamera, Intrinsics
from datasets.vocabulary.clock import Clock
from datasets.vocabulary.outline import Outline, oriented, signed_area


def assert_same(a: Observation, b: Observation) -> None:
    assert (a.name, a.mass_kg) == (b.name, b.mass_kg)
    assert np.array_equal(a.clock.times_s, b.clock.times_s)
    assert a.clock.exposure_s == b.clock.exposure_s
    assert np.array_equal(a.gravity_world, b.gravity_world)
    for one, other in zip(a.cameras, b.cameras, strict=True):
        assert (one.name, one.intrinsics) == (other.name, other.intrinsics)
        assert np.array_equal(one.R_cam_world, other.R_cam_world)
        assert np.array_equal(one.t_cam_world, other.t_cam_world)
    for view, twin in zip(a.views, b.views, strict=True):
        assert (view.intrinsics, view.drop, view.camera) == (twin.intrinsics, twin.drop, twin.camera)
        assert np.array_equal(view.R_cam_particle, twin.R_cam_particle)
        assert np.array_equal(view.t_cam_particle, twin.t_cam_particle)
    for mine, yours in zip((*a.recordings, a.view_recording), (*b.recordings, b.view_recording), strict=True):
        assert_same_recording(mine, yours)


def assert_same_recording(a, b) -> None:
    assert len(a) == len(b)
    for k in range(len(a)):
        if isinstance(a, Frames):
            assert np.array_equal(a.read(k), b.read(k))
            assert np.array_equal(a.background_of(k), b.background_of(k))
        else:
            assert np.array_equal(a[k].points_px, b[k].points_px)


def test_outlines_round_trip(outline_observation, tmp_path):
    write_observation(outline_observation, tmp_path / "o")
    assert_same(outline_observation, read_observation(tmp_path / "o"))


def test_the_principal_point_is_the_middle_of_the_picture_where_it_is_not_given(outline_observation, tmp_path):
    write_observation(outline_observation, tmp_path / "o")
    path = tmp_path / "o" / "observation.json"
    document = json.loads(path.read_text())
    given = document["cameras"][0]["intrinsics"]
    del given["cx_px"], given["cy_px"], document["sha256"]
    path.write_text(json.dumps(document))
    read = read_observation(tmp_path / "o").cameras[0].intrinsics
    assert (read.cx_px, read.cy_px) == ((given["width_px"] - 1) / 2, (given["height_px"] - 1) / 2)


def test_frames_round_trip(frame_observation, tmp_path):
    write_observation(frame_observation, tmp_path / "o")
    assert_same(frame_observation, read_observation(tmp_path / "o"))


def test_writing_twice_gives_the_same_bytes(frame_observation, tmp_path):
    for name in ("a", "b"):
        write_observation(frame_observation, tmp_path / name)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    assert names == ["background_hsv.tif", "frames_hsv.tif", "observation.json", "views.tif", "views_background.tif"]
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def test_a_stack_that_lies_there_already_is_not_written_again(frame_observation, tmp_path):
    folder = tmp_path / "o"
    with FrameStackWriter(folder / frames_file("hsv")) as writer:
        for k in range(5):
            writer.append(frame_observation.recordings[0].read(k))
    stamp = (folder / frames_file("hsv")).stat()
    obs = replace(frame_observation, recordings=(TiffFrames(folder / frames_file("hsv"), 12),))
    write_observation(obs, folder)
    after = (folder / frames_file("hsv")).stat()
    assert (after.st_ino, after.st_mtime_ns) == (stamp.st_ino, stamp.st_mtime_ns)
    assert_same(obs, read_observation(folder))


def test_rewriting_an_observation_read_from_the_same_folder_keeps_it(frame_observation, tmp_path):
    write_observation(frame_observation, tmp_path / "o")
    write_observation(read_observation(tmp_path / "o"), tmp_path / "o")
    assert_same(frame_observation, read_observation(tmp_path / "o"))


def test_frames_survive_pickling(frame_observation):
    copy = pickle.loads(pickle.dumps(frame_observation.recordings[0]))
    assert np.array_equal(copy.read(3), frame_observation.recordings[0].read(3))


def test_views_of_one_rig_camera_share_a_background(frame_observation, tmp_path):
    one_camera = tuple(replace(view, camera=4) for view in frame_observation.views)
    shared = TiffFrames(frame_observation.view_recording.path, 12, frame_observation.view_recording.background_path)
    write_observation(replace(frame_observation, views=one_camera, view_recording=shared), tmp_path / "o")
    views = read_observation(tmp_path / "o").view_recording
    assert len(TiffFrames(tmp_path / "o" / "views_background.tif", 12)) == 1
    assert np.array_equal(views.background_of(0), views.background_of(1))


@st.composite
def polygons(draw) -> Outline:
    count = draw(st.sampled_from([0, 3, 4, 17]))
    points = draw(hnp.arrays(np.float64, (count, 2), elements=st.floats(-50, 100)))
    turned = oriented(points)
    assume(signed_area(turned) >= 0)  # a polygon without area, whose sign is rounding, has no orientation to keep
    return Outline(turned)


@st.composite
def observations(draw) -> Observation:
    frames, views = draw(st.integers(1, 6)), draw(st.integers(0, 4))
    intrinsics = Intrinsics(
        64,
        48,
        draw(st.floats(300, 1e6)),
        draw(st.floats(300, 1e6)),
        draw(st.floats(-60, 60)),
        draw(st.floats(-40, 40)),
        tuple(draw(st.floats(-0.2, 0.2)) for _ in range(5)),
        None,
    )
    assume(undistortion_error_px(intrinsics) <= LARGEST_UNDISTORTION_ERROR_PX)  # others are refused, which has its own test
    steps = draw(hnp.arrays(np.float64, frames, elements=st.floats(1e-3, 0.1)))
    rotations = [Rotation.from_rotvec(draw(hnp.arrays(np.float64, 3, elements=st.floats(-3, 3)))).as_matrix() for _ in range(views + 1)]
    camera = HsvCamera("a.b-1", intrinsics, rotations[0], draw(hnp.arrays(np.float64, 3, elements=st.floats(-20, 20))))
    obs = Observation(
        name="x",
        cameras=(camera,),
        recordings=(tuple(draw(polygons()) for _ in range(frames)),),
        clock=Clock(np.cumsum(steps), 1e-5),
        gravity_world=draw(hnp.arrays(np.float64, 3, elements=st.floats(-20, 20))),
        views=tuple(CalibratedView(intrinsics, R, np.array([0.0, 0.0, 1.0]), k, k % 3) for k, R in enumerate(rotations[1:])),
        view_recording=tuple(draw(polygons()) for _ in range(views)),
        mass_kg=draw(st.none() | st.floats(1e-6, 10.0)),
    )
    assume(has_a_plausible_pace(obs))
    return obs


def has_a_plausible_pace(obs: Observation) -> bool:
    try:
        check_pace(obs, Path())
    except InputError:
        return False
    return True


SLOW = [HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]


@settings(max_examples=40, deadline=None, suppress_health_check=SLOW)
@given(obs=observations())
def test_any_observation_round_trips(obs, tmp_path_factory):
    folder = tmp_path_factory.mktemp("o")
    write_observation(obs, folder)
    assert_same(obs, read_observation(folder))


def test_outlines_are_turned_to_positive_area(tmp_path):
    write_outlines(tmp_path / "o.npz", [Outline(np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0]]))])
    assert signed_area(read_outlines(tmp_path / "o.npz")[0].points_px) == 0.5


def bad_outlines(path: Path, **arrays) -> None:
    np.savez(path, **arrays)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"points_px": np.zeros((4, 2))}, "without offsets"),
        ({"points_px": np.zeros((4, 3)), "offsets": np.array([0, 4])}, r"shape \(n, 2\), got float64 of shape \(4, 3\)"),
        ({"points_px": np.zeros((4, 2)), "offsets": np.array([0, 5])}, "rise from 0 to 4"),
        ({"points_px": np.zeros((4, 2)), "offsets": np.array([0, 2, 4])}, "frame 0: expected an outline of at least 3 points"),
        ({"points_px": np.full((4, 2), np.nan), "offsets": np.array([0, 4])}, "frame 0: expected finite"),
    ],
)
def test_bad_outline_files_are_named(tmp_path, arrays, message):
    path = tmp_path / "outlines_hsv.npz"
    bad_outlines(path, **arrays)
    with pytest.raises(InputError, match=message) as caught:
        read_outlines(path)
    assert str(path) in str(caught.value)


def test_a_single_array_is_no_outline_file(tmp_path):
    np.save(tmp_path / "o.npy", np.zeros(3))
    with pytest.raises(InputError, match=r"expected an \.npz file"):
        read_outlines(tmp_path / "o.npy")


@pytest.mark.parametrize("keep", [0, 10, 200, -5])
def test_truncated_outlines(outline_observation, tmp_path, keep):
    write_observation(outline_observation, tmp_path / "o")
    path = tmp_path / "o" / "outlines_hsv.npz"
    path.write_bytes(path.read_bytes()[:keep])
    with pytest.raises(InputError, match=r"outlines_hsv\.npz: expected an \.npz file, got one that is cut off"):
        read_observation(tmp_path / "o")


def test_reading_observations_needs_neither_truth_nor_recipes():
    code = "import sys, datasets.observation_files; print([m for m in sys.modules if m.startswith(('datasets.', 'mitsuba'))])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=Path(__file__).parents[2])
    loaded = ast.literal_eval(done.stdout)
    assert "datasets.observation" in loaded
    assert not [name for name in loaded if any(word in name for word in ("truth", "recipes", "scoring", "mitsuba"))]
