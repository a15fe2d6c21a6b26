"""How much of the stated gravity the outlines' centre falls with: a wrong frame rate, gravity or focal length shows before any fit.

The centre is taken to fly as ``X(t) = X0 + V t + s g t² / 2``; ``s`` is fitted to its path in the first camera's picture with X0 and V, the
depth of X0 being held where the outlines' area says. Motion in depth bends the path, too, so V across the depth has a prior as wide as the
motion across the picture. With times that are k times too long, ``s = 1 / k²``.

The centre of an outline is not that of mass. While the particle turns by half a turn during the recording the difference bends the path
like an acceleration of ``w (pi / T)²``, ``w`` the RMS difference of the hull in drawn orientations; so an acceleration has that as its
prior, and short recordings say little.
Of a recording with impacts the longest flight without any is taken.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from datasets.vocabulary.camera import HsvCamera
from estimator.readiness.inspection import Inspection, parabola

Array = NDArray[np.float64]
DEPTH_KNOWN = 0.15
"""Relative standard deviation of a depth from the outlines' mean area: the shadow of a stone twice as long as wide varies by a quarter."""
SLOWEST_MS = 0.2
"""Standard deviation of the motion in depth where hardly anything moves across the picture."""
SEEN_MS2 = 1.0
"""Gravity across the picture that can be seen at all."""
FEWEST = 10
"""Centres from which a parabola and its scatter can be told."""


@dataclass(frozen=True)
class Fall:
    """The centre falls with ``share`` of the stated gravity, ``sigma`` its standard deviation, depth included."""

    share: float
    sigma: float


def fall_of(inspection: Inspection, camera: HsvCamera, gravity_world: Array, *, depth_m: float, wobble_m: float) -> Fall | None:
    """The fall seen by ``camera`` at ``depth_m`` (m) of a particle whose outline's centre misses that of mass by ``wobble_m``.

    ``None`` where there are too few centres or gravity is along the line of sight.
    ``gravity_world`` (3,) m/s².
    """
    if inspection.times_s is None or len(inspection.free.frame) < FEWEST or not np.any(gravity_world):
        return None
    g = camera.R_cam_world @ gravity_world
    if float(np.hypot(g[0], g[1])) < SEEN_MS2:
        return None
    lens = camera.intrinsics
    t = inspection.times_s[inspection.free.frame]
    t = t - t.mean()
    xy = lens.normalise(inspection.free.c)
    (start, slope, _), rest = parabola(inspection)
    scale = depth_m / np.array([lens.fx_px, lens.fy_px])
    noise = max(float(np.sqrt(np.mean(rest**2))) / lens.fx_px, 1e-9)
    first = np.concatenate([depth_m * lens.normalise(start[None])[0], slope * scale, [0.0, 1.0, 0.0, 0.0]])
    widest = max(float(np.linalg.norm(first[2:4])), SLOWEST_MS)
    bent = max(wobble_m * (np.pi / float(np.ptp(t))) ** 2, 1e-9)

    def residuals(p: Array) -> Array:
        X = np.append(p[:2], depth_m) + np.outer(t, p[2:5]) + 0.5 * np.outer(t**2, p[5] * g + np.append(p[6:], 0.0))
        return np.concatenate([((X[:, :2] / X[:, 2:] - xy) / noise).ravel(), [p[4] / widest], p[6:] / bent])

    found = least_squares(residuals, first, x_scale="jac", method="trf", max_nfev=200)
    jacobian = np.asarray(found.jac, dtype=np.float64)
    information = jacobian.T @ jacobian
    scaled = np.sqrt(np.diag(information))
    inverse = np.linalg.pinv(information / np.outer(scaled, scaled)) / np.outer(scaled, scaled)
    share, own = float(found.x[5]), float(np.sqrt(max(inverse[5, 5], 0.0)))
    return Fall(share, float(np.hypot(own, DEPTH_KNOWN * max(abs(share), 1.0))))
