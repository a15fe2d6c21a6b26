"""The epipolar tangency error (ETE) of pairs of silhouettes, its derivatives and its expected variance.

Two cameras and one rigid body: a plane through both camera centres (the baseline) that touches the body touches both
silhouettes. Each pair has two such planes; each silhouette's tangency point should lie on the other's epipolar tangent
line, which gives four distances in pixels [Wong & Cipolla 2001; Forbes 2007, ch. 4].

Every hull vertex is a ray. Its angle in the pencil of planes about the baseline needs only the baseline's *direction*, so
epipoles at infinity or behind a camera need no branch. With the tangency vertices held fixed the derivative of the extreme
angle is exact almost everywhere (envelope theorem).

The four errors of a pair are two measurements seen twice: moving one tangency point outwards by one pixel changes its own
error by +1 and its partner's by -1/r, where r is the ratio of pixels per radian of pencil angle in the two pictures. Hence
``var = sigma_own² + r² sigma_other²``, and each whitened error counts half.

Not valid where the baseline passes through a silhouette: there is no tangent plane; the pair is marked and left out.
"""

from dataclasses import dataclass

import numba
import numpy as np
from numpy.typing import NDArray

from estimator.geometry.silhouettes import SURE_PX, Silhouettes

Array = NDArray[np.float64]

N_COLUMNS = 8
"""Columns of a pair's Jacobian: translation (3), rotation (3), outline offset of the first and of the second silhouette."""


@dataclass(frozen=True)
class PoseSet:
    """Poses of the particle in each silhouette's camera: ``R`` (n, 3, 3), ``t`` (n, 3) m, particle to camera coordinates."""

    R: Array
    t: Array


@dataclass(frozen=True)
class TangencyErrors:
    """ETE of every (first, second) pair.

    ``error`` (n, k, 4) px: first's upper, first's lower, second's upper, second's lower tangency; positive where the tangency point
    lies outside the other silhouette's tangent line. ``variance`` (n, k, 4) px². ``jacobian`` (n, k, 4, 8): with respect to the
    translation (m) and rotation (rad) of the first's pose, in the axes of ``axes``, rotating about the pivot, and to the two outline
    offsets (px). ``tangency`` (n, k, 4): vertex numbers within each hull;
    ``direction`` (n, k, 4, 2): outward unit normals of the tangent lines in pixels. ``valid`` (n, k). ``normal`` (n, 8, 8), ``gradient``
    (n, 8) and ``cost`` (n,) are the whitened sums over each first silhouette's pairs.
    """

    error: Array
    variance: Array
    jacobian: Array
    tangency: NDArray[np.int32]
    direction: Array
    valid: NDArray[np.bool_]
    normal: Array
    gradient: Array
    cost: Array

    @property
    def told(self) -> NDArray[np.bool_]:
        """Errors (n, k, 4) that say something: those of pairs with tangent planes, at no unsure vertex."""
        return _told(self.valid, self.variance)

    def told_in(self, i: int | np.integer) -> NDArray[np.bool_]:
        """Those (k, 4) of the first silhouette ``i``."""
        return _told(self.valid[i], self.variance[i])

    @property
    def telling(self) -> NDArray[np.int64]:
        """Numbers of the first silhouettes whose own tangencies say something."""
        return np.flatnonzero(self.told[:, :, :2].any(axis=(1, 2)))

    @property
    def rms_px(self) -> float:
        """RMS (px) of the errors in the first pictures; infinite where there is none."""
        told = self.told[:, :, :2]
        return float(np.sqrt(np.mean(self.error[:, :, :2][told] ** 2))) if told.any() else float("inf")


def _told(valid: NDArray[np.bool_], variance: Array) -> NDArray[np.bool_]:
    return np.asarray(valid[..., None] & (variance < SURE_PX**2))


_part = numba.njit(cache=True, inline="always", error_model="numpy")
"""Compiled into the function that calls it: views of small arrays that are handed on take longer than what is done with them."""


@_part
def _cross(a, b, out):  # type: ignore[no-untyped-def]
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@_part
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@_part
def _rotate(R, a, out):  # type: ignore[no-untyped-def]
    for i in range(3):
        out[i] = R[i, 0] * a[0] + R[i, 1] * a[1] + R[i, 2] * a[2]


@_part
def _rotate_back(R, a, out):  # type: ignore[no-untyped-def]
    for i in range(3):
        out[i] = R[0, i] * a[0] + R[1, i] * a[1] + R[2, i] * a[2]


