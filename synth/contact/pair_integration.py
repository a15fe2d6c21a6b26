"""The equations of motion of two rigid bodies that touch, contact by contact, in steps of fixed length (Runge and Kutta's fourth order).

A contact is a corner of one body on a face of the other, or an edge on an edge. The law at each is that of a corner on a plate
(:func:`synth.contact.integration.corner_force`), in the contact's own axes: the face's normal and tangents, or the normal common to both
edges. Forces are equal and opposite and act at one point, so momentum and angular momentum are kept to the step's error; and the gap's
rate is the relative velocity along the normal, so that an elastic normal force has a potential. A contact begins where its gap closes
within the extent of both features and ends when the bodies part at it: one that slides over an edge meanwhile goes on along the plane of
its face, which within microseconds is some tens of micrometres.

Coordinates are those of the world. Springs turn with the contact's axes.
"""

import numba
import numpy as np

from synth.contact.integration import FEWEST, REACH, corner_force, cut_to_cone, restitution2, turn

SIZE = 28
BODY = 13
X, Q, V, L = 0, 3, 7, 10
NORMAL_WORK, TANGENTIAL_WORK = 26, 27
"""Where each part of a state begins: two bodies of ``BODY`` numbers, then the works."""
SPRING, IMPULSE, POINT = 0, 2, 5
"""The same of a contact: tangential spring force (2,) N, impulse (3,) N s on the first body, its normal part times the place (3,)."""
WIDTH = 9
NORMAL_IMPULSE = 8


@numba.njit(cache=True)
def contact_axes(key, A, RA, xA, B, RB, xB):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """Point, axes (rows: two tangents, normal into the upper body), gap, 1 where the upper body is the first and -1 otherwise."""
    axes = np.empty((3, 3))
    if key[0] == 2:
        pa, pb = xA + RA @ A.vertices[A.ends[key[1], 0]], xB + RB @ B.vertices[B.ends[key[2], 0]]
        da = xA + RA @ A.vertices[A.ends[key[1], 1]] - pa
        db = xB + RB @ B.vertices[B.ends[key[2], 1]] - pb
        n = np.cross(da, db)
        n = n / np.sqrt(n @ n)
        if n @ (RB @ (B.sides[key[2], 0] + B.sides[key[2], 1])) < 0:
            n = -n
        w = pa - pb
        a, b, c, d, e = da @ da, da @ db, db @ db, da @ w, db @ w
        s, t = (b * e - c * d) / (a * c - b * b), (a * e - b * d) / (a * c - b * b)
        axes[0] = da / np.sqrt(a)
        axes[1] = np.cross(n, axes[0])
        axes[2] = n
        return 0.5 * (pa + s * da + pb + t * db), axes, w @ n, 1.0
    if key[0] == 0:
        point = xA + RA @ A.vertices[key[1]]
        face, flat, R, x, sign = B, key[2], RB, xB, 1.0
    else:
        point = xB + RB @ B.vertices[key[2]]
        face, flat, R, x, sign = A, key[1], RA, xA, -1.0
    axes[2] = R @ face.normals[flat]
    axes[0] = R @ face.tangents[flat]
    axes[1] = np.cross(axes[2], axes[0])
    return point, axes, axes[2] @ (point - x) - face.offsets[flat], sign


@numba.njit(cache=True)
def within(key, A, RA, xA, B, RB, xB):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """Whether a contact whose gap is nought lies within the extent of both of its features."""
    if key[0] == 2:
        pa, pb = xA + RA @ A.vertices[A.ends[key[1], 0]], xB + RB @ B.vertices[B.ends[key[2], 0]]
        da = xA + RA @ A.vertices[A.ends[key[1], 1]] - pa
        db = xB + RB @ B.vertices[B.ends[key[2], 1]] - pb
        w = pa - pb
        a, b, c, d, e = da @ da, da @ db, db @ db, da @ w, db @ w
        s, t = (b * e - c * d) / (a * c - b * b), (a * e - b * d) / (a * c - b * b)
        return 0 <= s <= 1 and 0 <= t <= 1
    if key[0] == 0:
        place, face, flat = RB.T @ (xA + RA @ A.vertices[key[1]] - xB), B, key[2]
    else:
        place, face, flat = RA.T @ (xB + RB @ B.vertices[key[2]] - xA), A, key[1]
    for k in range(len(face.offsets)):
        if k != flat and face.normals[k] @ place > face.offsets[k]:
            return False
    return True


