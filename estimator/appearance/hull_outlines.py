"""Outlines of a particle's convex hull, as noisy as measured ones are."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from datasets.vocabulary.camera import Intrinsics
from estimator.geometry.silhouettes import Silhouettes, pack
from estimator.geometry.tangent_hull import TangentHull
from estimator.particle.particle import Particle

Array = NDArray[np.float64]


def hull_of(particle: Particle) -> Array:
    """Corners (c, 3) m of the convex hull of a particle's visual hull, nominal body axes about the centre of mass."""
    vertices = (particle.hull.vertices - particle.body.com_particle) @ particle.body.R_particle_body
    return np.asarray(vertices[ConvexHull(vertices).vertices])


def outline_of(points_cam: Array, lens: Intrinsics) -> Array:
    """Convex outline (v, 2) px of ``points_cam`` (n, 3) m."""
    pixels = lens.project(points_cam)
    return np.asarray(pixels[ConvexHull(pixels).vertices])


def like_noise(polygons: Sequence[Array], lenses: Sequence[Intrinsics], noisy: Silhouettes) -> Silhouettes:
    """Silhouettes of outlines whose tangents are as noisy as those of ``noisy`` are in the median; ``polygons`` (v, 2) px."""
    sigma, turn = float(np.median(noisy.sigma_px)), float(np.median(noisy.correlation_rad))
    noise, samples = float(np.median(noisy.noise_px)), int(np.median(noisy.samples))
    hulls = [TangentHull(p, np.full(len(p), sigma), turn, noise, samples) for p in polygons]
    return pack(hulls, lenses) if hulls else noisy.take([])
