"""The visual hull and its mass properties against bodies known in closed form, and how the bias falls with views."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.errors import InputError
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.visual_hull import bounding_ball, visual_hull
from estimator.particle.mass_properties import body_of, largest_moment_per_mass
from synth.particles.family import procedural
from synth.particles.mass_properties import mass_properties
from synth.silhouette.exact_outline import exact_outline, outline_mesh
from tests.estimator.exact import ellipsoid_moments, ellipsoid_outlines, rig

Array = NDArray[np.float64]
SEMI_AXES = np.array([3.2e-3, 2.5e-3, 1.9e-3])


def solid(mesh: SurfaceMesh) -> trimesh.Trimesh:
    return trimesh.Trimesh(mesh.vertices, mesh.faces)


def ellipsoid_hull(drops: int, resolution: int = 64) -> SurfaceMesh:
    views = rig(drops)
    return visual_hull(ellipsoid_outlines(SEMI_AXES, views), views, resolution=resolution)


def ellipsoid_excess(mesh: SurfaceMesh) -> float:
    return solid(mesh).volume / (4.0 / 3.0 * np.pi * np.prod(SEMI_AXES)) - 1.0


@pytest.fixture(scope="module")
def hulls() -> dict[int, SurfaceMesh]:
    """Hulls of the ellipsoid by number of views."""
    return {6 * drops: ellipsoid_hull(drops) for drops in (1, 3, 10)}


def test_the_hull_is_closed_and_outward_and_holds_the_body(hulls: dict[int, SurfaceMesh]) -> None:
    mesh = solid(hulls[60])
    assert mesh.is_watertight
    assert mesh.volume > 0.0
    reach = np.linalg.norm(mesh.vertices / SEMI_AXES, axis=1)
    # Linear interpolation between voxels of 0.1 mm may cut into a curved surface by 0.1%.
    assert reach.min() > 0.998
    assert reach.max() < 1.02


def test_mass_properties_of_an_ellipsoid(hulls: dict[int, SurfaceMesh]) -> None:
    mesh = hulls[60]
    body = body_of(mesh)
    assert 0.0 < ellipsoid_excess(mesh) < 0.012
    np.testing.assert_allclose(body.com_particle, 0.0, atol=1e-6)
    np.testing.assert_allclose(body.inertia_ratios, ellipsoid_moments(SEMI_AXES), atol=0.003)
    np.testing.assert_allclose(np.abs(body.R_particle_body), np.eye(3), atol=0.005)
    assert np.linalg.det(body.R_particle_body) == pytest.approx(1.0)
    # (a² + b²) / 5 for the axis of the largest moment; a hull larger by a share s in every direction has (1 + s)² times that.
    assert largest_moment_per_mass(mesh) == pytest.approx(np.sum(SEMI_AXES[:2] ** 2) / 5.0, rel=0.01)


def test_the_excess_falls_with_views(hulls: dict[int, SurfaceMesh]) -> None:
    excess = [ellipsoid_excess(hulls[k]) for k in (6, 18, 60)]
    assert excess[0] > 1.5 * excess[1] > 0.0
    assert excess[1] > 1.5 * excess[2] > 0.0
    bias = [np.abs(body_of(hulls[k]).inertia_ratios - ellipsoid_moments(SEMI_AXES)).max() for k in (6, 60)]
    assert bias[0] > 2.0 * bias[1]


def test_a_cut_stone_off_the_origin() -> None:
    shape = procedural("cut_stone", 0.6, np.random.default_rng(2))
    vertices = np.asarray(shape.vertices) * 2.5e-3 + np.array([1e-3, 0.0, -5e-4])
    stone, known = outline_mesh(vertices, shape.faces), trimesh.Trimesh(vertices, shape.faces)
    views = rig(10)
    outlines = [Outline(exact_outline(stone, v.intrinsics, v.R_cam_particle, v.t_cam_particle)) for v in views]
    mesh = visual_hull(outlines, views)
    body = body_of(mesh)
    moments, axes = np.linalg.eigh(known.moment_inertia)
    assert 0.0 < solid(mesh).volume / known.volume - 1.0 < 0.03
    np.testing.assert_allclose(body.com_particle, known.center_mass, atol=5e-6)
    np.testing.assert_allclose(body.inertia_ratios, moments / moments[2], atol=0.004)
    assert np.all(np.abs(np.sum(axes * body.R_particle_body, axis=0)) > 0.999)
    # No vertex of the body lies further outside than the voxels (0.1 mm) round a corner off.
    faces = ConvexHull(mesh.vertices).equations
    assert (vertices @ faces[:, :3].T + faces[:, 3]).max() < 4e-5


def test_axes_have_the_signs_that_whoever_made_the_body_gave_them(hulls: dict[int, SurfaceMesh]) -> None:
    # A centre of mass in body axes means nothing where two sides sign the axes differently.
    mesh = hulls[18]
    whole = mass_properties(mesh.vertices, mesh.faces, 2700.0).body
    np.testing.assert_allclose(body_of(mesh).R_particle_body, whole.R_particle_body, atol=1e-6)


def test_mass_properties_do_not_mind_the_mesh_inside_out(hulls: dict[int, SurfaceMesh]) -> None:
    mesh = hulls[18]
    inside_out = SurfaceMesh(mesh.vertices, mesh.faces[:, ::-1].copy())
    np.testing.assert_allclose(body_of(inside_out).inertia_ratios, body_of(mesh).inertia_ratios, rtol=1e-9)
    np.testing.assert_allclose(body_of(inside_out).com_particle, body_of(mesh).com_particle, atol=1e-12)


def test_the_ball_holds_the_body() -> None:
    views = rig(3)
    centre, radius = bounding_ball(ellipsoid_outlines(SEMI_AXES, views), views)
    assert np.linalg.norm(centre) < 2e-5
    assert SEMI_AXES.max() + np.linalg.norm(centre) < radius < 1.1 * SEMI_AXES.max()


def test_no_hull_without_views_that_agree() -> None:
    views = rig(1)
    outlines = ellipsoid_outlines(SEMI_AXES, views)
    nothing = Outline(np.zeros((0, 2)))
    with pytest.raises(InputError, match="at least 3 with an outline"):
        visual_hull([*outlines[:2], nothing, nothing, nothing, nothing], views)
    astray = [Outline(o.points_px + (300.0 if i % 2 else -300.0)) for i, o in enumerate(outlines)]
    with pytest.raises(InputError, match="empty visual hull"):
        visual_hull(astray, views)
