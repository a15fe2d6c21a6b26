"""The tangency kernel beside the same computation in plain batched NumPy, in one run: 100 silhouettes against 60 views.

``python -m scripts.benchmarks.bench_kernel --json`` or ``tumble bench --only kernel``. Both compute all errors, variances, Jacobians and
normal matrices per silhouette, and must agree to 1e-8; times are processor time of one thread, the median of several runs.
"""

import argparse
import json
import os
import time
from typing import Any

from tumble.one_thread import keep_to_one_thread

keep_to_one_thread(os.environ)

import numpy as np  # noqa: E402 - after the threads are limited
from numpy.typing import NDArray  # noqa: E402
from scipy.spatial import ConvexHull  # noqa: E402
from scipy.spatial.transform import Rotation  # noqa: E402

from datasets.vocabulary.camera import Intrinsics  # noqa: E402
from estimator.geometry.epipolar_tangency import PoseSet, TangencyErrors, tangency_errors  # noqa: E402
from estimator.geometry.silhouettes import Silhouettes, pack  # noqa: E402
from estimator.geometry.tangent_hull import TangentHull  # noqa: E402

Array = NDArray[np.float64]
REPETITIONS = 15
HSV = Intrinsics(1024, 1024, 6000.0, 6000.0, 511.5, 511.5)
RIG = Intrinsics(1024, 768, 75000.0, 75000.0, 511.5, 383.5)


def scene(rng: np.random.Generator) -> tuple[Silhouettes, PoseSet, Silhouettes, PoseSet]:
    """Exact silhouettes of a cloud of 400 points on a 6 mm ellipsoid: about 45 hull vertices each."""
    points = rng.normal(size=(400, 3))
    points *= np.array([3e-3, 2.4e-3, 1.9e-3]) / np.linalg.norm(points, axis=1, keepdims=True)
    frames, views = _poses(rng, 100, 0.6), _poses(rng, 60, 1.275)
    return _silhouettes(points, frames, HSV), frames, _silhouettes(points, views, RIG), views


def _poses(rng: np.random.Generator, count: int, distance_m: float) -> PoseSet:
    R = Rotation.random(count, rng=rng).as_matrix()
    return PoseSet(np.ascontiguousarray(R), np.column_stack([rng.normal(scale=1e-3, size=(count, 2)), np.full(count, distance_m)]))


def _silhouettes(points: Array, poses: PoseSet, camera: Intrinsics) -> Silhouettes:
    hulls = []
    for R, t in zip(poses.R, poses.t, strict=True):
        seen = camera.project(points @ R.T + t)
        rim = seen[ConvexHull(seen).vertices]
        hulls.append(TangentHull(rim, np.full(len(rim), 0.1), 0.2, 0.2, len(rim)))
    return pack(hulls, [camera] * len(hulls))


def in_numpy(first: Silhouettes, poses: PoseSet, second: Silhouettes, second_poses: PoseSet) -> tuple[Array, Array, Array, Array]:
    """Errors (n, k, 4), variances (n, k, 4), pose Jacobian (n, k, 4, 6) and normal matrices (n, 6, 6), pivot at the origin."""
    R_a, t_a, R_b, t_b = poses.R, poses.t, second_poses.R, second_poses.t
    centre = -np.einsum("kji,kj->ki", R_b, t_b)
    b = np.einsum("nij,kj->nki", R_a, centre) + t_a[:, None]
    length = np.linalg.norm(b, axis=2)
    pivot = np.broadcast_to(t_a[:, None], b.shape)
    e1 = pivot - (np.sum(pivot * b, axis=2) / length**2)[..., None] * b
    e1 /= np.linalg.norm(e1, axis=2, keepdims=True)
    e2 = np.cross(b, e1) / length[..., None]
    M = np.einsum("kij,nlj->nkil", R_b, R_a)
    u_a = _tangency_rays(first, e1, e2, of_first=True)
    u_b = _tangency_rays(second, np.einsum("nkij,nkj->nki", M, e1), np.einsum("nkij,nkj->nki", M, e2), of_first=False)
    w = np.einsum("nkji,nkmj->nkmi", M, u_b)
    bm, arm = b[:, :, None], (b - pivot)[:, :, None]
    outward = np.array([1.0, -1.0])[:, None]
    n_other, n_own = np.cross(bm, w), np.cross(bm, u_a)
    error_a, q_a = _distance(n_other, u_a, first.focal_px[:, None, None])
    side = np.cross(w, q_a)
    rows_a = np.concatenate([side, np.cross(arm, side) + np.cross(w, np.cross(q_a, bm))], axis=3) * outward
    turned = np.einsum("nkij,nkmj->nkmi", M, n_own)
    error_b, q = _distance(turned, u_b, second.focal_px[None, :, None])
    q_b = np.einsum("nkji,nkmj->nkmi", M, q)
    side = np.cross(u_a, q_b)
    rows_b = np.concatenate([side, np.cross(arm, side) - np.cross(n_own, q_b)], axis=3) * outward
    ratio = _pixels(n_own, length, first.focal_px[:, None, None]) / _pixels(
        np.einsum("nkij,nkmj->nkmi", M, n_other), length, second.focal_px[None, :, None]
    )
    noise = 0.1**2 + 0.0 * ratio
    error = np.concatenate([error_a, error_b], axis=2) * np.array([1.0, -1.0, 1.0, -1.0])
    variance = np.concatenate([noise * (1 + ratio**2), noise * (1 + ratio**-2)], axis=2)
    jacobian = np.concatenate([rows_a, rows_b], axis=2)
    flat = (jacobian * np.sqrt(0.5 / variance)[..., None]).reshape(len(R_a), -1, 6)
    return error, variance, jacobian, np.swapaxes(flat, 1, 2) @ flat


