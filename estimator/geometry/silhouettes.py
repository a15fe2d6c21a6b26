"""Silhouettes as the tangency error needs them: convex hulls of rays, packed, each vertex with its expected noise."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline
from estimator.geometry.tangent_hull import WINDOW, TangentHull, tangent_hull

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Silhouettes:
    """n packed hulls: hull ``i`` has the vertices ``offsets[i]:offsets[i + 1]``.

    ``xy`` (v, 2) ideal normalised image coordinates; ``points_px`` (v, 2) as seen; ``sigma_px`` (v,) standard deviation of a vertex along its
    normal. ``response`` (v, window, 2), ``first_sample`` (v,) and ``n_samples`` (n,) say how the noise of outline samples moves the vertices
    (see :class:`TangentHull`). ``noise_px`` (n,) is the outline's point noise before smoothing; ``focal_px`` (n, 2).
    """

    xy: Array
    points_px: Array
    sigma_px: Array
    response: Array
    first_sample: NDArray[np.int64]
    offsets: NDArray[np.int64]
    n_samples: NDArray[np.int64]
    noise_px: Array
    focal_px: Array

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def slice_of(self, index: int) -> slice:
        """Where hull ``index`` lies in the packed arrays."""
        return slice(int(self.offsets[index]), int(self.offsets[index + 1]))

    def take(self, indices: Sequence[int]) -> "Silhouettes":
        """The hulls ``indices`` alone."""
        parts = [self.slice_of(i) for i in indices]
        rows = np.concatenate([np.arange(p.start, p.stop) for p in parts]) if parts else np.zeros(0, dtype=np.int64)
        which = np.asarray(indices, dtype=np.int64)
        return Silhouettes(
            xy=self.xy[rows],
            points_px=self.points_px[rows],
            sigma_px=self.sigma_px[rows],
            response=self.response[rows],
            first_sample=self.first_sample[rows],
            offsets=np.concatenate([[0], np.cumsum([p.stop - p.start for p in parts])]).astype(np.int64),
            n_samples=self.n_samples[which],
            noise_px=self.noise_px[which],
            focal_px=self.focal_px[which],
        )


def silhouettes(outlines: Sequence[Outline], intrinsics: Sequence[Intrinsics], *, window: int = WINDOW) -> Silhouettes:
    """Smooth each outline, take its hull and turn its vertices into rays; an empty outline gives an empty hull."""
    return pack([tangent_hull(o.points_px, window=window) for o in outlines], intrinsics)


def pack(hulls: Sequence[TangentHull], intrinsics: Sequence[Intrinsics]) -> Silhouettes:
    """Pack hulls seen by the cameras ``intrinsics`` (one each)."""
    counts = [len(h.points_px) for h in hulls]
    xy = [c.normalise(h.points_px) if len(h.points_px) else np.zeros((0, 2)) for h, c in zip(hulls, intrinsics, strict=True)]
    return Silhouettes(
        xy=np.ascontiguousarray(np.concatenate(xy)),
        points_px=np.concatenate([h.points_px for h in hulls]),
        sigma_px=np.concatenate([h.sigma_px for h in hulls]),
        response=_padded([h.response for h in hulls]),
        first_sample=np.concatenate([h.first_sample for h in hulls]),
        offsets=np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
        n_samples=np.array([h.n_samples for h in hulls], dtype=np.int64),
        noise_px=np.array([h.noise_px for h in hulls]),
        focal_px=np.array([[c.fx_px, c.fy_px] for c in intrinsics]).reshape(-1, 2),
    )


def _padded(responses: Sequence[Array]) -> Array:
    """The responses stacked, zeros after the shorter windows."""
    width = max(r.shape[1] for r in responses)
    return np.concatenate([np.pad(r, ((0, 0), (0, width - r.shape[1]), (0, 0))) for r in responses])
