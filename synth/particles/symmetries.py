"""Rotations that map a body on to itself, nearly.

A body's proper symmetries turn about its centre of mass and leave the inertia tensor as it is. Three distinct moments leave only
half turns about the principal axes; two equal ones also turns about the third axis and half turns across it; three equal ones any
rotation, so a grid over all rotations is tried. Candidates are refined by iterated closest points [Chen & Medioni 1992] and count where
the turned surface then deviates from the surface by less than ``tolerance`` of the body's largest extent everywhere. Continuous
symmetries come out as sets as fine as the candidates are: 3° for a body of revolution, ``KEPT`` rotations for a ball, whose
orientation has no meaning anyway.
"""

from dataclasses import dataclass
from typing import cast

import numpy as np
import trimesh
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from datasets.vocabulary.body import Body

Array = NDArray[np.float64]

TOLERANCE = 0.01
EQUAL_MOMENTS = 0.05
"""Relative difference below which two moments may belong to a symmetry of higher order."""
TURN = np.deg2rad(3.0)
GRID = 4000
KEPT = 400
"""Candidates that are refined, those with the least mean deviation."""
SURFACE_SAMPLES = 40_000
PROBES = 400
FEW_PROBES = 100
NEIGHBOURS = 8
LARGEST_FINITE = 60
"""Rotations of the icosahedron; more belong to a continuous symmetry."""
REFINEMENTS = 8
DAMPING = 1e-4
"""Added to the normal matrix, so that a direction of continuous symmetry stays where it is; others have about 0.01."""
SAME = np.deg2rad(2.0)
NEARLY_NOTHING = np.deg2rad(6.0)
"""Smaller turns are taken for the identity: they mean that the tolerance is wide, not that the body is symmetric."""


@dataclass(frozen=True)
class SampledSurface:
    """Points and normals of a surface in the body frame, lengths in largest extents; the first points probe it."""

    points: Array
    normals: Array
    tree: cKDTree

    def gaps(self, points: Array) -> tuple[Array, Array]:
        """Signed distances (...,) of ``points`` (..., 3) from the tangent plane at the closest sample, and its normals (..., 3)."""
        _, index = self.tree.query(points)
        normals = self.normals[index]
        return np.einsum("...i,...i->...", points - self.points[index], normals), normals

    def distances(self, points: Array) -> Array:
        """Distances (...,) of ``points`` (..., 3) from the surface."""
        # Beside an edge the closest sample may lie on the wrong face, so the best of the nearest counts.
        _, index = self.tree.query(points, k=NEIGHBOURS)
        gaps = np.einsum("...ki,...ki->...k", points[..., None, :] - self.points[index], self.normals[index])
        return cast(Array, np.abs(gaps).min(axis=-1))


def rotational_symmetries(
    mesh: trimesh.Trimesh, body: Body, *, tolerance: float = TOLERANCE, seed: int = 0
) -> Float[NDArray[np.float64], "s 3 3"]:
    """Rotations (s, 3, 3) in the mesh's frame, about the centre of mass, that map the body on to itself; the identity comes first.

    ``tolerance`` is the deviation allowed, in largest extents; ``seed`` decides where the surface is sampled.
    """
    surface = _sampled(mesh, body, seed)
    found = _accepted(candidate_rotations(body.inertia_ratios), surface, tolerance)
    if 1 < len(found) <= LARGEST_FINITE:
        # A symmetry that the search missed is a product of two that it found.
        products = _distinct(Rotation.concatenate([rotation * found for rotation in found]))
        found = _distinct(Rotation.concatenate([found, _accepted(products, surface, tolerance)]))
    R = body.R_particle_body
    return np.asarray(R @ found.as_matrix() @ R.T)


