"""Where a sequence is to be split: impacts as kinks of the outline's centroid path.

The angle between successive steps of the centroid shows an impact, as in the paper this method is from. Noise of slow steps and the wobble
of a centroid about the centre of mass turn steps as well. So an angle only nominates, and a hinge decides: over a window of frames two
parabolas of common acceleration that meet at the time of impact, ``c(t) = c_i + v± (t - t_i) + a (t - t_i)² / 2``, must leave far
smaller residuals than a cubic, which has as many coefficients. The search is repeated within the parts until no kink is left.

The time is good to some tenths of a frame: a start for the fit, not a measurement. Kinks below ``LEAST_JUMP_PX`` per frame are not found,
nor two impacts within about three frames of one another.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from estimator.appearance.hull_outlines import hull_of
from estimator.outlines.result import OutlineTrack
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
WINDOWS = (20, 10, 6)
"""Frames to either side of a kink that are looked at: wide ones tell weak kinks from noise, narrow ones see no second impact."""
LEAST_ANGLE_RAD = np.radians(8.0)
"""Turn of the centroid's path that nominates a kink; the hinge decides, so it is small. By judgement."""
LEAST_JUMP_PX = 0.3
"""Change of the centroid's velocity, px per frame, that is an impact; wobble of spinning bodies stays below 0.15."""
LEAST_RATIO = 8.0
"""Of the squared residuals of the cubic and of the hinge; free flights give 0.1 to 3."""
LEAST_AROUND = 7
"""Frames within a window: with fewer, hinge and cubic both fit anything."""
STEP_FRAMES = 3
"""Frames over which a step of the path is taken: noise of slow steps turns less. By judgement."""
LEAST_APART, CLEAR_SHARE = 1.5, 0.02
"""Frames between two kinks; share of the strongest kink's strength below which another is no clear one. By judgement."""
AREA_JUMP = 0.25
"""Share by which an outline's area may differ from its neighbours' before its centroid is left out: a part is hidden or two are one.

By judgement."""
ORIENTATIONS = 30
"""Drawn for the mean over all; it is known to a tenth then."""


@dataclass(frozen=True)
class CentroidPath:
    """Centroids ``c`` (n, 2) px of the used outlines of one camera in ``frame`` (n,)."""

    frame: NDArray[np.int64]
    c: Array


@dataclass(frozen=True)
class Kink:
    """An impact at ``frame`` (continuous); ``angle_rad`` between the steps around it; ``jump_px`` per frame; ``ratio`` of residuals."""

    frame: float
    angle_rad: float
    jump_px: float
    ratio: float


def centroid_path(track: OutlineTrack, *, in_part: bool = False) -> CentroidPath:
    """Centroids of the used outlines; one whose area differs by a quarter from that of its neighbours is left out.

    ``in_part``: of those too that are used in part.
    """
    frames = np.flatnonzero(track.seen if in_part else track.used)
    outlines = [track.frames[f].outline.points_px for f in frames]
    kept = [i for i, points in enumerate(outlines) if len(points) >= 3]
    moments = np.array([polygon_moments(outlines[i]) for i in kept]).reshape(-1, 3)
    area = moments[:, 0]
    near = np.array([np.median(area[max(0, i - 3) : i + 4]) for i in range(len(area))])
    good = np.flatnonzero((area > 0) & (np.abs(area - near) <= AREA_JUMP * near))
    return CentroidPath(frames[np.array(kept, dtype=np.int64)][good].astype(np.int64), moments[good, 1:])


def polygon_moments(points: Array) -> tuple[float, float, float]:
    """Area and centroid of a polygon of ``points`` (n, 2)."""
    x, y = (points - points[0]).T
    cross = x * np.roll(y, -1) - np.roll(x, -1) * y
    area = 0.5 * float(cross.sum())
    if area == 0.0:
        return 0.0, 0.0, 0.0
    cx = float(np.sum((x + np.roll(x, -1)) * cross)) / (6.0 * area)
    cy = float(np.sum((y + np.roll(y, -1)) * cross)) / (6.0 * area)
    return abs(area), cx + float(points[0, 0]), cy + float(points[0, 1])


def wobble_of(particle: Particle, rng: np.random.Generator) -> float:
    """RMS distance (m), along an axis of the picture, of the centre of the particle's shadow from its centre of mass."""
    corners, missed = hull_of(particle), []
    for R in Rotation.random(ORIENTATIONS, rng=rng).as_matrix():
        shadow = (corners @ R.T)[:, :2]
        outline = shadow[ConvexHull(shadow).vertices]
        missed.append(polygon_moments(outline)[1:])
    return float(np.sqrt(np.mean(np.square(missed))))


