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

    @property
    def rms_of_each_px(self) -> Array:
        """RMS error (n,) px of each first silhouette, in its picture, over all its told errors; 0 where it has none."""
        told = self.told[:, :, :2]
        squares = np.where(told, self.error[:, :, :2] ** 2, 0.0).sum(axis=(1, 2))
        return np.asarray(np.sqrt(squares / np.maximum(told.sum(axis=(1, 2)), 1)))


def _told(valid: NDArray[np.bool_], variance: Array) -> NDArray[np.bool_]:
    return np.asarray(valid[..., None] & (variance < SURE_PX**2))


# Three-vectors and matrices are tuples of floats in the kernel: a slice of an array is counted, and counting took as long as computing.
_compiled = numba.njit(cache=True, error_model="numpy")


@_compiled
def _vector(a, i):  # type: ignore[no-untyped-def]
    return a[i, 0], a[i, 1], a[i, 2]


@_compiled
def _matrix(a, i):  # type: ignore[no-untyped-def]
    return (a[i, 0, 0], a[i, 0, 1], a[i, 0, 2]), (a[i, 1, 0], a[i, 1, 1], a[i, 1, 2]), (a[i, 2, 0], a[i, 2, 1], a[i, 2, 2])


@_compiled
def _cross(a, b):  # type: ignore[no-untyped-def]
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@_compiled
def _dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@_compiled
def _rotate(R, a):  # type: ignore[no-untyped-def]
    return _dot(R[0], a), _dot(R[1], a), _dot(R[2], a)


@_compiled
def _rotate_back(R, a):  # type: ignore[no-untyped-def]
    return (
        R[0][0] * a[0] + R[1][0] * a[1] + R[2][0] * a[2],
        R[0][1] * a[0] + R[1][1] * a[1] + R[2][1] * a[2],
        R[0][2] * a[0] + R[1][2] * a[1] + R[2][2] * a[2],
    )


@_compiled
def _between(R_a, R_b, a):  # type: ignore[no-untyped-def]
    """A direction ``a`` in the axes of the camera ``R_a``, in those of ``R_b``."""
    return _rotate(R_b, _rotate_back(R_a, a))


@_compiled
def _extremes(xy, start, stop, e1, e2):  # type: ignore[no-untyped-def]
    """Vertices of largest and smallest pencil angle; (-1, -1) where a ray is 90° or more from the reference ``e1``."""
    upper, lower = -1, -1
    high, low = -np.inf, np.inf
    for v in range(start, stop):
        x, y = xy[v, 0], xy[v, 1]
        along = e1[0] * x + e1[1] * y + e1[2]
        if along <= 0.0:
            return -1, -1
        tangent = (e2[0] * x + e2[1] * y + e2[2]) / along
        if tangent > high:
            high, upper = tangent, v - start
        if tangent < low:
            low, lower = tangent, v - start
    return upper, lower


@_compiled
def _line_distance(n, x, y, focal):  # type: ignore[no-untyped-def]
    """Distance (px) of the pixel of ray (x, y, 1) from the image of the plane with normal ``n``, and its gradient in ``n``."""
    a, b = n[0] / focal[0], n[1] / focal[1]
    g = np.sqrt(a * a + b * b)
    s = n[0] * x + n[1] * y + n[2]
    return s / g, (x / g - s * a / focal[0] / g**3, y / g - s * b / focal[1] / g**3, 1.0 / g)


@_compiled
def _unit_in_picture(n, focal, outward):  # type: ignore[no-untyped-def]
    """Unit normal, in pixels and outwards from the silhouette, of the image of the plane with normal ``n``."""
    a, b = n[0] / focal[0], n[1] / focal[1]
    g = outward / np.sqrt(a * a + b * b)
    return a * g, b * g


@_compiled
def _pencil_scale(n, baseline_length, focal):  # type: ignore[no-untyped-def]
    """Pixels that a tangency point moves per radian of pencil angle; ``n`` is baseline x ray in that camera's axes."""
    a, b = n[0] / focal[0], n[1] / focal[1]
    return _dot(n, n) / (baseline_length * np.sqrt(a * a + b * b))


