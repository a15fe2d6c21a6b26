"""A closed surface whose corners are free, and the one it begins as: the visual hull along the directions of a subdivided icosahedron."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.sparse import csr_array, diags_array, eye_array

from estimator.geometry.cast_outline import CastingMesh, casting_mesh
from estimator.geometry.visual_hull import HullMesh, bounding_ball, inside_by
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SUBDIVISIONS = 5
"""10,242 directions: edges are a sixtieth of the body's extent, one pixel of a recording and several of a view that fills its picture."""
MARCHED, HALVED, REACH = 45, 12, 1.1
"""Steps from the centre until a point lies outside a cone, halvings of the last step, and how far they go in radii of the ball around."""


@dataclass(frozen=True, eq=False)
class Sphere:
    """A ``mesh`` of the unit sphere, ``laplacian`` (n, n): a value less the mean of its neighbours'; ``edge``: mean length of an edge."""

    mesh: CastingMesh
    laplacian: csr_array
    edge: float

    @property
    def directions(self) -> Float[NDArray[np.float64], "n 3"]:
        """Unit vectors."""
        return self.mesh.vertices


@cache
def sphere(subdivisions: int = SUBDIVISIONS) -> Sphere:
    """The subdivided icosahedron."""
    from trimesh.creation import icosphere  # noqa: PLC0415 - loads networkx: 0.15 s, of no use where no surface is fitted

    ball = icosphere(subdivisions=subdivisions)
    mesh = casting_mesh(HullMesh(np.asarray(ball.vertices, dtype=np.float64), np.asarray(ball.faces, dtype=np.int64)))
    both, n = np.concatenate([mesh.ends, mesh.ends[:, ::-1]]), len(mesh.vertices)
    adjacency = csr_array((np.ones(len(both)), (both[:, 0], both[:, 1])), shape=(n, n))
    mean = diags_array(1.0 / adjacency.sum(axis=1)) @ adjacency
    edge = float(np.linalg.norm(mesh.vertices[mesh.ends[:, 0]] - mesh.vertices[mesh.ends[:, 1]], axis=1).mean())
    return Sphere(mesh, csr_array(eye_array(n) - mean), edge)


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
        area = np.cross(b - a, c - a) / 6.0
        vectors = np.zeros_like(self.vertices)
        for k in range(3):
            np.add.at(vectors, faces[:, k], area)
        return vectors

    @property
    def normals(self) -> Float[NDArray[np.float64], "n 3"]:
        """Outward unit normals at the corners."""
        vectors = self.area_vectors
        return np.asarray(vectors / np.linalg.norm(vectors, axis=1)[:, None])

    def moved(self, by_m: Array) -> "Surface":
        """The surface with its corners moved by ``by_m`` (n, 3)."""
        return replace(self, vertices=self.vertices + by_m)


def star_surface(particle: Particle, subdivisions: int = SUBDIVISIONS) -> Surface:
    """The visual hull of a particle's views as seen from its centre of mass: where each direction first leaves one of the views' cones."""
    ball = sphere(subdivisions)
    _, reach = bounding_ball(particle.outlines, particle.calibrated)
    cones = [inside_by(o, v) for o, v in zip(particle.outlines, particle.calibrated, strict=True)]
    centre, n = particle.body.com_particle, len(ball.directions)

    def inside(radii: Array, rows: Index) -> NDArray[np.bool_]:
        points = centre + radii[:, None] * ball.directions[rows]
        return np.asarray(np.min([cone(points) for cone in cones], axis=0) > 0.0)

    low, high, left = np.zeros(n), np.full(n, REACH * reach), np.arange(n)
    for radius in np.linspace(0.0, REACH * reach, MARCHED)[1:]:
        within = inside(np.full(len(left), radius), left)
        high[left[~within]] = radius
        low[left[within]] = radius
        left = left[within]
    for _ in range(HALVED):
        middle = 0.5 * (low + high)
        within = inside(middle, np.arange(n))
        low, high = np.where(within, middle, low), np.where(within, high, middle)
    return Surface(ball, centre, centre + (0.5 * (low + high))[:, None] * ball.directions)
