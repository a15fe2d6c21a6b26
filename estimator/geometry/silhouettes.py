"""Silhouettes as the tangency error needs them: convex hulls of rays, packed, each vertex with its expected noise."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.geometry.tangent_hull import WINDOW, Likeness, TangentHull, degraded_hull, tangent_hull

Array = NDArray[np.float64]
UNSURE_REACH_PX = 3.0
"""How near an unsure point of an outline a vertex is unsure as well: half the smoothing window and the blur of an edge (notebook 16)."""
UNSURE_PX, SURE_PX = 1e5, 1e3
"""Standard deviation of an unsure vertex, and the largest of one that is not."""


@dataclass(frozen=True)
class Silhouettes:
    """n packed hulls: hull ``i`` has the vertices from ``offsets`` (n + 1,) at i to that at i + 1.

    ``xy`` (v, 2) ideal normalised image coordinates; ``points_px`` (v, 2) as seen; ``sigma_px`` (v,) standard deviation of a vertex along
    its normal; ``correlation_rad`` (n,) the turn of the tangent over which its noise is correlated. ``noise_px`` (n,) is the outlines'
    point noise before smoothing and ``samples`` (n,) their number of samples; ``focal_px`` (n, 2).
    """

    xy: Array
    points_px: Array
    sigma_px: Array
    offsets: NDArray[np.int64]
    correlation_rad: Array
    noise_px: Array
    samples: NDArray[np.int64]
    focal_px: Array

    def __len__(self) -> int:
        return len(self.offsets) - 1

    @property
    def whole(self) -> NDArray[np.bool_]:
        """Hulls (n,) without an unsure vertex."""
        return np.array([not np.any(self.sigma_px[self.slice_of(i)] > SURE_PX) for i in range(len(self))], dtype=bool)

    def slice_of(self, index: int) -> slice:
        """Where hull ``index`` lies in the packed arrays."""
        return slice(int(self.offsets[index]), int(self.offsets[index + 1]))

    def take(self, indices: Sequence[int]) -> "Silhouettes":
        """The hulls ``indices`` alone."""
        if list(indices) == list(range(len(self))):
            return self
        parts = [self.slice_of(i) for i in indices]
        rows = np.concatenate([np.arange(p.start, p.stop) for p in parts]) if parts else np.zeros(0, dtype=np.int64)
        which = np.asarray(indices, dtype=np.int64)
        return Silhouettes(
            xy=self.xy[rows],
            points_px=self.points_px[rows],
            sigma_px=self.sigma_px[rows],
            offsets=np.concatenate([[0], np.cumsum([p.stop - p.start for p in parts])]).astype(np.int64),
            correlation_rad=self.correlation_rad[which],
            noise_px=self.noise_px[which],
            samples=self.samples[which],
            focal_px=self.focal_px[which],
        )


def silhouettes(
    outlines: Sequence[Outline],
    intrinsics: Sequence[Intrinsics],
    *,
    window: int = WINDOW,
    unsure: Sequence[NDArray[np.bool_]] | None = None,
) -> Silhouettes:
    """Smooth each outline, take its hull and turn its vertices into rays; an empty outline gives an empty hull.

    ``unsure``: for each outline which of its points may not be the body's edge, or none. A tangent at one of them says nothing. One at
    another point is right even where a part of the body is hidden beyond a line, since what lies on that line is among the unsure points.
    ``unsure`` (n,) for the n points of each outline.
    """
    hulls = [tangent_hull(o.points_px, window=window) for o in outlines]
    if unsure is not None:
        hulls = [_with_unsure(h, o, u) if u.any() else h for h, o, u in zip(hulls, outlines, unsure, strict=True)]
    return pack(hulls, intrinsics)


def _with_unsure(hull: TangentHull, outline: Outline, unsure: NDArray[np.bool_]) -> TangentHull:
    near = near_unsure(hull.points_px, outline.points_px, unsure)
    return replace(hull, sigma_px=np.where(near, UNSURE_PX, hull.sigma_px))


def near_unsure(points_px: Array, outline_px: Array, unsure: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Which of ``points_px`` (k, 2) lie near the ``unsure`` ones (v,), at least one, of an outline ``outline_px`` (v, 2)."""
    return np.asarray(cKDTree(outline_px[unsure]).query(points_px)[0] <= UNSURE_REACH_PX)


def like_silhouettes(
    outlines: Sequence[Outline],
    intrinsics: Sequence[Intrinsics],
    likeness: Sequence[Likeness],
    rng: np.random.Generator,
    shown: Callable[[Array, Array], Array] | None = None,
) -> Silhouettes:
    """Silhouettes as coarser cameras (``likeness``, one each) would have seen them on average.

    ``shown``: from an outline (v, 2) in px of such a camera and directions (d, 2) to the mean support points (d, 2) px that it sees.
    """
    hulls = [degraded_hull(o.points_px, like, rng, shown) for o, like in zip(outlines, likeness, strict=True)]
    return pack(hulls, intrinsics)


def pack(hulls: Sequence[TangentHull], intrinsics: Sequence[Intrinsics]) -> Silhouettes:
    """Pack hulls seen by the cameras ``intrinsics`` (one each)."""
    counts = [len(h.points_px) for h in hulls]
    xy = [c.normalise(h.points_px) if len(h.points_px) else np.zeros((0, 2)) for h, c in zip(hulls, intrinsics, strict=True)]
    return Silhouettes(
        xy=np.ascontiguousarray(np.concatenate(xy)),
        points_px=np.concatenate([h.points_px for h in hulls]),
        sigma_px=np.concatenate([h.sigma_px for h in hulls]),
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        correlation_rad=np.array([h.correlation_rad for h in hulls]),
        noise_px=np.array([h.noise_px for h in hulls]),
        samples=np.array([h.samples for h in hulls], dtype=np.int64),
        focal_px=np.array([[c.fx_px, c.fy_px] for c in intrinsics]).reshape(-1, 2),
    )