@numba.njit(cache=True, error_model="numpy")
def _extremes(xy, e1, e2):  # type: ignore[no-untyped-def]
    """Vertices of largest and smallest pencil angle; (-1, -1) where a ray is 90° or more from the reference ``e1``."""
    upper, lower = -1, -1
    high, low = -np.inf, np.inf
    for v in range(xy.shape[0]):
        along = e1[0] * xy[v, 0] + e1[1] * xy[v, 1] + e1[2]
        if along <= 0.0:
            return -1, -1
        tangent = (e2[0] * xy[v, 0] + e2[1] * xy[v, 1] + e2[2]) / along
        if tangent > high:
            high, upper = tangent, v
        if tangent < low:
            low, lower = tangent, v
    return upper, lower


@_part
def _line_distance(n, x, y, focal, q):  # type: ignore[no-untyped-def]
    """Distance (px) of the pixel of ray (x, y, 1) from the image of the plane with normal ``n``; ``q`` gets its gradient in ``n``."""
    a, b = n[0] / focal[0], n[1] / focal[1]
    g = np.sqrt(a * a + b * b)
    s = n[0] * x + n[1] * y + n[2]
    q[0] = x / g - s * a / focal[0] / g**3
    q[1] = y / g - s * b / focal[1] / g**3
    q[2] = 1.0 / g
    return s / g


@_part
def _unit_in_picture(n, focal, outward, direction):  # type: ignore[no-untyped-def]
    """Unit normal, in pixels and outwards from the silhouette, of the image of the plane with normal ``n``."""
    a, b = n[0] / focal[0], n[1] / focal[1]
    g = outward / np.sqrt(a * a + b * b)
    direction[0], direction[1] = a * g, b * g


@_part
def _pencil_scale(n, baseline_length, focal):  # type: ignore[no-untyped-def]
    """Pixels that a tangency point moves per radian of pencil angle; ``n`` is baseline x ray in that camera's axes."""
    a, b = n[0] / focal[0], n[1] / focal[1]
    return _dot(n, n) / (baseline_length * np.sqrt(a * a + b * b))


@_part
def _baseline(poses, pivot, b, arm, centre):  # type: ignore[no-untyped-def]
    """Baseline ``b``, the pivot (``arm[1]``) and the arm from it to the second camera (``arm[0]``), all in the first's axes."""
    (R_a, t_a), (R_b, t_b) = poses
    _rotate_back(R_b, t_b, centre)
    for i in range(3):
        centre[i] = -centre[i]
    _rotate(R_a, centre, b)
    _rotate(R_a, pivot, arm[1])
    for i in range(3):
        b[i] += t_a[i]
        arm[1, i] += t_a[i]
        arm[0, i] = b[i] - arm[1, i]
    return np.sqrt(_dot(b, b))


@_part
def _pencil_axes(b, length, pivot, axes):  # type: ignore[no-untyped-def]
    """Unit axes across the baseline ``b``: ``axes[0]`` towards the pivot, then b x axes[0]; False for a pivot on the baseline."""
    along = _dot(pivot, b) / (length * length)
    for i in range(3):
        axes[0, i] = pivot[i] - along * b[i]
    norm = np.sqrt(_dot(axes[0], axes[0]))
    if norm <= 1e-12:
        return False
    for i in range(3):
        axes[0, i] /= norm
    _cross(b, axes[0], axes[1])
    for i in range(3):
        axes[1, i] /= length
    return True


@_part
def _second_axes(R_a, R_b, a, out, tmp):  # type: ignore[no-untyped-def]
    """A direction ``a`` in the first camera's axes, in the second's."""
    _rotate_back(R_a, a, tmp)
    _rotate(R_b, tmp, out)


@_part
def _first_error(geometry, rays, outward, row, direction):  # type: ignore[no-untyped-def]
    """The first's tangency point against the plane through the second's tangency ray ``w``; fills the pose columns of ``row``."""
    _R_a, _R_b, b, arm, focal, _focal_b, work = geometry
    u_a, w, _u_b = rays
    n, q, side, tmp = work[0], work[1], work[2], work[3]
    _cross(b, w, n)
    error = outward * _line_distance(n, u_a[0], u_a[1], focal, q)
    _unit_in_picture(n, focal, outward, direction)
    _cross(w, q, side)
    _cross(q, b, tmp)
    row[:3] = side
    _cross(arm[0], side, row[3:6])
    _cross(w, tmp, side)
    for i in range(3):
        row[i] *= outward
        row[3 + i] = outward * (row[3 + i] + side[i])
    return error