@_compiled
def _baseline(first, second, pivot):  # type: ignore[no-untyped-def]
    """Baseline, the arm from the pivot to the second camera, and the pivot, all in the first's axes."""
    (R_a, t_a), (R_b, t_b) = first, second
    there = _rotate_back(R_b, t_b)
    b = _rotate(R_a, (-there[0], -there[1], -there[2]))
    b = b[0] + t_a[0], b[1] + t_a[1], b[2] + t_a[2]
    p = _rotate(R_a, pivot)
    p = p[0] + t_a[0], p[1] + t_a[1], p[2] + t_a[2]
    return b, (b[0] - p[0], b[1] - p[1], b[2] - p[2]), p


@_compiled
def _pencil_axes(b, length, pivot):  # type: ignore[no-untyped-def]
    """Unit axes across the baseline ``b``: towards the pivot, then b x that one; False for a pivot on the baseline."""
    along = _dot(pivot, b) / (length * length)
    e = pivot[0] - along * b[0], pivot[1] - along * b[1], pivot[2] - along * b[2]
    norm = np.sqrt(_dot(e, e))
    e = e[0] / norm, e[1] / norm, e[2] / norm
    f = _cross(b, e)
    return norm > 1e-12, e, (f[0] / length, f[1] / length, f[2] / length)


@_compiled
def _pose_columns(side, lever, further, outward):  # type: ignore[no-untyped-def]
    """Derivatives of an error by translation and rotation (6,), from those of its plane's normal."""
    return (
        side[0] * outward,
        side[1] * outward,
        side[2] * outward,
        outward * (lever[0] + further[0]),
        outward * (lever[1] + further[1]),
        outward * (lever[2] + further[2]),
    )


@_compiled
def _first_error(geometry, u_a, w, outward):  # type: ignore[no-untyped-def]
    """The first's tangency point against the plane through the second's tangency ray ``w``: error, pose columns, direction."""
    _R_a, _R_b, b, arm, focal, _focal_b = geometry
    n = _cross(b, w)
    distance, q = _line_distance(n, u_a[0], u_a[1], focal)
    side = _cross(w, q)
    columns = _pose_columns(side, _cross(arm, side), _cross(w, _cross(q, b)), outward)
    return outward * distance, columns, _unit_in_picture(n, focal, outward)


@_compiled
def _second_error(geometry, u_a, u_b, outward):  # type: ignore[no-untyped-def]
    """The second's tangency point against the plane through the first's tangency ray: error, pose columns, direction."""
    R_a, R_b, b, arm, _focal_a, focal = geometry
    n = _cross(b, u_a)
    turned = _between(R_a, R_b, n)
    distance, q = _line_distance(turned, u_b[0], u_b[1], focal)
    back = _between(R_b, R_a, q)
    side, tmp = _cross(u_a, back), _cross(n, back)
    columns = _pose_columns(side, _cross(arm, side), (-tmp[0], -tmp[1], -tmp[2]), outward)
    return outward * distance, columns, _unit_in_picture(turned, focal, outward)


@_compiled
def _scale_ratio(geometry, u_a, w, length):  # type: ignore[no-untyped-def]
    """Pixels per radian of pencil angle in the first picture over those in the second."""
    R_a, R_b, b, _arm, focal_a, focal_b = geometry
    scale_a = _pencil_scale(_cross(b, u_a), length, focal_a)
    return scale_a / _pencil_scale(_between(R_a, R_b, _cross(b, w)), length, focal_b)


@_compiled
def _touched(poses, pivot, hull_a, hull_b):  # type: ignore[no-untyped-def]
    """Whether there are tangent planes, baseline, arm and its length, and the tangency numbers; hulls are vertices, start and stop."""
    first, second = poses
    xy_a, start_a, stop_a = hull_a
    xy_b, start_b, stop_b = hull_b
    line, arm, there = _baseline(first, second, pivot)
    length = np.sqrt(_dot(line, line))
    found, e, f = _pencil_axes(line, length, there)
    if length <= 1e-9 or not found:
        return False, line, arm, length, (-1, -1, -1, -1)
    upper, lower = _extremes(xy_a, start_a, stop_a, e, f)
    e, f = _between(first[0], second[0], e), _between(first[0], second[0], f)
    upper_b, lower_b = _extremes(xy_b, start_b, stop_b, e, f)
    return upper >= 0 and upper_b >= 0, line, arm, length, (upper, lower, upper_b, lower_b)


