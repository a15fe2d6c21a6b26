"""A closed surface whose corners are free, and the one it begins as: the visual hull along the directions of a subdivided icosahedron."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property

import numba
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array, kron

from datasets.observation import CalibratedView
from datasets.vocabulary.outline import Outline
from datasets.vocabulary.surface_mesh import SurfaceMesh
from estimator.geometry.cast_outline import CastingMesh, casting_mesh
from estimator.geometry.visual_hull import bounding_ball
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
Seen = tuple[Outline, CalibratedView]
SUBDIVISIONS = 5
"""10,242 directions: edges are a sixtieth of the body's extent, one pixel of a recording and several of a view that fills its picture."""
CORNERS = 12
"""Of an icosahedron."""


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ``mesh`` of the unit sphere, ``laplacian`` (n, n): a value less the mean of its neighbours'; ``edge``: mean length of an edge."""

    mesh: CastingMesh
    laplacian: csr_array
    edge: float

    @cached_property
    def by_axis(self) -> csr_array:
        """The Laplacian (3 n, 3 n) of all three coordinates of each corner."""
        return csr_array(kron(self.laplacian, eye_array(3)))

    @property
    def subdivisions(self) -> int:
        """Of the icosahedron."""
        corners = len(self.directions)
        return round(np.log((corners - 2) / 10) / np.log(4)) if corners > CORNERS else 0

    @property
    def directions(self) -> Float[NDArray[np.float64], "n 3"]:
        """Unit vectors."""
        return self.mesh.vertices


@cache
def sphere(subdivisions: int = SUBDIVISIONS) -> Sphere:
    """The subdivided icosahedron."""
    from trimesh.creation import icosphere  # noqa: PLC0415 - loads networkx: 0.15 s, of no use where no surface is fitted

    ball = icosphere(subdivisions=subdivisions)
    mesh = casting_mesh(SurfaceMesh(np.asarray(ball.vertices, dtype=np.float64), np.asarray(ball.faces, dtype=np.int64)))
    both, n = np.concatenate([mesh.ends, mesh.ends[:, ::-1]]), len(mesh.vertices)
    adjacency = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    mean = diags_array(1.0 / adjacency.sum(axis=1)) @ adjacency
    edge = float(np.linalg.norm(mesh.vertices[mesh.ends[:, 0]] - mesh.vertices[mesh.ends[:, 1]], axis=1).mean())
    laplacian = csr_array(eye_array(n) - mean)
    laplacian.sort_indices()  # or whoever needs them sorted does it in place, and sums differ by rounding from then on
    return Sphere(mesh, laplacian, edge)


@dataclass(frozen=True, eq=False)
class Surface:
    """A closed surface with ``vertices`` (n, 3) m, particle frame, joined as those of a ``sphere`` are; ``centre`` (3,) m lies within."""

    sphere: Sphere
    centre: Array
    vertices: Float[NDArray[np.float64], "n 3"]

    @property
    def edge_m(self) -> float:
        """Typical length of an edge."""
        return self.sphere.edge * float(np.linalg.norm(self.vertices - self.centre, axis=1).mean())

    @property
    def area_vectors(self) -> Float[NDArray[np.float64], "n 3"]:
        """A third of the areas (m²) of the faces around each corner, along their outward normals."""
        faces = self.sphere.mesh.faces
        a, b, c = (self.vertices[faces[:, k]] for k in range(3))
        area, n = np.repeat(crossed(b - a, c - a) / 6.0, 3, axis=0), len(self.vertices)
        return np.column_stack([np.bincount(faces.ravel(), each, n) for each in area.T])

    @property
    def normals(self) -> Float[NDArray[np.float64], "n 3"]:
        """Outward unit normals at the corners."""
        vectors = self.area_vectors
        return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])

    def moved(self, by_m: Array) -> "Surface":
        """The surface with its corners moved by ``by_m`` (n, 3)."""
        return replace(self, vertices=self.vertices + by_m)