def candidate_rotations(inertia_ratios: Float[NDArray[np.float64], "3"]) -> Rotation:
    """Rotations in the body frame that leave an inertia tensor with these (ascending) principal moments nearly as it is."""
    half_turns = Rotation.from_rotvec(np.pi * np.eye(3))
    low, middle, high = inertia_ratios
    lower_equal, upper_equal = (middle - low) / middle < EQUAL_MOMENTS, (high - middle) / high < EQUAL_MOMENTS
    if lower_equal and upper_equal:
        return Rotation.concatenate([half_turns, rotation_grid(GRID)])
    if not (lower_equal or upper_equal):
        return half_turns
    axis, across, other = (np.eye(3)[k] for k in ((2, 0, 1) if lower_equal else (0, 1, 2)))
    angles = np.arange(TURN, 2 * np.pi - TURN / 2, TURN)
    half = np.arange(0, np.pi, TURN / 2)[:, None]
    about = Rotation.from_rotvec(angles[:, None] * axis)
    flips = Rotation.from_rotvec(np.pi * (np.cos(half) * across + np.sin(half) * other))
    return Rotation.concatenate([half_turns, about, flips])


def rotation_grid(count: int) -> Rotation:
    """``count`` rotations spread evenly over all rotations [Alexa 2022, Super-Fibonacci spirals, CVPR]."""
    psi = 1.533751168755204288118041
    s = np.arange(count) + 0.5
    alpha, beta = 2 * np.pi * s / np.sqrt(2), 2 * np.pi * s / psi
    inner, outer = np.sqrt(s / count), np.sqrt(1 - s / count)
    return Rotation.from_quat(np.column_stack([inner * np.sin(alpha), inner * np.cos(alpha), outer * np.sin(beta), outer * np.cos(beta)]))


def _sampled(mesh: trimesh.Trimesh, body: Body, seed: int) -> SampledSurface:
    size = float(np.ptp(mesh.vertices, axis=0).max())
    points, face = trimesh.sample.sample_surface(mesh, SURFACE_SAMPLES, seed=seed)
    in_body = (np.asarray(points) - body.com_particle) @ body.R_particle_body / size
    return SampledSurface(in_body, np.asarray(mesh.face_normals[face]) @ body.R_particle_body, cKDTree(in_body))


def _deviations(rotations: Rotation, surface: SampledSurface, probes: int) -> Array:
    """Distances (rotation, probe) of turned surface points from the surface."""
    return surface.distances(_turned(rotations.as_matrix(), surface.points[:probes]))


def _turned(R: Array, points: Array) -> Array:
    return np.einsum("rij,pj->rpi", R, points)


def _accepted(candidates: Rotation, surface: SampledSurface, tolerance: float) -> Rotation:
    """The identity, and the distinct symmetries to which the best candidates lead, best first."""
    order = np.argsort(_deviations(candidates, surface, FEW_PROBES).mean(axis=1), kind="stable")
    refined = _refined(candidates[order[:KEPT]], surface)
    worst = _deviations(refined, surface, PROBES).max(axis=1)
    worst[refined.magnitude() <= NEARLY_NOTHING] = np.inf
    best_first = np.argsort(worst, kind="stable")[: int(np.sum(worst < tolerance))]
    # An empty selection of rotations is an error, so the identity is among those that are selected from.
    return _distinct(Rotation.concatenate([Rotation.identity(1), refined])[np.concatenate([[0], 1 + best_first])])


def _distinct(rotations: Rotation) -> Rotation:
    """The rotations without those that come within ``SAME`` of an earlier one."""
    kept = rotations[:1]
    for rotation in rotations[1:]:
        if (kept.inv() * rotation).magnitude().min() > SAME:
            kept = Rotation.concatenate([kept, rotation])
    return kept


def _refined(rotations: Rotation, surface: SampledSurface) -> Rotation:
    """Turn each rotation to where the probes lie closest to the surface: Gauss-Newton on the distances from tangent planes."""
    for _ in range(REFINEMENTS):
        points = _turned(rotations.as_matrix(), surface.points[:FEW_PROBES])
        gap, normals = surface.gaps(points)
        jacobian = np.cross(points, normals)
        normal_matrix = np.einsum("rpi,rpj->rij", jacobian, jacobian) / FEW_PROBES + DAMPING * np.eye(3)
        gradient = np.einsum("rpi,rp->ri", jacobian, gap) / FEW_PROBES
        step = -np.linalg.solve(normal_matrix, gradient[..., None])[..., 0]
        rotations = Rotation.from_rotvec(step) * rotations
    return rotations
