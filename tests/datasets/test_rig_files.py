"""Rigs from other programs' files are the cameras that were written, in metres, pixels from 0, the first camera's frame."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from scipy.io import savemat
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.rig_files.handedness import in_front, inside_out
from datasets.rig_files.matrices import decomposed
from datasets.rig_files.opening import Convention, read_rig
from datasets.vocabulary.camera import HsvCamera, Intrinsics

SIZE = (640, 480)
BENT = (-0.1, 0.02, 1e-4, -2e-4, 0.01)


def cameras(distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)) -> list[HsvCamera]:
    """Two cameras, neither of them the world."""
    turns = [Rotation.from_rotvec(v).as_matrix() for v in ([0.1, -0.2, 0.3], [0.2, 0.9, -0.1])]
    lenses = [Intrinsics(*SIZE, f, f + 4, 310.0 + f / 100, 245.0, distortion) for f in (1500.0, 1800.0)]
    return [HsvCamera(f"c{k}", lenses[k], turns[k], np.array([0.05 * k, 0.01, 0.8])) for k in range(2)]


def P_of(camera: HsvCamera) -> np.ndarray:
    return camera.intrinsics.K @ np.column_stack([camera.R_cam_world, camera.t_cam_world])


def same(found: tuple[HsvCamera, ...], true: list[HsvCamera], tolerance: float = 1e-6) -> None:
    """The same lenses and the same relative poses."""
    for camera, want in zip(found, true, strict=True):
        np.testing.assert_allclose(camera.intrinsics.K, want.intrinsics.K, atol=1e-5)
        np.testing.assert_allclose(camera.intrinsics.distortion, want.intrinsics.distortion)
        R = want.R_cam_world @ true[0].R_cam_world.T
        np.testing.assert_allclose(camera.R_cam_world, R, atol=tolerance)
        np.testing.assert_allclose(camera.t_cam_world, want.t_cam_world - R @ true[0].t_cam_world, atol=tolerance)


def test_matrices_of_any_scale_and_form(tmp_path: Path) -> None:
    true = cameras()
    stacked = np.stack([scale * P_of(c) for scale, c in zip((-3.0, 0.5), true, strict=True)])
    np.save(tmp_path / "rig.npy", stacked)
    np.savetxt(tmp_path / "rig.csv", stacked.reshape(-1, 4), delimiter=",")
    np.savetxt(tmp_path / "dlt.csv", np.stack([(P / P[2, 3]).ravel()[:11] for P in stacked], axis=1), delimiter=",")
    shift = np.array([[1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])  # MATLAB's first pixel is (1, 1)
    savemat(tmp_path / "rig.mat", {"P10": shift @ stacked[1], "P2": shift @ stacked[0]})
    savemat(tmp_path / "one.mat", {"cameras": np.moveaxis(shift @ stacked, 0, 2)}, do_compression=True)
    cells = np.empty((1, 2), dtype=object)
    cells[0, :] = [shift @ P for P in stacked]
    savemat(tmp_path / "cells.mat", {"P": cells})
    for name in ("rig.npy", "rig.csv", "dlt.csv", "rig.mat", "one.mat", "cells.mat"):
        found, notes = read_rig([tmp_path / name], Convention(size=SIZE))
        same(found, true)
        assert any("first pixel" in note for note in notes)


def test_millimetres_are_stated(tmp_path: Path) -> None:
    true = cameras()
    np.save(tmp_path / "rig.npy", np.stack([c.intrinsics.K @ np.column_stack([c.R_cam_world, 1e3 * c.t_cam_world]) for c in true]))
    same(read_rig([tmp_path / "rig.npy"], Convention("mm", SIZE))[0], true)
    with pytest.raises(InputError, match="millimetres taken for metres"):
        read_rig([tmp_path / "rig.npy"], Convention("m", SIZE))


def test_opencv_files(tmp_path: Path) -> None:
    true = cameras(BENT)
    for camera in true:
        storage = cv2.FileStorage(str(tmp_path / f"{camera.name}.yml"), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", SIZE[0])
        storage.write("image_height", SIZE[1])
        storage.write("camera_matrix", camera.intrinsics.K)
        storage.write("distortion_coefficients", np.array([BENT]))
        storage.write("R", camera.R_cam_world)
        storage.write("T", camera.t_cam_world[:, None])
        storage.release()
    same(read_rig([tmp_path / "c0.yml", tmp_path / "c1.yml"], Convention())[0], true)
    pair = cv2.FileStorage(str(tmp_path / "pair.yml"), cv2.FILE_STORAGE_WRITE)
    R = true[1].R_cam_world @ true[0].R_cam_world.T
    for name, value in (("M1", true[0].intrinsics.K), ("D1", np.array([BENT])), ("M2", true[1].intrinsics.K), ("D2", np.array([BENT]))):
        pair.write(name, value)
    pair.write("R", R)
    pair.write("T", true[1].t_cam_world - R @ true[0].t_cam_world)
    pair.release()
    same(read_rig([tmp_path / "pair.yml"], Convention(size=SIZE))[0], true)
    with pytest.raises(InputError, match="state --size"):
        read_rig([tmp_path / "pair.yml"], Convention())


MODEL = """{{ # made by mrcal
    'lensmodel':  '{model}',
    'intrinsics': [ {numbers}, ],
    'extrinsics': [ {pose}, ],
    'imagersize': [ 640, 480 ],
    'icam_intrinsics': 0,
}}
"""


def model(camera: HsvCamera, name: str = "LENSMODEL_OPENCV5", more: tuple[float, ...] = ()) -> str:
    lens = camera.intrinsics
    numbers = (lens.fx_px, lens.fy_px, lens.cx_px, lens.cy_px, *lens.distortion, *more)
    pose = (*Rotation.from_matrix(camera.R_cam_world).as_rotvec(), *camera.t_cam_world)
    return MODEL.format(model=name, numbers=", ".join(map(repr, map(float, numbers))), pose=", ".join(map(repr, map(float, pose))))


def test_mrcals_camera_models(tmp_path: Path) -> None:
    true = cameras(BENT)
    paths = [tmp_path / f"{camera.name}.cameramodel" for camera in true]
    for path, camera in zip(paths, true, strict=True):
        path.write_text(model(camera), encoding="utf-8")
    same(read_rig(paths, Convention())[0], true)
    paths[0].write_text(model(true[0], "LENSMODEL_OPENCV8", (0.1, 0.0, 0.0)), encoding="utf-8")
    with pytest.raises(InputError, match="at most five terms"):
        read_rig(paths, Convention())
    paths[0].write_text(model(true[0], "LENSMODEL_SPLINED_STEREOGRAPHIC_order=3"), encoding="utf-8")
    with pytest.raises(InputError, match="expected lensmodel LENSMODEL_PINHOLE or"):
        read_rig(paths, Convention())


def test_what_is_no_camera_is_refused(tmp_path: Path) -> None:
    P = P_of(cameras()[0])
    with pytest.raises(InputError, match=r"lean by at most 0\.57 degrees, got a matrix with 2\.86"):
        decomposed(np.array([[1.0, 5e-2, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) @ P, SIZE, "x", "x")
    with pytest.raises(InputError, match="no inverse"):
        decomposed(np.zeros((3, 4)), SIZE, "x", "x")
    wrong = (("1,2,3\n", "3 x 4 matrices"), ("a,b\n", "expected rows"), ("", "expected rows"), ("1,2\n1\n", "different length"))
    for text, expected in wrong:
        (tmp_path / "x.csv").write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=expected):
            read_rig([tmp_path / "x.csv"], Convention(size=SIZE))
    np.save(tmp_path / "x.npy", np.zeros((2, 3, 4)))
    with pytest.raises(InputError, match="expected --size"):
        read_rig([tmp_path / "x.npy"], Convention())


def test_a_small_skew_is_dropped_and_said(tmp_path: Path) -> None:
    """Pixels of the camera differ from those of the matrix by what is said, and nowhere by more."""
    P = P_of(cameras()[0])
    leaning = np.array([[1.0, 4e-3, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]) @ P
    found = decomposed(leaning, SIZE, "x", "x")
    rng = np.random.default_rng(1)
    middle = np.array([found.camera.intrinsics.cx_px, found.camera.intrinsics.cy_px])
    corners = np.array([[-0.5, -0.5], [639.5, -0.5], [-0.5, 479.5], [639.5, 479.5]])
    pixels = np.concatenate([corners, rng.uniform([-0.5, -0.5], [639.5, 479.5], (200, 2))])
    rays = np.linalg.solve(leaning[:, :3], np.column_stack([pixels, np.ones(204)]).T).T
    points = rays * rng.uniform(0.5, 2.0, (204, 1)) - np.linalg.solve(leaning[:, :3], leaning[:, 3])
    seen = (P_of(found.camera) @ np.column_stack([points, np.ones(204)]).T).T
    seen = seen[:, :2] / seen[:, 2:]
    np.testing.assert_allclose(seen, (pixels - middle) @ found.moved.T + middle, atol=1e-8)
    assert np.linalg.norm(seen - pixels, axis=1).max() == pytest.approx(found.farthest_px, rel=1e-9)
    assert found.farthest_px < 0.9 * 4e-3 * 245.0  # of all that leans half is a turn of the camera
    np.save(tmp_path / "rig.npy", np.stack([leaning, P_of(cameras()[1])]))
    assert f"points up to {found.farthest_px:.2g} px elsewhere" in " ".join(read_rig([tmp_path / "rig.npy"], Convention(size=SIZE))[1])
    np.save(tmp_path / "rig.npy", np.stack([P_of(c) for c in cameras()]))
    assert "elsewhere" not in " ".join(read_rig([tmp_path / "rig.npy"], Convention(size=SIZE))[1])


def test_a_mirrored_world_is_turned_inside_out(tmp_path: Path) -> None:
    true = cameras()
    np.save(tmp_path / "rig.npy", np.stack([P_of(c) @ np.diag([-1.0, -1.0, -1.0, 1.0]) for c in true]))
    found, notes = read_rig([tmp_path / "rig.npy"], Convention(size=SIZE))
    same(found, true)
    assert any("turned inside out (X to -X)" in note for note in notes)
    np.save(tmp_path / "rig.npy", np.stack([P_of(c) for c in true]))
    assert not any("inside out" in note for note in read_rig([tmp_path / "rig.npy"], Convention(size=SIZE))[1])


def test_cameras_of_two_worlds_are_refused(tmp_path: Path) -> None:
    one, other = cameras()
    np.save(tmp_path / "rig.npy", np.stack([P_of(one), *(P_of(c) for c in inside_out([other]))]))
    with pytest.raises(InputError, match=r"see one place, got no place .* behind rig_2 and in front of the others"):
        read_rig([tmp_path / "rig.npy"], Convention(size=SIZE))


def test_cameras_side_by_side_that_diverge_a_little_stay(tmp_path: Path) -> None:
    """Their axes come closest behind them, and both see what is far enough."""
    lens = cameras()[0].intrinsics
    pair = [
        HsvCamera(f"c{k}", lens, Rotation.from_rotvec([0.0, -0.01 * side, 0.0]).as_matrix(), np.array([-0.05 * side, 0.0, 0.0]))
        for k, side in enumerate((-1.0, 1.0))
    ]
    assert in_front(pair, "x") == (tuple(pair), ())
    np.save(tmp_path / "rig.npy", np.stack([P_of(c) for c in pair]))
    same(read_rig([tmp_path / "rig.npy"], Convention(size=SIZE))[0], pair)


def test_a_published_set_of_real_matrices_goes_in(shared_data: Path) -> None:
    """Oxford's turntable: skew of an upgrade to metric, and a mirrored world."""
    path = shared_data / "silhouettes" / "oxford_dino" / "P_metric_upgraded_36x3x4.npy"
    found, notes = read_rig([path], Convention(size=(720, 576)))
    assert len(found) == 36
    assert "up to 0.63 px elsewhere" in " ".join(notes)
    assert "turned inside out" in " ".join(notes)
    with pytest.raises(InputError, match="no camera of a metric world"):
        read_rig([path.with_name("dino_Ps.mat")], Convention(size=(720, 576)))