@_part
def _second_error(geometry, rays, outward, row, direction):  # type: ignore[no-untyped-def]
    """The second's tangency point against the plane through the first's tangency ray; fills the pose columns of ``row``."""
    R_a, R_b, b, arm, _focal_a, focal, work = geometry
    u_a, _w, u_b = rays
    n, turned, q, side, tmp = work[0], work[1], work[2], work[3], work[4]
    _cross(b, u_a, n)
    _second_axes(R_a, R_b, n, turned, tmp)
    error = outward * _line_distance(turned, u_b[0], u_b[1], focal, q)
    _unit_in_picture(turned, focal, outward, direction)
    _second_axes(R_b, R_a, q, turned, tmp)
    _cross(u_a, turned, side)
    _cross(n, turned, tmp)
    row[:3] = side
    _cross(arm[0], side, row[3:6])
    for i in range(3):
        row[i] *= outward
        row[3 + i] = outward * (row[3 + i] - tmp[i])
    return error


@_part
def _scale_ratio(geometry, rays, length):  # type: ignore[no-untyped-def]
    """Pixels per radian of pencil angle in the first picture over those in the second."""
    R_a, R_b, b, _arm, focal_a, focal_b, work = geometry
    u_a, w, _u_b = rays
    n, turned, tmp = work[0], work[1], work[2]
    _cross(b, u_a, n)
    scale_a = _pencil_scale(n, length, focal_a)
    _cross(b, w, n)
    _second_axes(R_a, R_b, n, turned, tmp)
    return scale_a / _pencil_scale(turned, length, focal_b)


@_part
def _pair(poses, pivot, hulls, out, work):  # type: ignore[no-untyped-def]
    """Fill the errors, variances, Jacobian and tangency numbers of one pair; False where there is no tangent plane."""
    (R_a, _t_a), (R_b, _t_b) = poses
    (xy_a, sigma_a, focal_a), (xy_b, sigma_b, focal_b) = hulls
    error, variance, jacobian, tangency, direction = out
    b, arm, axes, axes_b = work[5], work[6:8], work[8:10], work[10:12]
    length = _baseline(poses, pivot, b, arm, work[0])
    if length <= 1e-9 or not _pencil_axes(b, length, arm[1], axes):
        return False
    _second_axes(R_a, R_b, axes[0], axes_b[0], work[0])
    _second_axes(R_a, R_b, axes[1], axes_b[1], work[0])
    tangency[0], tangency[1] = _extremes(xy_a, axes[0], axes[1])
    tangency[2], tangency[3] = _extremes(xy_b, axes_b[0], axes_b[1])
    if tangency[0] < 0 or tangency[2] < 0:
        return False
    geometry = (R_a, R_b, b, arm, focal_a, focal_b, work)
    u_a, u_b, w = work[12], work[13], work[14]
    u_a[2], u_b[2] = 1.0, 1.0
    for m in range(2):
        v_a, v_b = tangency[m], tangency[2 + m]
        u_a[0], u_a[1], u_b[0], u_b[1] = xy_a[v_a, 0], xy_a[v_a, 1], xy_b[v_b, 0], xy_b[v_b, 1]
        _second_axes(R_b, R_a, u_b, w, work[0])
        rays = (u_a, w, u_b)
        outward = 1.0 - 2.0 * m
        error[m] = _first_error(geometry, rays, outward, jacobian[m], direction[m])
        error[2 + m] = _second_error(geometry, rays, outward, jacobian[2 + m], direction[2 + m])
        ratio = _scale_ratio(geometry, rays, length)
        jacobian[m, 6], jacobian[m, 7] = 1.0, -ratio
        jacobian[2 + m, 6], jacobian[2 + m, 7] = -1.0 / ratio, 1.0
        own, other = sigma_a[v_a] ** 2, sigma_b[v_b] ** 2
        variance[m] = own + ratio**2 * other
        variance[2 + m] = other + own / ratio**2
    return True


@_part
def _turn_columns(jacobian, R):  # type: ignore[no-untyped-def]
    """Express the pose columns, given along camera axes, along the axes that ``R`` maps to camera axes."""
    row = np.empty(3)
    for m in range(4):
        for block in (0, 3):
            _rotate_back(R, jacobian[m, block : block + 3], row)
            jacobian[m, block : block + 3] = row


@_part
def _accumulate(pair, huber, normal, gradient):  # type: ignore[no-untyped-def]
    """Add one pair's whitened outer products; returns its (Huber) cost. Each of the four errors counts half."""
    error, variance, jacobian, weight = pair
    cost = 0.0
    for m in range(4):
        z2 = error[m] ** 2 / variance[m]
        robust = 1.0
        if z2 > huber * huber:
            z = np.sqrt(z2)
            robust = huber / z
            cost += 0.25 * weight * (2.0 * huber * z - huber * huber)
        else:
            cost += 0.25 * weight * z2
        w = 0.5 * weight * robust / variance[m]
        for i in range(N_COLUMNS):
            wi = w * jacobian[m, i]
            gradient[i] += wi * error[m]
            for j in range(i + 1):
                normal[i, j] += wi * jacobian[m, j]
    return cost