@_compiled
def _put(at, found, axes, jacobian, direction):  # type: ignore[no-untyped-def]
    """Write the pose columns, along the axes that ``axes`` maps to camera axes, and the direction of one error; returns the error."""
    i, j, m = at
    error, columns, d = found
    moved, turned = _rotate_back(axes, columns[:3]), _rotate_back(axes, columns[3:])
    for c in range(3):
        jacobian[i, j, m, c] = moved[c]
        jacobian[i, j, m, 3 + c] = turned[c]
    direction[i, j, m, 0], direction[i, j, m, 1] = d
    return error


@_compiled
def _accumulate(at, settings, pairs, normal, gradient):  # type: ignore[no-untyped-def]
    """Add one pair's whitened outer products; returns its (Huber) cost. Each of the four errors counts half."""
    i, j = at
    weight, huber = settings
    error, variance, jacobian = pairs
    cost = 0.0
    for m in range(4):
        e, var = error[i, j, m], variance[i, j, m]
        z2 = e**2 / var
        robust = 1.0
        if z2 > huber * huber:
            z = np.sqrt(z2)
            robust = huber / z
            cost += 0.25 * weight * (2.0 * huber * z - huber * huber)
        else:
            cost += 0.25 * weight * z2
        w = 0.5 * weight * robust / var
        for r in range(N_COLUMNS):
            wr = w * jacobian[i, j, m, r]
            gradient[i, r] += wr * e
            for c in range(r + 1):
                normal[i, r, c] += wr * jacobian[i, j, m, c]
    return cost


@_compiled
def _kernel(first, second, weight, settings, arrays):  # type: ignore[no-untyped-def]
    R_a, t_a, axes, xy_a, sigma_a, focal_a, offsets_a = first
    R_b, t_b, xy_b, sigma_b, focal_b, offsets_b = second
    error, variance, jacobian, tangency, direction, valid, normal, gradient, cost = arrays
    about, huber, offset_px = settings
    pivot = about[0], about[1], about[2]
    for i in range(R_a.shape[0]):
        pose_a, f_a, a, turn = (_matrix(R_a, i), _vector(t_a, i)), (focal_a[i, 0], focal_a[i, 1]), offsets_a[i], _matrix(axes, i)
        for j in range(R_b.shape[0]):
            pose_b, f_b, b = (_matrix(R_b, j), _vector(t_b, j)), (focal_b[j, 0], focal_b[j, 1]), offsets_b[j]
            if weight[i, j] == 0.0 or a == offsets_a[i + 1] or b == offsets_b[j + 1]:
                continue
            hulls = (xy_a, a, offsets_a[i + 1]), (xy_b, b, offsets_b[j + 1])
            there, line, arm, length, touched = _touched((pose_a, pose_b), pivot, hulls[0], hulls[1])
            tangency[i, j, 0], tangency[i, j, 1], tangency[i, j, 2], tangency[i, j, 3] = touched
            if not there:
                continue
            valid[i, j] = True
            geometry = (pose_a[0], pose_b[0], line, arm, f_a, f_b)
            for m in range(2):
                v_a, v_b, outward = a + tangency[i, j, m], b + tangency[i, j, 2 + m], 1.0 - 2.0 * m
                u_a, u_b = (xy_a[v_a, 0], xy_a[v_a, 1], 1.0), (xy_b[v_b, 0], xy_b[v_b, 1], 1.0)
                w = _between(pose_b[0], pose_a[0], u_b)
                ratio = _scale_ratio(geometry, u_a, w, length)
                jacobian[i, j, m, 6], jacobian[i, j, m, 7] = 1.0, -ratio
                jacobian[i, j, 2 + m, 6], jacobian[i, j, 2 + m, 7] = -1.0 / ratio, 1.0
                error[i, j, m] = _put((i, j, m), _first_error(geometry, u_a, w, outward), turn, jacobian, direction)
                error[i, j, 2 + m] = _put((i, j, 2 + m), _second_error(geometry, u_a, u_b, outward), turn, jacobian, direction)
                own, other = sigma_a[v_a] ** 2, sigma_b[v_b] ** 2
                variance[i, j, m], variance[i, j, 2 + m] = own + ratio**2 * other, other + own / ratio**2
            for m in range(4):
                error[i, j, m] += offset_px * jacobian[i, j, m, 6]
            cost[i] += _accumulate((i, j), (weight[i, j], huber), (error, variance, jacobian), normal, gradient)
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
    pivot_particle : array (3,) m
        The point, particle frame, that a rotation of the first's pose leaves in place: the centre of mass.
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
