"""Pictures of known outlines: super-sampled polygons, Gaussian blur, shot and read noise. Independent of the code under test."""

from dataclasses import dataclass, field

import numpy as np
import pytest
import shapely
from scipy.ndimage import gaussian_filter
from scipy.spatial import ConvexHull

SUPERSAMPLING = 8
DARK, FULL_WELL, BITS = 64.0, 20000.0, 12


@dataclass(frozen=True)
class StoredFrames:
    """Frames held in memory; counts what is read."""

    pictures: list
    taken: np.ndarray | None = None
    bit_depth: int = BITS
    reads: list = field(default_factory=list)

    def __len__(self):
        return len(self.pictures)

    def read(self, index):
        self.reads.append(index)
        return self.pictures[index]

    def background(self):
        return self.taken

    def background_of(self, index):
        return self.taken


def draw(polygon, shape, blur_px):
    """Occupancy of a polygon: point samples on an 8 x 8 grid per pixel, blurred, averaged over each pixel."""
    ring = shapely.Polygon(polygon)
    x0, y0, x1, y1 = ring.bounds
    margin = int(4 + 5 * blur_px)
    left, top, right, bottom = int(x0) - margin, int(y0) - margin, int(x1) + margin + 1, int(y1) + margin + 1
    fine = (np.arange(SUPERSAMPLING) + 0.5) / SUPERSAMPLING - 0.5
    xs = (np.arange(left, right)[:, None] + fine).ravel()
    ys = (np.arange(top, bottom)[:, None] + fine).ravel()
    shapely.prepare(ring)
    inside = shapely.contains_xy(ring, *np.meshgrid(xs, ys)).astype(float)
    smooth = gaussian_filter(inside, blur_px * SUPERSAMPLING, truncate=5)
    small = smooth.reshape(bottom - top, SUPERSAMPLING, right - left, SUPERSAMPLING).mean((1, 3))
    picture = np.zeros(shape)
    if left >= shape[1] or right <= 0:
        return picture
    a, b, c, d = max(top, 0), min(bottom, shape[0]), max(left, 0), min(right, shape[1])
    picture[a:b, c:d] = small[a - top : b - top, c - left : d - left]
    return picture


def expose(electrons, rng):
    """Digital numbers of a 12-bit sensor after shot noise, 15 electrons of read noise and a dark offset."""
    counted = rng.poisson(np.maximum(electrons, 0)) + 15 * rng.standard_normal(electrons.shape)
    top = 2**BITS - 1
    return np.clip(np.round(DARK + counted * (top - DARK) / FULL_WELL), 0, top).astype(np.uint16)


def panel(shape, electrons=16000.0):
    """A back-light that falls off by 10% towards the corners."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    r2 = ((x - shape[1] / 2) ** 2 + (y - shape[0] / 2) ** 2) / (shape[0] ** 2 + shape[1] ** 2) * 4
    return electrons * (1 - 0.1 * r2)


def back_lit(polygon, shape, rng, *, blur_px=0.6, own=0.02, lamp=1.0):
    """A particle in front of a panel."""
    o = draw(polygon, shape, blur_px)
    return expose(lamp * panel(shape) * (1 - o * (1 - own)), rng)


def ellipse(a, b, centre, points=1500):
    angle = np.linspace(0, 2 * np.pi, points, endpoint=False)
    return np.column_stack([a * np.cos(angle), b * np.sin(angle)]) + centre


def stone(radius, centre, rng, corners=40):
    """A convex polygon with many blunt corners."""
    points = rng.standard_normal((corners, 2))
    points = radius * points / np.linalg.norm(points, axis=1)[:, None] * [1.0, 0.75]
    return points[ConvexHull(points).vertices] + centre


def signed_distances(points, polygon):
    """Distance (px) of points from a polygon, positive outside."""
    ring = shapely.Polygon(polygon)
    dots = shapely.points(points)
    distance = shapely.distance(dots, ring.exterior)
    return np.where(shapely.contains(ring, dots), -distance, distance)


def support_difference(points, polygon):
    """How much further (px) the hull of ``points`` reaches than the polygon's, over 720 directions."""
    angle = np.linspace(0, 2 * np.pi, 720, endpoint=False)
    directions = np.column_stack([np.cos(angle), np.sin(angle)])
    return (directions @ np.asarray(points).T).max(1) - (directions @ np.asarray(polygon).T).max(1)


@dataclass(frozen=True)
class Darkroom:
    """Everything above in one hand."""

    draw = staticmethod(draw)
    expose = staticmethod(expose)
    panel = staticmethod(panel)
    back_lit = staticmethod(back_lit)
    ellipse = staticmethod(ellipse)
    stone = staticmethod(stone)
    signed_distances = staticmethod(signed_distances)
    support_difference = staticmethod(support_difference)
    frames = StoredFrames


@pytest.fixture(scope="session")
def darkroom():
    return Darkroom()


@pytest.fixture
def rng():
    return np.random.default_rng(20240311)
