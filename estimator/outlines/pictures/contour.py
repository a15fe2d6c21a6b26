"""The particle's outline to a small fraction of a pixel.

First the half level of the occupancy is traced (marching squares). That contour is biased: linear interpolation between
pixels misplaces a sharp edge by up to 0.08 px with its phase, blur of variance s² draws a curved edge inwards by
``s²/(2R)``, and rounds a right-angled corner by ``0.77 s``. So the outline is then moved until its own image, made with
the blur measured on the very same edges, agrees with the picture: along each normal ``n``, Gauss-Newton for
``o_seen(n) = o_image(n - d)`` gives ``d = sum g (o_seen - o_image) / sum g²`` with ``g = -d o_image / dn``. Picture and
image are sampled alike, so interpolation cancels; a wrong blur width does not move a straight edge, because ``g`` is even
and the error odd, where no level is free. The image is that of a smooth curve through the points: chords of length ``h``
fill less, so that a polygon that fills as much as the picture has its corners ``h²/(12R)`` outside of a curve of radius ``R``. A Gaussian
edge obeys ``d o / d s² = o'' / 2``, which gives the correction of the blur. Corners sharper than the blur cannot be seen and stay rounded.

Where light leaks through a facet at the rim the particle is lighter just inside of its edge, and the half level lies further in. So every
place has a level of its own, ``o_seen(n) = (1 + a) o_image(n - d)``, of the variance about their median that ``a`` shows over the outline
beside noise [Morris, J. Am. Stat. Assoc. 78 (1983) 47, empirical Bayes]: hardly any of an opaque body.
Valid for particles wider than a few blurs.
"""

from dataclasses import dataclass

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from skimage.measure import find_contours

from datasets.vocabulary.outline import oriented
from estimator.geometry.closed_curves import resampled, through
from estimator.geometry.coverage import coverage
from estimator.outlines.pictures.blur import LEAST_VARIANCE, Covariance, blurred, bounded, fitted_blur, isotropic, narrowest

Points = Float[NDArray[np.float64], "n 2"]
Picture = Float[NDArray[np.float32], "height width"]

PIXEL_VARIANCE = 1.0 / 12.0
"""Of a pixel's own width (px²)."""
_STEP_PX = 0.5
"""Between places across an edge at which picture and model are compared."""
_LEAST_POWER = 1e-6
"""Of a profile, below which it does not tell where the edge is."""
_FEWEST = 8
"""Points of an outline."""
_HALVINGS = 2
"""Of the steps between an outline's points where it is imaged: what chords of a quarter of a pixel leave out is a sixteenth of what whole
ones do."""


@dataclass(frozen=True)
class Edge:
    """An outline (px) and the Gaussian blur of its edge (px, standard deviation; across the smear of the motion).

    ``misfit``: RMS difference between picture and image near it. ``noise_gain``: from the noise of a pixel (share of the
    contrast) to the standard deviation (px) of one of its points. ``reach_px``: how far out the blur, smear included, carries it.
    """

    points_px: Points
    blur_px: float
    misfit: float
    noise_gain: float
    reach_px: float


def half_level_contour(occupancy: Picture) -> Points | None:
    """The longest closed contour at occupancy 0.5, or ``None``."""
    closed = [c for c in find_contours(occupancy, 0.5) if len(c) > 8 and np.allclose(c[0], c[-1])]
    if not closed:
        return None
    return oriented(max(closed, key=len)[:-1, ::-1].astype(np.float64))


def outward_normals(points: Points) -> Points:
    """Unit outward normals of a positively oriented closed polygon, from chords over two neighbours each way."""
    chord = 2 * (np.roll(points, -1, axis=0) - np.roll(points, 1, axis=0)) + np.roll(points, -2, axis=0) - np.roll(points, 2, axis=0)
    length = np.maximum(np.hypot(chord[:, 0], chord[:, 1]), 1e-12)
    return np.column_stack([chord[:, 1], -chord[:, 0]]) / length[:, None]


def edge_blur(points: Points, occupancy: Picture) -> float:
    """Gaussian blur (px) from the slope of the occupancy across the sharper part of the outline."""
    profile = profiles(occupancy, points, outward_normals(points), np.array([-_STEP_PX, _STEP_PX]))
    slope = max(float(np.percentile(profile[:, 0] - profile[:, 1], 80)) / (2 * _STEP_PX), 1e-3)
    return float(np.sqrt(max(1.0 / (2 * np.pi * slope**2) - PIXEL_VARIANCE, LEAST_VARIANCE)))


def roughness(points: Points) -> float:
    """Standard deviation (px) of independent noise along the normals, robustly from fourth differences along the outline.

    For points about a pixel apart. Corners are few and do not count; detail as fine as the spacing does.
    """
    weights = np.array([1.0, -4.0, 6.0, -4.0, 1.0])
    fourth = sum(w * np.roll(points, k - 2, axis=0) for k, w in enumerate(weights))
    normal = (fourth * outward_normals(points)).sum(axis=1)
    return float(1.4826 * np.median(np.abs(normal)) / np.sqrt((weights**2).sum()))