def crossed(a: Array, b: Array) -> Array:
    """Cross products of vectors ``a`` (k, 3) m with ``b`` (k, 3) m in any one frame, which numpy takes three times as long over."""
    return np.column_stack([a[:, i] * b[:, j] - a[:, j] * b[:, i] for i, j in ((1, 2), (2, 0), (0, 1))])


def star_surface(particle: Particle, further: Sequence[Seen] = (), subdivisions: int = SUBDIVISIONS) -> Surface:
    """The visual hull of a particle's views as seen from its centre of mass: where each direction first leaves one of the views' cones.

    No direction goes further than the diameter of the ball that holds the body, not even one that leaves no cone. ``further``: more
    outlines, and the cameras that show them.
    """
    ball, centre = sphere(subdivisions), particle.body.com_particle
    _, radius = bounding_ball(particle.outlines, particle.calibrated)
    reach = np.full(len(ball.directions), 2.0 * radius)
    for outline, view in (*zip(particle.outlines, particle.calibrated, strict=True), *further):
        np.minimum(reach, _left_at(outline, view, centre, ball.directions), out=reach)
    return Surface(ball, centre, centre + reach[:, None] * ball.directions)


def _left_at(outline: Outline, view: CalibratedView, centre: Array, directions: Array) -> Array:
    """Distances (n,) m from a ``centre`` (3,) at which ``directions`` (n, 3) first leave an outline's cone; infinite where they do not.

    A ray's picture is a straight line from the centre's, ``s = r |w| / (z + r d_z)`` long.
    """
    place, d = view.R_cam_particle @ centre + view.t_cam_particle, directions @ view.R_cam_particle.T
    z, middle = place[2], place[:2] / place[2]
    w = d[:, :2] - middle * d[:, 2:]
    long = np.linalg.norm(w, axis=1)
    s = _first_crossings(view.intrinsics.normalise(outline.points_px) - middle, np.arctan2(w[:, 1], w[:, 0]))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(np.isfinite(s) & (long > s * d[:, 2]), s * z / (long - s * d[:, 2]), np.inf)


def _first_crossings(curve: Array, angles: Array) -> Array:
    """How far (n,) from the origin rays at ``angles`` (n,) first cross a closed ``curve`` (k, 2); infinite where it is not around it."""
    start, along = curve, np.roll(curve, -1, axis=0) - curve
    begins = np.arctan2(start[:, 1], start[:, 0])
    turned = np.arctan2(start[:, 0] * along[:, 1] - start[:, 1] * along[:, 0], np.sum(start * (start + along), axis=1))
    if abs(turned.sum()) < np.pi:  # the origin lies outside
        return np.full(len(angles), np.inf)
    low, order = np.where(turned < 0.0, begins + turned, begins), np.argsort(angles)
    low = np.mod(low + np.pi, 2.0 * np.pi) - np.pi
    twice = np.concatenate([angles[order], angles[order] + 2.0 * np.pi])
    first, end = np.searchsorted(twice, low), np.searchsorted(twice, low + np.abs(turned), side="right")
    return np.asarray(_nearest_crossings(start, along, (first, end), order, angles))


@numba.njit(cache=True, error_model="numpy")
def _nearest_crossings(start, along, rays, order, angles):  # type: ignore[no-untyped-def]
    """How far (n,) rays at ``angles`` (n,) first cross edges that run ``along`` (k, 2) from their ``start`` (k, 2).

    ``rays``: where in their ``order`` (n,) by angle, which goes round, those that may cross an edge begin and end (k,).
    """
    crossed, u, v = np.full(len(angles), np.inf), np.cos(angles), np.sin(angles)
    for k in range(len(start)):
        (x, y), (dx, dy) = start[k], along[k]
        for at in range(rays[0][k], rays[1][k]):
            ray = order[at % len(order)]
            far = (x * dy - y * dx) / (u[ray] * dy - v[ray] * dx)
            if 0.0 < far < crossed[ray]:
                crossed[ray] = far
    return crossed
