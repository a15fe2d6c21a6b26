"""A procedural family of particles, from a ball to a jagged lump.

Every member is a sphere of radius 1 deformed by an amount that grows smoothly with ``irregularity`` ``a`` in [0, 1], along a
direction of shape space that the seed fixes; at ``a = 0`` all are (polyhedral approximations of) the sphere.

* ``sphere``: the sphere itself, for every ``a``.
* ``ellipsoid``: semi-axes ``exp(a s)``, ``s`` in about [-0.6, 0.6] with zero sum: up to 1 : 0.55 : 0.3.
* ``cut_stone``: a convex polytope like a cut diamond: random planes cut a finely faceted ball and move inward with ``a``; stretched
  half as much as the ellipsoid. Facets and edges are exact.
* ``jagged``: ``r(u) = exp(a A sum_k h^k n_k(u))``; ``n_k`` is the absolute value of a sum of random plane waves of frequency
  ``1.6 2^k`` on the unit sphere, so that creases run over it as in ridged fractal terrain [Ebert et al. 2003, Texturing and
  Modeling]; stretched half as much, too.
"""

from typing import Literal, cast

import numpy as np
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial import HalfspaceIntersection

Array = NDArray[np.float64]
Family = Literal["sphere", "ellipsoid", "cut_stone", "jagged"]

SUBDIVISIONS = 5
"""Of the icosahedron: 10,242 vertices."""
CUTS = 22
CUT_DEPTH = 0.55
OCTAVES = 5
ROUGHNESS = 0.62
"""Ratio of the amplitudes of successive octaves."""
AMPLITUDE = 0.5
WAVES = 24


def procedural(family: Family, irregularity: float, rng: np.random.Generator) -> trimesh.Trimesh:
    """A closed, outward mesh of the family, of unit size within a factor of about two.

    Parameters
    ----------
    family
        Which deformation of the sphere.
    irregularity
        How much of it, 0 to 1.
    rng
        Decides the direction in shape space; the same state gives the same body, deformed more or less.

    Raises
    ------
    ValueError
        Where ``irregularity`` lies outside [0, 1].
    """
    if not 0 <= irregularity <= 1:
        raise ValueError(f"irregularity must lie in [0, 1], got {irregularity}")
    stretch = log_axes(rng)
    if family == "sphere":
        return trimesh.creation.icosphere(subdivisions=SUBDIVISIONS)
    if family == "ellipsoid":
        return stretched(trimesh.creation.icosphere(subdivisions=SUBDIVISIONS), 1.0 * irregularity * stretch)
    if family == "cut_stone":
        return stretched(cut_sphere(irregularity, rng), 0.5 * irregularity * stretch)
    return stretched(ridged_sphere(irregularity, rng), 0.5 * irregularity * stretch)


def log_axes(rng: np.random.Generator) -> Float[NDArray[np.float64], "3"]:
    """Logarithms of the semi-axes, zero sum, well apart so that no body of revolution arises."""
    middle = rng.uniform(-0.15, 0.15)
    half_range = rng.uniform(0.35, 0.6)
    return np.array([half_range, middle, -half_range]) - middle / 3


def stretched(mesh: trimesh.Trimesh, log_scale: Float[NDArray[np.float64], "3"]) -> trimesh.Trimesh:
    """The mesh scaled along the coordinate axes by ``exp(log_scale)``."""
    return trimesh.Trimesh(mesh.vertices * np.exp(log_scale), mesh.faces, process=False)


def cut_sphere(irregularity: float, rng: np.random.Generator) -> trimesh.Trimesh:
    """A polytope: the sphere's tangent planes, and ``CUTS`` planes that move inward by up to ``CUT_DEPTH`` of the radius."""
    tangent = np.asarray(trimesh.creation.icosphere(subdivisions=2).vertices)
    cut = rng.normal(size=(CUTS, 3))
    cut /= np.linalg.norm(cut, axis=1, keepdims=True)
    depth = irregularity * CUT_DEPTH * rng.uniform(0.35, 1.0, size=CUTS)
    normals = np.vstack([tangent, cut])
    distances = np.concatenate([np.ones(len(tangent)), 1 - depth])
    corners = HalfspaceIntersection(np.column_stack([normals, -distances]), np.zeros(3)).intersections
    hull = trimesh.convex.convex_hull(np.unique(np.round(corners, 9), axis=0))
    return cast(trimesh.Trimesh, hull)


def ridged_sphere(irregularity: float, rng: np.random.Generator) -> trimesh.Trimesh:
    """A sphere with ridges and hollows in ``OCTAVES`` octaves."""
    sphere = trimesh.creation.icosphere(subdivisions=SUBDIVISIONS)
    relief = np.zeros(len(sphere.vertices))
    for octave in range(OCTAVES):
        relief += ROUGHNESS**octave * ridges(np.asarray(sphere.vertices), 1.6 * 2.0**octave, rng)
    radius = np.exp(irregularity * AMPLITUDE * relief)
    return trimesh.Trimesh(sphere.vertices * radius[:, None], sphere.faces, process=False)


def ridges(points: Float[NDArray[np.float64], "n 3"], frequency: float, rng: np.random.Generator) -> Float[NDArray[np.float64], " n"]:
    """A random function with creases, of about zero mean and unit range, at ``points`` on the unit sphere."""
    direction = rng.normal(size=(WAVES, 3))
    direction *= frequency / np.linalg.norm(direction, axis=1, keepdims=True)
    waves = np.cos(points @ direction.T + rng.uniform(0, 2 * np.pi, WAVES)).sum(axis=1) * np.sqrt(2 / WAVES)
    return cast(Array, 0.8 - np.abs(waves))