def _tangency_rays(s: Silhouettes, e1: Array, e2: Array, *, of_first: bool) -> Array:
    counts = np.diff(s.offsets)
    padded = np.zeros((len(s), counts.max(), 3))
    for i in range(len(s)):
        rows = s.slice_of(i)
        padded[i, : counts[i]] = np.column_stack([s.xy[rows], np.ones(counts[i])])
        padded[i, counts[i] :] = padded[i, 0]
    letters = "nvi,nki->nkv" if of_first else "kvi,nki->nkv"
    tangent = np.einsum(letters, padded, e2, optimize=True) / np.einsum(letters, padded, e1, optimize=True)
    chosen = np.stack([np.argmax(tangent, axis=2), np.argmin(tangent, axis=2)], axis=2)
    index = np.arange(len(s))[:, None, None] if of_first else np.arange(len(s))[None, :, None]
    return np.asarray(padded[index, chosen])


def _distance(n: Array, u: Array, focal: Array) -> tuple[Array, Array]:
    a = n[..., :2] / focal
    g = np.linalg.norm(a, axis=-1)
    s = np.sum(n * u, axis=-1)
    q = u / g[..., None]
    q[..., :2] -= (s / g**3)[..., None] * a / focal
    return s / g, q


def _pixels(n: Array, length: Array, focal: Array) -> Array:
    return np.asarray(np.sum(n * n, axis=-1) / (length[..., None] * np.linalg.norm(n[..., :2] / focal, axis=-1)))


def _check(ours: TangencyErrors, plain: tuple[Array, Array, Array, Array]) -> None:
    error, variance, jacobian, normal = plain
    for name, a, b in (
        ("errors", ours.error, error),
        ("variances", ours.variance, variance),
        ("Jacobian", ours.jacobian[..., :6], jacobian),
        ("normal matrices", ours.normal[:, :6, :6], normal),
    ):
        apart = float(np.abs(a - b).max() / np.abs(b).max()) if name != "errors" else float(np.abs(a - b).max())
        if not apart < 1e-8:
            raise RuntimeError(f"kernel and plain NumPy disagree in {name} by {apart:.2g}")


def _milliseconds(work: Any) -> float:
    work()
    times = []
    for _ in range(REPETITIONS):
        began = time.process_time()
        work()
        times.append(1e3 * (time.process_time() - began))
    return float(np.median(times))


def figures() -> list[dict[str, Any]]:
    """Every figure with its unit and, where there is one, its limit."""
    first, poses, second, second_poses = scene(np.random.default_rng(1))
    centre = np.zeros(3)
    _check(tangency_errors(first, poses, second, second_poses, pivot_particle=centre), in_numpy(first, poses, second, second_poses))
    kernel = _milliseconds(lambda: tangency_errors(first, poses, second, second_poses, pivot_particle=centre))
    plain = _milliseconds(lambda: in_numpy(first, poses, second, second_poses))
    return [
        {"name": "kernel, 100 x 60 pairs", "value": kernel, "unit": "ms of one core", "limit": 10.0, "direction": "lower"},
        {"name": "the same in plain NumPy", "value": plain, "unit": "ms of one core"},
        {"name": "plain NumPy over kernel", "value": plain / kernel, "unit": "ratio"},
    ]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.parse_args()
    print(json.dumps(figures()))
