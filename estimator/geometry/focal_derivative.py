"""The tangency error's derivative by the focal length of the first picture.

With every ray ``(x, y, 1)`` of a picture from pixels ``X = f x``, a relative change ``dε`` of the focal length takes ``(x, y)`` to
``(1 - dε)(x, y)`` and leaves the pixels. The tangency vertices held fixed, as for the pose (envelope theorem):

- the first's error against the plane ``n = b x w`` through the second's ray: ``de/dε = ± n_z / g``, g = |(n_x / f_x, n_y / f_y)|;
- the second's error against the plane ``b x u`` through the first's ray u: ``de/dε = ± q · R (b x (-x, -y, 0))``, q the gradient of a
  distance by its plane.

Both focal lengths of a camera scale together, and lens distortion stays with the pixels. A focal length and a distance are told apart by
perspective alone, of the particle's depth over its distance: a small particle before a long lens says next to nothing.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors
from estimator.geometry.silhouettes import Silhouettes

Array = NDArray[np.float64]
OUTWARD = np.array([1.0, -1.0])
"""Signs of the outward direction at the upper and the lower tangency."""


def with_focal(silhouettes: Silhouettes, log_factor: float) -> Silhouettes:
    """The same pictures seen through lenses ``exp(log_factor)`` times as long."""
    factor = float(np.exp(log_factor))
    return replace(silhouettes, xy=silhouettes.xy / factor, focal_px=silhouettes.focal_px * factor)


def focal_derivative(first: Silhouettes, poses: PoseSet, second: Silhouettes, second_poses: PoseSet, errors: TangencyErrors) -> Array:
    """Derivative (n, k, 4) px of the errors by the logarithm of the first silhouettes' focal length; zero where a pair is not valid."""
    R_ab = np.einsum("nij,klj->nkil", poses.R, second_poses.R)
    centre_b = -np.einsum("kji,kj->ki", second_poses.R, second_poses.t)
    b = (np.einsum("nij,kj->nki", poses.R, centre_b) + poses.t[:, None])[:, :, None]
    u_a = _rays(first, errors.tangency[..., :2], np.arange(len(first))[:, None, None])
    u_b = _rays(second, errors.tangency[..., 2:], np.arange(len(second))[None, :, None])
    n = np.cross(b, np.einsum("nkil,nkml->nkmi", R_ab, u_b))
    own = n[..., 2] / _gradient_length(n, first.focal_px[:, None, None])
    plane = np.einsum("nkil,nkmi->nkml", R_ab, np.cross(b, u_a))
    turned = np.einsum("nkil,nkmi->nkml", R_ab, np.cross(b, u_a * [-1.0, -1.0, 0.0]))
    other = np.einsum("nkml,nkml->nkm", _distance_gradient(plane, u_b, second.focal_px[None, :, None]), turned)
    derivative = np.concatenate([OUTWARD * own, OUTWARD * other], axis=2)
    return np.where(errors.valid[:, :, None], derivative, 0.0)


def _rays(silhouettes: Silhouettes, vertices: NDArray[np.int32], which: NDArray[np.int64]) -> Array:
    """Rays (n, k, 2, 3) of hull vertices; those of pairs without tangents are of no consequence."""
    rows = np.clip(silhouettes.offsets[which] + np.maximum(vertices, 0), 0, len(silhouettes.xy) - 1)
    return np.concatenate([silhouettes.xy[rows], np.ones((*rows.shape, 1))], axis=-1)


def _gradient_length(n: Array, focal: Array) -> Array:
    return np.maximum(np.linalg.norm(n[..., :2] / focal, axis=-1), 1e-300)


def _distance_gradient(n: Array, ray: Array, focal: Array) -> Array:
    """Gradient (..., 3), by the plane's normal ``n``, of the distance (px) of a ray's pixel from the plane's image."""
    g = _gradient_length(n, focal)[..., None]
    s = np.sum(n * ray, axis=-1, keepdims=True)
    bend = np.concatenate([n[..., :2] / focal**2, np.zeros_like(g)], axis=-1)
    return np.asarray(ray / g - s * bend / g**3)