@numba.njit(cache=True)
def rates(state, contacts, keys, deepest, armed, pair, surface, d_state, d_contacts):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """Rates of change into ``d_state`` and ``d_contacts``; ``pair``: the two polytopes.

    ``surface``: the law's constants (:mod:`synth.contact.integration`); masses (2,), moments (2, 3) flat and gravity (3,).
    """
    (A, B), (c, fixed) = pair, surface
    R, w = np.empty((2, 3, 3)), np.empty((2, 3))
    d_state[:] = 0.0
    for k in range(2):
        s, d = state[BODY * k : BODY * (k + 1)], d_state[BODY * k : BODY * (k + 1)]
        R[k] = turn(s[Q : Q + 4])
        w[k] = R[k] @ ((R[k].T @ s[L : L + 3]) / fixed[2 + 3 * k : 5 + 3 * k])
        x, y, z, h = s[Q], s[Q + 1], s[Q + 2], s[Q + 3]
        d[X : X + 3] = s[V : V + 3]
        d[Q] = 0.5 * (h * w[k, 0] + w[k, 1] * z - w[k, 2] * y)
        d[Q + 1] = 0.5 * (h * w[k, 1] + w[k, 2] * x - w[k, 0] * z)
        d[Q + 2] = 0.5 * (h * w[k, 2] + w[k, 0] * y - w[k, 1] * x)
        d[Q + 3] = -0.5 * (w[k, 0] * x + w[k, 1] * y + w[k, 2] * z)
        d[V : V + 3] = fixed[8:11]
    xA, xB = state[X : X + 3], state[BODY : BODY + 3]
    for i in range(len(keys)):
        d_contacts[i] = 0.0
        if not armed[i]:
            continue
        point, axes, gap, sign = contact_axes(keys[i], A, R[0], xA, B, R[1], xB)
        if gap >= 0 and deepest[i] == 0:
            continue
        u = state[V : V + 3] + np.cross(w[0], point - xA) - state[BODY + V : BODY + V + 3] - np.cross(w[1], point - xB)
        u = axes @ (sign * u)
        fx, fy, fz, sx, sy, _ = corner_force(-gap, u, deepest[i], contacts[i, SPRING : SPRING + 2], c)
        force = sign * (fx * axes[0] + fy * axes[1] + fz * axes[2])
        d_contacts[i, 0], d_contacts[i, 1] = sx, sy
        d_contacts[i, IMPULSE : IMPULSE + 3] = force
        d_contacts[i, POINT : POINT + 3] = fz * point
        d_contacts[i, NORMAL_IMPULSE] = fz
        d_state[V : V + 3] += force / fixed[0]
        d_state[BODY + V : BODY + V + 3] -= force / fixed[1]
        d_state[L : L + 3] += np.cross(point - xA, force)
        d_state[BODY + L : BODY + L + 3] -= np.cross(point - xB, force)
        d_state[NORMAL_WORK] += fz * u[2]
        d_state[TANGENTIAL_WORK] += fx * u[0] + fy * u[1]


@numba.njit(cache=True)
def settle(state, contacts, keys, deepest, armed, A, B, c, margin):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """After a step: arm contacts about to begin, end others, note the deepest overlaps, cut springs to the cone; how many touch.

    A contact is armed where its gap is open, but narrower than ``margin``, and lies within both features.
    """
    RA, RB = turn(state[Q : Q + 4]), turn(state[BODY + Q : BODY + Q + 4])
    xA, xB = state[X : X + 3], state[BODY : BODY + 3]
    touching = 0
    for i in range(len(keys)):
        _, _, gap, _ = contact_axes(keys[i], A, RA, xA, B, RB, xB)
        overlap = -gap
        if not armed[i] or (deepest[i] == 0 and gap >= 0):
            armed[i] = 0 <= gap < margin and within(keys[i], A, RA, xA, B, RB, xB)
            continue
        deepest[i] = max(deepest[i], overlap)
        share = restitution2(deepest[i], c)
        zero = (1 - share) * deepest[i]
        if overlap <= 0 and overlap <= zero - c[REACH]:
            deepest[i], armed[i] = 0.0, False
            contacts[i, SPRING : SPRING + 2] = 0.0
            continue
        touching += 1
        cut_to_cone(contacts[i, SPRING : SPRING + 2], overlap, deepest[i], share, c)
    return touching


@numba.njit(cache=True)
def advance(state, contacts, keys, deepest, armed, pair, surface, step, margin, most):  # type: ignore[no-untyped-def] # noqa: PLR0917
    """Take up to ``most`` steps, in place, until nothing touches that has touched.

    Returns the number of steps, whether the bodies have parted, the least work of the normal forces and the largest overlap on the way.
    """
    n = len(keys)
    (A, B), (c, _) = pair, surface
    k, kc = np.empty((4, SIZE)), np.zeros((4, n, WIDTH))
    settle(state, contacts, keys, deepest, armed, A, B, c, margin)
    least, largest, touched = state[NORMAL_WORK], 0.0, deepest.max() > 0
    for number in range(most):
        rates(state, contacts, keys, deepest, armed, pair, surface, k[0], kc[0])
        rates(state + 0.5 * step * k[0], contacts + 0.5 * step * kc[0], keys, deepest, armed, pair, surface, k[1], kc[1])
        rates(state + 0.5 * step * k[1], contacts + 0.5 * step * kc[1], keys, deepest, armed, pair, surface, k[2], kc[2])
        rates(state + step * k[2], contacts + step * kc[2], keys, deepest, armed, pair, surface, k[3], kc[3])
        state += step / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
        contacts += step / 6 * (kc[0] + 2 * kc[1] + 2 * kc[2] + kc[3])
        for body in range(2):
            q = state[BODY * body + Q : BODY * body + Q + 4]
            q /= np.sqrt(np.sum(q**2))
        touching = settle(state, contacts, keys, deepest, armed, A, B, c, margin)
        least = min(least, state[NORMAL_WORK])
        largest = max(largest, deepest.max())
        touched = touched or touching > 0
        if touched and touching == 0 and number >= FEWEST:
            return number + 1, True, least, largest
    return most, False, least, largest
