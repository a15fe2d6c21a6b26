"""What is rendered lies where the camera model projects it: centroid and area of the coverage against the exact outline."""

import numpy as np
import pytest
import shapely

from datasets.vocabulary.camera import Intrinsics
from synth.rendering.camera import ThinLens, thin_lens
from synth.rendering.window import pixel_grid, whole_picture, window_around
from synth.silhouette import exact_outline, outline_mesh

DISTORTION = (-0.4, 0.2, 0.002, -0.003, 0.0)
CAMERAS = {
    "centred": {},
    "principal point between pixels": {"cx_px": 41.27, "cy_px": 36.83},
    "principal point outside": {"cx_px": -431.6, "cy_px": 402.1},
    "unequal focal lengths": {"fx_px": 6100.0, "fy_px": 5900.0},
    "distorted, far from the axis": {"cx_px": -431.6, "cy_px": 402.1, "distortion": DISTORTION},
}


def compare(coverage, outline, intrinsics) -> tuple[np.ndarray, float]:
    """Offset of the coverage's centroid (px) and of its area, as a mean offset of the outline (px)."""
    polygon = shapely.Polygon(outline)
    weights = coverage.ravel()
    centroid = weights @ pixel_grid(whole_picture(intrinsics)) / weights.sum()
    return centroid - np.array(polygon.centroid.coords[0]), (weights.sum() - polygon.area) / polygon.length


@pytest.mark.parametrize("changes", CAMERAS.values(), ids=CAMERAS)
@pytest.mark.parametrize("lens", [ThinLens(0.0, 0.6), ThinLens(3.1e-3, 0.6)], ids=["pinhole", "f/16"])
def test_the_particle_lies_where_it_is_projected(room, pose, camera, pebble, changes, lens) -> None:
    intrinsics = camera(**changes)
    x, y = intrinsics.normalise(np.array([[50.3, 37.2]]))[0] * 600
    R, t = pose(x, y, turn=(0.3, -0.8, 0.5))
    coverage = room(pebble, intrinsics=intrinsics, lens=lens).take([(R, t)], samples=64).coverage
    offset, outward = compare(coverage, exact_outline(outline_mesh(pebble.vertices, pebble.faces), intrinsics, R, t), intrinsics)
    assert np.abs(offset).max() < 0.02
    assert abs(outward) < 0.02


def test_a_long_lens_is_exact_in_single_precision(room, pose, pebble) -> None:
    intrinsics = Intrinsics(320, 240, 76000.0, 76000.0, 159.5, 119.5)
    R, t = pose(0.11, -0.07, 1.292, turn=(1.0, 0.2, -0.4))
    coverage = room(pebble, intrinsics=intrinsics, lens=thin_lens(intrinsics, 64.0, 1.292)).take([(R, t)], samples=16).coverage
    offset, outward = compare(coverage, exact_outline(outline_mesh(pebble.vertices, pebble.faces), intrinsics, R, t), intrinsics)
    assert np.abs(offset).max() < 0.02
    assert abs(outward) < 0.02


def test_the_aperture_follows_from_f_number_and_focus(camera) -> None:
    lens = thin_lens(camera(), 16.0, 0.6)
    assert lens.aperture_radius_m == pytest.approx(0.1 / 32)
    assert lens.focus_m == 0.6


def test_windows_are_cut_off_at_the_edges(camera) -> None:
    window = window_around(np.array([[-20.0, 10.2], [5.5, 30.7]]), 3, camera())
    assert (window.x0, window.y0, window.width, window.height) == (0, 7, 10, 28)
    assert window_around(np.array([[-50.0, 10.0], [-40.0, 20.0]]), 3, camera()).empty


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm"])
def test_a_chip_lies_where_its_own_poses_put_it(room, pose, camera, pebble, llvm, variant) -> None:
    """In each sub-frame, however the particle turns."""
    vertices, faces = 0.4 * pebble.vertices, pebble.faces
    seen = room(pebble, chip=(vertices, faces), variant=llvm() if variant == "llvm" else variant)
    poses = [pose(-2.0, 0.5, turn=(0.3, -0.8, 0.5)), pose(-1.9, 0.5, turn=(0.4, -0.8, 0.5))]
    chips = [pose(2.5, -1.0, turn=(-0.5, 0.2, 1.0)), pose(2.9, -1.2, turn=(-0.2, 0.2, 1.0))]
    coverage = seen.take(poses, samples=64, chips=chips).coverage
    right = np.arange(coverage.shape[1]) > 50
    assert coverage[:, 44:51].max() == 0.0
    mesh, centres, areas = outline_mesh(vertices, faces), [], []
    for R, t in chips:
        polygon = shapely.Polygon(exact_outline(mesh, camera(), R, t))
        centres.append(np.array(polygon.centroid.coords[0]) * polygon.area)
        areas.append(polygon.area)
    weights = (coverage * right).ravel()
    np.testing.assert_allclose(weights.sum(), np.mean(areas), rtol=0.02)
    np.testing.assert_allclose(weights @ pixel_grid(whole_picture(camera())) / weights.sum(), sum(centres) / sum(areas), atol=0.03)