def step_angles(path: CentroidPath) -> Array:
    """Angle (n,) rad between the steps before and after each centroid, each over up to ``STEP_FRAMES`` frames; 0 at the ends."""
    n = len(path.frame)
    angles = np.zeros(n)
    for i in range(1, n - 1):
        before, after = max(0, i - STEP_FRAMES), min(n - 1, i + STEP_FRAMES)
        a, b = path.c[i] - path.c[before], path.c[after] - path.c[i]
        angles[i] = abs(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b))
    return angles


def find_kinks(path: CentroidPath, *, least_ratio: float = LEAST_RATIO) -> list[Kink]:
    """All kinks of a path in the order of time; of two within ``LEAST_APART`` frames the stronger.

    ``least_ratio``: of the squared residuals of the cubic and of the hinge.
    """
    kept: list[Kink] = []
    for kink in sorted(_all_kinks(path, least_ratio), key=_strength, reverse=True):
        if all(abs(kink.frame - other.frame) >= LEAST_APART for other in kept):
            kept.append(kink)
    return sorted(kept, key=lambda k: k.frame)


def clear_kinks(kinks: list[Kink]) -> list[Kink]:
    """Those not far weaker than the strongest: wobble makes weak ones, and what is real among them shows in tracked poses."""
    least = CLEAR_SHARE * max((_strength(k) for k in kinks), default=0.0)
    return [k for k in kinks if _strength(k) >= least]


def _strength(kink: Kink) -> float:
    return kink.ratio * kink.jump_px**2


def _all_kinks(path: CentroidPath, least_ratio: float) -> list[Kink]:
    n = len(path.frame)
    if n < LEAST_AROUND:
        return []
    kink = _best_kink(path, least_ratio)
    if kink is None:
        return []
    before, after = path.frame < kink.frame, path.frame >= kink.frame
    parts = [CentroidPath(path.frame[rows], path.c[rows]) for rows in (before, after)]
    return [*_all_kinks(parts[0], least_ratio), kink, *_all_kinks(parts[1], least_ratio)]


def _best_kink(path: CentroidPath, least_ratio: float) -> Kink | None:
    angles = step_angles(path)
    near = np.array([angles[max(0, i - 1) : i + 2].max() for i in range(len(angles))])
    nominated = np.flatnonzero(near >= LEAST_ANGLE_RAD)
    found = [k for i in nominated for window in WINDOWS if (k := _kink_near(path, int(i), float(near[i]), window)) is not None]
    return max((k for k in found if k.ratio >= least_ratio), key=_strength, default=None)


def _kink_near(path: CentroidPath, i: int, angle: float, window: int) -> Kink | None:
    """The hinge with its time between the neighbours of centroid ``i``, where it explains the path far better than a cubic.

    With one centroid alone on one side of it every time fits as well: the one that claims the smallest jump is taken.
    """
    rows = np.flatnonzero(np.abs(path.frame - path.frame[i]) <= window)
    t, c = (path.frame[rows] - path.frame[i]).astype(np.float64), path.c[rows]
    if len(t) < LEAST_AROUND:
        return None
    smooth = _residual(np.vander(t / window, 4), c)[1]
    fits = [(_residual(_hinge(t, at), c), at) for at in _hinge_times(path.frame, i) if t[0] < at < t[-1]]
    if not fits:
        return None
    least = min(left for (_, left), _ in fits) * (1.0 + TIE) + TIE
    jump, left, at = min((_jump(coefficients), left, at) for (coefficients, left), at in fits if left <= least)
    ratio = smooth / max(left, len(t) * FINEST_PX**2)
    if jump < LEAST_JUMP_PX:
        return None
    return Kink(float(path.frame[i] + at), angle, jump, ratio)


def _hinge_times(frame: NDArray[np.int64], i: int) -> Array:
    """Times (frames) against frame ``i`` every eighth of a frame, a frame to either side, or up to its neighbours over a gap."""
    low = min(-1.0, float(frame[max(i - 1, 0)] - frame[i]))
    high = max(1.0, float(frame[min(i + 1, len(frame) - 1)] - frame[i]))
    return np.linspace(low, high, round(8.0 * (high - low)) + 1)


FINEST_PX = 0.02
"""Residual below which a better fit proves nothing."""


TIE = 1e-9
"""Difference of residuals, relative and in px², that is rounding."""


def _jump(coefficients: Array) -> float:
    """Change of velocity (px per frame) of a hinge with ``coefficients`` (4, 2)."""
    return float(np.linalg.norm(coefficients[2] - coefficients[1]))


def _hinge(t: Array, at: float) -> Array:
    s = t - at
    return np.column_stack([np.ones_like(s), np.minimum(s, 0.0), np.maximum(s, 0.0), 0.5 * s**2])


def _residual(A: Array, c: Array) -> tuple[Array, float]:
    coefficients, *_ = np.linalg.lstsq(A, c, rcond=None)
    return np.asarray(coefficients, dtype=np.float64), float(np.sum((A @ coefficients - c) ** 2))
