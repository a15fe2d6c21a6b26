"""The outline is the outline: against hulls, rasterised faces, regions between noded contour edges and known bodies."""

from pathlib import Path

import cv2
import numpy as np
import pytest
import shapely
import trimesh
from scipy.spatial.transform import Rotation

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import signed_area
from synth.particles.family import procedural
from synth.particles.mesh_import import read_mesh
from synth.silhouette import OutlineMesh, contour_edges, exact_outline, outline_mesh
from synth.silhouette.outer_ring import outer_ring

HSV = Intrinsics(1024, 1024, 6000.0, 6000.0, 511.5, 511.5)
BENT = Intrinsics(1024, 1024, 900.0, 880.0, 500.0, 530.0, (-0.2, 0.05, 1e-3, -5e-4, 0.0))


def bodies() -> list[trimesh.Trimesh]:
    return [
        procedural(family, 0.6, np.random.default_rng(3))  # type: ignore[arg-type]
        for family in ("ellipsoid", "cut_stone", "jagged")
    ]


def scaled(mesh: trimesh.Trimesh, size: float = 6e-3) -> OutlineMesh:
    return outline_mesh((mesh.vertices - mesh.vertices.mean(axis=0)) / mesh.extents.max() * size, np.asarray(mesh.faces))


def pose(seed: int, z: float = 0.6) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return Rotation.random(rng=rng).as_matrix(), np.array([*rng.normal(0, 5e-3, size=2), z])


def projected(mesh: OutlineMesh, camera: Intrinsics, R: np.ndarray, t: np.ndarray) -> np.ndarray:
    return camera.project(mesh.vertices @ R.T + t)


def enclosed(segments: np.ndarray) -> shapely.Polygon:
    """All that ``segments`` (s, 2, 2) enclose, the largest part, without its holes: an independent way to the outline."""
    regions = shapely.polygonize([shapely.node(shapely.multilinestrings(segments))])
    filled = shapely.polygons(shapely.get_exterior_ring(shapely.get_parts(shapely.coverage_union_all([regions]))))
    return filled[np.argmax(shapely.area(filled))]


def check_ring(px: np.ndarray, edges: np.ndarray) -> np.ndarray:
    ring, expected = outer_ring(px, edges), enclosed(px[edges])
    assert shapely.polygons(ring).is_valid
    assert shapely.polygons(ring).symmetric_difference(expected).area < 1e-9
    assert shapely.hausdorff_distance(shapely.linearrings(ring), expected.exterior) < 1e-8
    return ring


def check_hull(mesh: OutlineMesh, R: np.ndarray, t: np.ndarray) -> None:
    outline = exact_outline(mesh, HSV, R, t)
    of_vertices = shapely.convex_hull(shapely.multipoints(projected(mesh, HSV, R, t)))
    of_outline = shapely.convex_hull(shapely.multipoints(outline))
    assert shapely.hausdorff_distance(of_vertices, of_outline) < 1e-9
    assert signed_area(outline) > 0
    assert shapely.polygons(outline).is_valid


@pytest.mark.parametrize("body", range(3))
@pytest.mark.parametrize("seed", range(3))
def test_hull_of_the_outline_is_hull_of_the_vertices(body: int, seed: int) -> None:
    check_hull(scaled(bodies()[body]), *pose(seed))


@pytest.mark.parametrize("name", ["stone_09", "stone_05", "imaged_deimos", "savaas_S01"])
def test_outlines_of_scanned_particles(shared_data: Path, name: str) -> None:
    mesh = scaled(read_mesh(shared_data / "particles" / f"{name}.ply"))
    for seed in range(3):
        check_hull(mesh, *pose(seed))
        px = projected(mesh, HSV, *pose(seed))
        check_ring(px, contour_edges(mesh, px))


@pytest.mark.parametrize("body", range(3))
def test_area_is_that_of_the_rasterised_faces(body: int) -> None:
    mesh = scaled(bodies()[body])
    R, t = pose(4)
    outline = exact_outline(mesh, HSV, R, t)
    origin = outline.min(axis=0) - 2
    magnification = 20
    corners = np.rint(((projected(mesh, HSV, R, t) - origin) * magnification)[mesh.faces] * 256).astype(np.int32)
    mask = np.zeros((90 * magnification, 90 * magnification), dtype=np.uint8)
    for triangle in corners:
        cv2.fillConvexPoly(mask, triangle, 255, cv2.LINE_8, 8)
    contours, _ = cv2.findContours(mask, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(mask, contours, -1, 255, cv2.FILLED)
    # OpenCV paints every cell that an edge touches: about half a cell all round the boundary.
    excess = np.count_nonzero(mask) / magnification**2 - signed_area(outline)
    length = shapely.linearrings(outline).length
    assert 0 < excess < 1.2 * length / magnification


def test_a_sphere_is_seen_as_the_perspective_circle() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=5)
    radius, z = 3e-3, 0.05
    mesh = outline_mesh(sphere.vertices * radius, np.asarray(sphere.faces))
    outline = exact_outline(mesh, HSV, np.eye(3), np.array([0.0, 0.0, z]))
    seen = np.hypot(*(outline - 511.5).T)
    expected = 6000 * radius / np.sqrt(z**2 - radius**2)
    # A polyhedron inscribed in the sphere: its edges, of about 0.035 radius, cut off up to 0.035²/8.
    assert np.all(seen <= expected * (1 + 1e-12))
    assert seen.min() > expected * (1 - 4e-4)


