"""The surface as an unknown: its shape, the outline that it casts, its mass properties, each against differences or what is exact."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.motion.rigid_body import RanAway
from estimator.motion.rotation import rotation_from_vector
from estimator.particle.mass_properties import body_of
from estimator.surface.contact import Contact, Picture, contacts_of
from estimator.surface.mass import mass_response
from estimator.surface.star_surface import Surface, sphere

CAMERA = Intrinsics(width_px=640, height_px=480, fx_px=5000.0, fy_px=5000.0, cx_px=319.5, cy_px=239.5)
R, T = rotation_from_vector(np.array([0.3, -0.8, 0.5])), np.array([0.001, -0.002, 0.5])
RADIUS_M = 3e-3


def ellipsoid(subdivisions: int = 4) -> Surface:
    ball = sphere(subdivisions)
    radii = 1.0 / np.sqrt(np.sum((ball.directions / (RADIUS_M * np.array([1.2, 1.0, 0.8]))) ** 2, axis=1))
    return Surface(ball, np.zeros(3), radii[:, None] * ball.directions)


def outline(surface: Surface, out_px: float, count: int = 90) -> NDArray[np.float64]:
    """Points a distance out of the outline of an ellipsoid's convex mesh: the corner that lies furthest along each direction."""
    pixels = CAMERA.project(surface.vertices @ R.T + T)
    angle = 2.0 * np.pi * (np.arange(count) + 0.5) / count
    u = np.column_stack([np.cos(angle), np.sin(angle)])
    return np.asarray(pixels[np.argmax(pixels @ u.T, axis=0)] + out_px * u)


def met_by(surface: Surface, samples_px: NDArray[np.float64]) -> Contact:
    return contacts_of(surface, [Picture(CAMERA, R, T, samples_px)])


def test_a_ball_is_perfectly_smooth() -> None:
    ball = sphere(3)
    np.testing.assert_allclose(ball.laplacian @ np.ones(len(ball.directions)), 0.0, atol=1e-12)
    assert len(ball.mesh.ends) == 3 * len(ball.directions) - 6


@pytest.mark.parametrize("out_px", [-0.8, 0.5, 2.0])
def test_samples_lie_as_far_from_the_outline_as_they_were_put(out_px: float) -> None:
    surface = ellipsoid()
    met = met_by(surface, outline(surface, out_px))
    np.testing.assert_allclose(met.gap_px, out_px, atol=0.05 if out_px < 0 else 0.01)


def test_samples_that_are_no_numbers_are_refused_where_the_search_for_the_nearest_would_never_end() -> None:
    surface = ellipsoid()
    samples = outline(surface, 0.5)
    samples[7, 1] = np.nan
    with pytest.raises(RanAway, match="samples ran away"):
        met_by(surface, samples)


def test_a_surface_that_reaches_the_camera_itself_ran_away() -> None:
    surface = ellipsoid()
    with pytest.raises(RanAway, match="behind the camera"):
        contacts_of(surface, [Picture(CAMERA, np.eye(3), -surface.vertices[0], outline(surface, 0.5))])


def test_a_sample_s_distance_changes_with_the_radii_as_its_contact_says() -> None:
    surface = ellipsoid()
    samples = outline(surface, 0.7)
    met = met_by(surface, samples)
    grown_m = 1e-6
    along = surface.sphere.directions @ R.T
    point = along[met.first] * (1.0 - met.share)[:, None] + along[met.second] * met.share[:, None]
    x, y, z = met.point.T
    moved = CAMERA.fx_px * np.column_stack([point[:, 0] / z - x * point[:, 2] / z**2, point[:, 1] / z - y * point[:, 2] / z**2])
    after = met_by(surface.moved(grown_m * surface.sphere.directions), samples)
    expected = -grown_m * np.sum(moved * met.normal, axis=1)
    np.testing.assert_allclose(after.gap_px - met.gap_px, expected, atol=2e-4)
    assert np.abs(expected).min() > 5e-3


def test_mass_properties_are_those_of_the_solid_and_follow_its_corners() -> None:
    surface = ellipsoid()
    nominal = Body(np.array([1e-5, 0.0, -2e-5]), rotation_from_vector(np.array([0.1, 0.2, -0.1])), np.array([0.7, 0.9, 1.0]))
    response = mass_response(surface, nominal)
    step = 1e-6 * np.random.default_rng(1).normal(size=surface.vertices.shape)
    up, down = (mass_response(surface.moved(sign * step), nominal).values for sign in (1.0, -1.0))
    np.testing.assert_allclose(step.ravel() @ response.by_corner, 0.5 * (up - down), rtol=0.03, atol=0.02 * np.abs(up - down).max())
    own = body_of(SurfaceMesh(surface.vertices, surface.sphere.mesh.faces))
    at_home = mass_response(surface, own).values
    np.testing.assert_allclose(at_home, 0.0, atol=1e-9)


def test_a_larger_ellipsoid_has_the_same_ratios() -> None:
    surface = ellipsoid()
    own = body_of(SurfaceMesh(surface.vertices, surface.sphere.mesh.faces))
    larger = replace(surface, vertices=1.1 * surface.vertices)
    np.testing.assert_allclose(mass_response(larger, own).values, 0.0, atol=1e-9)