@numba.njit(cache=True, error_model="numpy")
def _kernel(first, second, weight, settings, arrays):  # type: ignore[no-untyped-def]
    R_a, t_a, axes, xy_a, sigma_a, focal_a, offsets_a = first
    R_b, t_b, xy_b, sigma_b, focal_b, offsets_b = second
    error, variance, jacobian, tangency, direction, valid, normal, gradient, cost = arrays
    pivot, huber, offset_px = settings
    n, k = R_a.shape[0], R_b.shape[0]
    work = np.empty((15, 3))
    for i in range(n):
        a0, a1 = offsets_a[i], offsets_a[i + 1]
        normal[i] = 0.0
        gradient[i] = 0.0
        cost[i] = 0.0
        for j in range(k):
            b0, b1 = offsets_b[j], offsets_b[j + 1]
            if weight[i, j] == 0.0 or a0 == a1 or b0 == b1:
                valid[i, j] = False
                continue
            out = (error[i, j], variance[i, j], jacobian[i, j], tangency[i, j], direction[i, j])
            valid[i, j] = _pair(
                ((R_a[i], t_a[i]), (R_b[j], t_b[j])),
                pivot,
                ((xy_a[a0:a1], sigma_a[a0:a1], focal_a[i]), (xy_b[b0:b1], sigma_b[b0:b1], focal_b[j])),
                out,
                work,
            )
            if valid[i, j]:
                for m in range(4):
                    error[i, j, m] += offset_px * jacobian[i, j, m, 6]
                _turn_columns(jacobian[i, j], axes[i])
                cost[i] += _accumulate((error[i, j], variance[i, j], jacobian[i, j], weight[i, j]), huber, normal[i], gradient[i])
        for r in range(N_COLUMNS):
            for c in range(r):
                normal[i, c, r] = normal[i, r, c]


def empty_errors(n: int, k: int) -> TangencyErrors:
    """Room for the errors of ``n`` first and ``k`` second silhouettes."""
    return TangencyErrors(
        error=np.zeros((n, k, 4)),
        variance=np.ones((n, k, 4)),
        jacobian=np.zeros((n, k, 4, N_COLUMNS)),
        tangency=np.full((n, k, 4), -1, dtype=np.int32),
        direction=np.zeros((n, k, 4, 2)),
        valid=np.zeros((n, k), dtype=np.bool_),
        normal=np.zeros((n, N_COLUMNS, N_COLUMNS)),
        gradient=np.zeros((n, N_COLUMNS)),
        cost=np.zeros(n),
    )


def tangency_errors(
    first: Silhouettes,
    poses: PoseSet,
    second: Silhouettes,
    second_poses: PoseSet,
    *,
    pivot_particle: Array,
    axes: Array | None = None,
    weight: Array | None = None,
    huber: float = np.inf,
    offset_px: float = 0.0,
) -> TangencyErrors:
    """ETE of every first silhouette with every second one.

    Parameters
    ----------
    first, second : Silhouettes
        n and k convex hulls of tangency candidates.
    poses, second_poses : PoseSet
        Particle to camera coordinates, (m).
    pivot_particle : array (3,)
        The point (m, particle frame) that a rotation of the first's pose leaves in place: the centre of mass.
    axes : array (n, 3, 3), optional
        ``R_cam_world``: pose columns are then given along world axes; camera axes when absent.
    weight : array (n, k), optional
        Weight of each pair, 0 leaves it out.
    huber : float
        Whitened residual beyond which a residual's influence stays constant [Huber 1964].
    offset_px : float
        How far the first's outlines are to be moved outwards (px) before they are compared.

    Returns
    -------
    TangencyErrors
    """
    n, k = len(poses.R), len(second_poses.R)
    result = empty_errors(n, k)
    turned = np.broadcast_to(np.eye(3), (n, 3, 3)).copy() if axes is None else np.ascontiguousarray(axes)
    weights = np.ones((n, k)) if weight is None else np.ascontiguousarray(weight, dtype=np.float64)
    _kernel(
        (poses.R, poses.t, turned, first.xy, first.sigma_px, first.focal_px, first.offsets),
        (second_poses.R, second_poses.t, second.xy, second.sigma_px, second.focal_px, second.offsets),
        weights,
        (np.ascontiguousarray(pivot_particle, dtype=np.float64), float(huber), float(offset_px)),
        (
            result.error,
            result.variance,
            result.jacobian,
            result.tangency,
            result.direction,
            result.valid,
            result.normal,
            result.gradient,
            result.cost,
        ),
    )
    return result