def test_holes_are_filled() -> None:
    ring = trimesh.creation.torus(4e-3, 1e-3, major_sections=48, minor_sections=24)
    outline = exact_outline(scaled(ring, 10e-3), HSV, np.eye(3), np.array([0.0, 0.0, 0.6]))
    radii = np.hypot(*(outline - 511.5).T)
    assert radii.min() > 0.98 * radii.max()


def test_distortion_bends_the_long_edges_of_a_box() -> None:
    box = trimesh.creation.box((0.5, 0.5, 0.01))
    mesh = outline_mesh(box.vertices, np.asarray(box.faces))
    outline = exact_outline(mesh, BENT, np.eye(3), np.array([0.0, 0.0, 0.6]))
    edge = np.column_stack([np.linspace(-0.25, 0.25, 5001), np.full(5001, 0.25), np.full(5001, 0.595)])
    on_edge = BENT.project(edge)
    chord = shapely.distance(shapely.linearrings(outline), shapely.points(on_edge))
    assert chord.max() < 2e-4
    straight = on_edge[0] + np.linspace(0, 1, 5001)[:, None] * (on_edge[-1] - on_edge[0])
    assert np.abs(straight - on_edge).max() > 5


def apart(gap: float, *shares: float) -> trimesh.Trimesh:
    """Jagged bodies of the given sizes beside each other along x."""
    parts = [procedural("jagged", 0.9, np.random.default_rng(5)).apply_scale(share) for share in shares]
    return trimesh.util.concatenate([part.apply_translation([k * gap, 0.0, 0.0]) for k, part in enumerate(parts)])


@pytest.mark.parametrize(
    "body",
    [*bodies(), trimesh.creation.torus(4e-3, 1e-3, major_sections=48, minor_sections=24), apart(0.5, 1.0, 0.7), apart(20.0, 0.7, 1.0, 0.9)],
    ids=["ellipsoid", "cut_stone", "jagged", "torus", "two that overlap", "three apart"],
)
def test_the_ring_is_that_of_all_that_contour_edges_enclose(body: trimesh.Trimesh) -> None:
    mesh = scaled(body)
    for seed in range(4):
        px = projected(mesh, HSV, *pose(seed))
        edges = contour_edges(mesh, px)
        ring = check_ring(px, edges)
        for unit in (1.3e-7, 7e5):
            np.testing.assert_allclose(outer_ring(unit * px, edges) / unit, ring, rtol=0, atol=1e-8)


def test_the_ring_ends_with_the_first_edge_on_it() -> None:
    mesh = scaled(bodies()[0])
    px = projected(mesh, HSV, *pose(2))
    edges = contour_edges(mesh, px)
    np.testing.assert_allclose(outer_ring(px, edges)[[-1, 0]], px[edges[0]], rtol=0, atol=1e-10)


def test_faces_seen_from_the_side_add_nothing() -> None:
    box = trimesh.creation.box((1.0, 2.0, 3.0))
    mesh = outline_mesh(box.vertices, np.asarray(box.faces))
    for R in (np.eye(3), Rotation.from_euler("z", 30, degrees=True).as_matrix(), Rotation.from_euler("x", 40, degrees=True).as_matrix()):
        px = (mesh.vertices @ R.T)[:, :2]  # from afar, along at least two of its faces
        check_ring(px, contour_edges(mesh, px))


def test_several_loops_may_meet_at_a_vertex() -> None:
    mesh = scaled(procedural("jagged", 0.9, np.random.default_rng(5)))
    px = projected(mesh, HSV, *pose(6))
    edges = contour_edges(mesh, px)
    assert np.bincount(edges[:, 0]).max() > 1
    check_ring(px, edges)


def test_two_bodies_that_share_an_edge_have_it_twice() -> None:
    one = trimesh.creation.box((1.0, 1.0, 1.0))
    pair = trimesh.util.concatenate([one, one.copy().apply_translation([1.0, 1.0, 0.0])])
    pair.merge_vertices()
    mesh = outline_mesh(pair.vertices, np.asarray(pair.faces))
    assert len(mesh.edges) == 36
    R = Rotation.from_euler("xyz", [20, 30, 10], degrees=True).as_matrix()
    px = (mesh.vertices @ R.T)[:, :2]
    check_ring(px, contour_edges(mesh, px))


def test_an_open_mesh_is_refused() -> None:
    body = bodies()[0]
    with pytest.raises(ValueError, match="expected a closed mesh"):
        outline_mesh(body.vertices, np.asarray(body.faces)[1:])


def test_a_body_behind_the_camera_is_refused() -> None:
    with pytest.raises(ValueError, match="in front of the camera"):
        exact_outline(scaled(bodies()[0]), HSV, np.eye(3), np.zeros(3))


def test_a_kept_outline_is_that_of_its_own_pose_and_camera() -> None:
    mesh = scaled(bodies()[0])
    (R, t), (other, _) = pose(3), pose(4)
    first = exact_outline(mesh, HSV, R, t)
    for changed in ((BENT, R, t), (HSV, other, t), (HSV, R, 1.1 * t)):
        assert not np.array_equal(exact_outline(mesh, *changed), first)
    again = exact_outline(outline_mesh(mesh.vertices.copy(), mesh.faces.copy()), HSV, R, t)
    assert np.array_equal(again, first)
    again[:] = 0.0
    assert np.array_equal(exact_outline(mesh, HSV, R, t), first)
    assert not np.array_equal(exact_outline(outline_mesh(1.1 * mesh.vertices, mesh.faces), HSV, R, t), first)
