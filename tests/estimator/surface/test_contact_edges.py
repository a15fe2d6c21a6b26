"""Samples of a bumpy body's exact outline lie on it: where edges are long the nearest by its middle is not the edge that shows."""

import numpy as np
import pytest
import shapely
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from estimator.motion.rotation import rotation_from_vector
from estimator.surface.contact import Contact, Picture, contacts_of
from estimator.surface.star_surface import Surface, sphere

CAMERA = Intrinsics(width_px=640, height_px=480, fx_px=25000.0, fy_px=25000.0, cx_px=319.5, cy_px=239.5)
T = np.array([0.0, 0.0, 0.5])
SPACING_PX = 1.0


def bumpy() -> Surface:
    """Edges of some 20 to 40 px: the outline leaves a facet's edge at its end, and far from its middle."""
    ball = sphere(3)
    radii = 3e-3 * (1.0 + 0.08 * np.random.default_rng(4).normal(size=len(ball.directions)))
    return Surface(ball, np.zeros(3), radii[:, None] * ball.directions)


def outline(surface: Surface, R: NDArray[np.float64]) -> NDArray[np.float64]:
    """Points of the boundary of all projected faces, taken together."""
    pixels = CAMERA.project(surface.vertices @ R.T + T)
    edge = shapely.union_all(shapely.polygons(pixels[surface.sphere.mesh.faces])).exterior
    return np.asarray(shapely.get_coordinates(shapely.line_interpolate_point(edge, np.arange(0.0, edge.length, SPACING_PX))))


def met_by(surface: Surface, R: NDArray[np.float64], samples_px: NDArray[np.float64]) -> Contact:
    return contacts_of(surface, [Picture(CAMERA, R, T, samples_px)])


@pytest.mark.parametrize("turn", [0.3, 1.1, 2.0])
def test_samples_of_the_exact_outline_have_no_gap(turn: float) -> None:
    surface, R = bumpy(), rotation_from_vector(np.array([turn, -0.8, 0.5]))
    gaps = np.abs(met_by(surface, R, outline(surface, R)).gap_px)
    assert np.quantile(gaps, 0.99) < 0.25
    assert np.sqrt(np.mean(gaps**2)) < 0.1


@pytest.mark.parametrize("distance_px", [-1.0, 1.0])
def test_samples_know_on_which_side_they_lie(distance_px: float) -> None:
    ball = sphere(5)
    bumps = np.random.default_rng(1).normal(size=len(ball.directions))
    for _ in range(30):  # gentle, but with edges that go to and fro across the outline
        bumps = bumps - 0.5 * (ball.laplacian @ bumps)
    surface = Surface(ball, np.zeros(3), 1e-3 * (1.0 + 0.2 * bumps / np.abs(bumps).max())[:, None] * ball.directions)
    R = rotation_from_vector(np.array([0.7, -0.8, 0.5]))
    beside = shapely.Polygon(outline(surface, R)).buffer(distance_px).exterior
    samples = shapely.get_coordinates(shapely.line_interpolate_point(beside, np.arange(0.0, beside.length, SPACING_PX)))
    gaps = met_by(surface, R, samples).gap_px
    assert np.all(np.sign(gaps) == np.sign(distance_px))
    assert np.median(gaps) == pytest.approx(distance_px, abs=0.05)


def test_what_noise_draws_turns_normals_less_than_edges() -> None:
    """A ball seen from afar, corners off by a tenth of a pixel: turned about the optical axis its outline is the same."""
    ball, R = sphere(5), rotation_from_vector(np.array([0.7, -0.8, 0.5]))
    px_m = T[2] / CAMERA.fx_px
    radii = 30.0 * px_m + 0.1 * px_m * np.random.default_rng(2).normal(size=len(ball.directions))
    surface = Surface(ball, np.zeros(3), radii[:, None] * ball.directions)
    samples = outline(surface, R)
    met = met_by(surface, R, samples)
    pixels = CAMERA.project(surface.vertices @ R.T + T)
    along = pixels[met.second] - pixels[met.first]
    around = samples - np.array([CAMERA.cx_px, CAMERA.cy_px])
    around /= np.linalg.norm(around, axis=1)[:, None]
    of_edges = np.sum(along * around, axis=1) / np.linalg.norm(along, axis=1)
    of_normals = met.outward[:, 0] * around[:, 1] - met.outward[:, 1] * around[:, 0]
    assert np.sqrt(np.mean(of_normals**2)) < 0.7 * np.sqrt(np.mean(of_edges**2))
    assert np.allclose(np.linalg.norm(met.outward, axis=1), 1.0)