def refined(points: Points, occupancy: Picture, *, blur_px: float, spacing_px: float, rounds: int) -> Edge:
    """Move the outline until its image agrees with ``occupancy``; the blur is fitted along, starting from ``blur_px``.

    In so many ``rounds``, and as many again as far as light leaks: edges that it draws inwards come back slowly, and rounds that are not
    needed follow the noise.
    """
    outline = resampled(points, spacing_px, fewest=_FEWEST)
    blur = isotropic(blur_px)
    for number in range(2 * rounds):
        step = _compared(outline, occupancy, blur)
        share = 1.0 if number < rounds else step.leaking
        if share == 0.0:
            break
        blur = bounded(blur + share * step.widening)
        shift = step.shift if number == 0 else share * _smoothed(step.shift)
        outline = outline + shift[:, None] * outward_normals(outline)
    final = _compared(outline, occupancy, blur)
    return Edge(oriented(outline), narrowest(blur), final.misfit, final.noise_gain, reach(blur))


def reach(blur: Covariance) -> float:
    """Distance (px) from an edge beyond which a blur leaves nothing of it; compared no farther than 12 px."""
    return min(2.5 * float(np.sqrt(np.linalg.eigvalsh(blur)[1] + PIXEL_VARIANCE)) + 0.5, 12.0)


@dataclass(frozen=True)
class _Step:
    shift: Float[NDArray[np.float64], " n"]
    widening: Covariance
    misfit: float
    noise_gain: float
    leaking: float


def _compared(outline: Points, occupancy: Picture, blur: Covariance) -> _Step:
    """One comparison of picture and image: shift of every point (px, outwards) and correction of the blur (px²)."""
    normals = outward_normals(outline)
    far = reach(blur)
    offsets = np.arange(-far, far + _STEP_PX / 2, _STEP_PX)
    image = profiles(blurred(coverage(through(outline, _HALVINGS), occupancy.shape), blur), outline, normals, offsets)
    seen = profiles(occupancy, outline, normals, offsets)
    slope = -np.gradient(image, _STEP_PX, axis=1)
    parts = np.stack([slope, image], axis=2)
    (shift, level), variance, leaking = _shift_and_level(parts, seen - image)
    shift = np.clip(shift, -1.0, 1.0)
    rest = seen - image - np.einsum("nki,in->nk", parts, np.stack([shift, level]))
    widening = -0.5 * np.gradient(slope, _STEP_PX, axis=1)
    wider = (rest * widening).sum(axis=1) / np.maximum((widening**2).sum(axis=1), 1e-9)
    gain = float(np.sqrt(np.median(variance) / _STEP_PX))
    return _Step(shift, fitted_blur(np.clip(wider, -0.5, 2.0), normals), float(np.sqrt(np.mean(rest**2))), gain, leaking)


def _shift_and_level(
    parts: Float[NDArray[np.float64], "n k 2"], rest: Float[NDArray[np.float64], "n k"]
) -> tuple[Float[NDArray[np.float64], "2 n"], Float[NDArray[np.float64], " n"], float]:
    """Shift of every point (px) and how far its level is off one, by the ``rest`` of its profile; variance (n,) of shifts in noise of one.

    ``parts``: by how much a profile changes with either. Last, the share of the scatter of levels that is no noise. What all levels have
    in common is none of a place: a blur that is not Gaussian does that.
    """
    H, g = np.einsum("nki,nkj->nij", parts, parts), np.einsum("nki,nk->ni", parts, rest)
    H += _LEAST_POWER * np.eye(2)
    covariance = np.linalg.inv(H)
    free = np.einsum("nij,nj->ni", covariance, g)
    left = rest - np.einsum("nki,ni->nk", parts, free)
    noise = float(np.median(np.sum(left**2, axis=1))) / ((left.shape[1] - 2) * _STEP_PX)
    square = float(np.mean((free[:, 1] - np.median(free[:, 1])) ** 2))
    scatter = max(square - noise * float(np.mean(covariance[:, 1, 1])), 0.0)
    H[:, 1, 1] += noise / max(scatter, _LEAST_POWER * noise) if noise > 0.0 else 0.0
    covariance = np.linalg.inv(H)
    return np.einsum("nij,nj->in", covariance, g), covariance[:, 0, 0], scatter / square if square > 0.0 else 0.0


def profiles(
    picture: Picture, points: Points, normals: Points, offsets: Float[NDArray[np.float64], " k"]
) -> Float[NDArray[np.float64], "n k"]:
    """``picture`` along the normals at ``offsets`` (px) from each point, by bilinear interpolation."""
    xy = (points[:, None, :] + offsets[None, :, None] * normals[:, None, :]).astype(np.float32)
    x, y = np.ascontiguousarray(xy[..., 0]), np.ascontiguousarray(xy[..., 1])
    sampled = cv2.remap(picture, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return np.asarray(sampled, dtype=np.float64)


def _smoothed(shift: Float[NDArray[np.float64], " n"]) -> Float[NDArray[np.float64], " n"]:
    """Shifts averaged with their neighbours: detail finer than the blur is noise."""
    return 0.25 * np.roll(shift, 1) + 0.5 * shift + 0.25 * np.roll(shift, -1)
