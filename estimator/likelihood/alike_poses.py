"""Over how many pictures what moves a whole outline is alike.

Light that leaks at a facet, and hollows that a surface lacks, turn with the body and come back in the next picture.

What is left of a picture's samples says by how much its pose is off the motion's: with normal matrix ``A`` and gradient ``s`` of a pose of
its own, ``A^(-1/2) s`` are six numbers of variance one where the noise of samples is what it is taken for. What the parameters of the fit
take up of them is known, and so is what that leaves of noise that is alike from picture to picture: mean products with the pictures that
follow say how alike it is, as of rows of a trajectory (:mod:`estimator.likelihood.alike_noise`).
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from estimator.likelihood.alike_noise import LONGEST, likeness_of

Array = NDArray[np.float64]
LAGS = 10
"""Products are taken of a picture with itself and as many less one that follow. With three, as of the rows of trajectories, which are few,
errors of diamonds that fade slowly beside noise that does not seemed alike over 1.6 to 13 pictures, with ten over 4.8 to 19; with fifteen
as with ten (twelve flights of 100 pictures)."""
SEEN = 1e-9
"""Of the information on a pose, in units of its diagonal, that a direction has in which it is seen at all."""


@dataclass(frozen=True)
class OfPictures:
    """Samples of pictures in the order of time, in standard deviations.

    ``by_pose`` (m, 6): their derivatives by the pose of their own picture, any units and axes; ``starts`` (n + 1,): where those of each
    picture begin.
    """

    by_pose: Float[NDArray[np.float64], "m 6"]
    starts: Int[NDArray[np.int64], " n1"]

    @cached_property
    def _rows(self) -> list[tuple[slice, Array]]:
        """Where the samples of each picture that has some are, and their derivatives, of one size."""
        size = np.maximum(np.linalg.norm(self.by_pose, axis=0) / np.sqrt(max(len(self.by_pose), 1)), 1e-300)
        return [(slice(a, b), self.by_pose[a:b] / size) for a, b in pairwise(self.starts.tolist()) if b > a]

    @cached_property
    def _roots(self) -> tuple[Array, Array]:
        """``A^(-1/2)`` (n, 6, 6), and the projectors on what samples see, to which it is confined."""
        A = np.array([F.T @ F for _, F in self._rows])
        unit = np.sqrt(np.maximum(np.einsum("naa->na", A), 1e-300))
        value, vector = np.linalg.eigh(A / (unit[:, :, None] * unit[:, None, :]))
        seen = value > SEEN * value[:, -1:]
        inverse = np.where(seen, 1.0 / np.sqrt(np.where(seen, value, 1.0)), 0.0)
        return np.einsum("nak,nk,nbk->nab", vector, inverse, vector) / unit[:, None, :], np.einsum("nak,nk,nbk->nab", vector, seen, vector)

    def _off(self, moved: Array) -> Array:
        """By how much samples that are ``moved`` (m, ...) move the poses (n, 6, ...) of their pictures, in standard deviations."""
        return np.asarray(np.einsum("nab,nb...->na...", self._roots[0], np.array([F.T @ moved[part] for part, F in self._rows])))

    def base(self, columns: Float[NDArray[np.float64], "m k"]) -> Float[NDArray[np.float64], "n 6 q"]:
        """An orthonormal base of what parameters that move samples by ``columns`` move poses by, in standard deviations."""
        off = self._off(columns)
        flat = off.reshape(-1, off.shape[-1])
        size = np.linalg.norm(flat, axis=0)
        vector, value, _ = np.linalg.svd(flat[:, size > 0.0] / size[size > 0.0], full_matrices=False)
        return np.asarray(vector[:, value > SEEN * value.max(initial=0.0)].reshape(*off.shape[:2], -1))

    def repeats(self, left: Float[NDArray[np.float64], " m"], base: Float[NDArray[np.float64], "n 6 q"]) -> float:
        """Over how many pictures noise is alike, one at least, by what is ``left`` of samples; ``base`` of what was fitted."""
        if len(self._rows) < LAGS or not np.isfinite(left).all():
            return 1.0
        off = self._off(left)
        noise = likeness_of(_products(off - _within(base, off)), _expected(base, self._roots[1]))
        return 1.0 if noise is None else max(noise.repeats, 1.0)

    def beside(
        self,
        left: Float[NDArray[np.float64], " m"],
        fitted: Float[NDArray[np.float64], "n 6 q"],
        every: Float[NDArray[np.float64], "n 6 r"],
    ) -> Array:
        """What is ``left`` (m,) less what poses are off by within a base of ``every`` parameter, beside that of those ``fitted``."""
        off = self._off(left)
        taken = _within(every, off) - _within(fitted, off)
        beside = left.copy()
        for (part, F), pose in zip(self._rows, np.einsum("nab,na->nb", self._roots[0], taken), strict=True):
            beside[part] -= F @ pose
        return beside


def _within(base: Array, off: Array) -> Array:
    """The part of ``off`` (n, 6) that lies within an orthonormal ``base`` (n, 6, q)."""
    return np.asarray(base @ np.einsum("naq,na->q", base, off))


def _products(off: Array) -> Array:
    """Sums of products of poses (n, 6) with themselves and with those that follow."""
    return np.array([float(np.sum(off[lag:] * off[: len(off) - lag])) for lag in range(LAGS)])


def _expected(base: Array, seen: Array) -> Array:
    """The same of noise of variance one less its part in a ``base`` (n, 6, q), over its autocorrelation at each distance.

    ``seen`` (n, 6, 6): projectors on the directions that samples see.
    """
    n, flat = len(base), base.reshape(len(base), -1)
    distance, found = np.abs(np.subtract.outer(np.arange(n), np.arange(n))).ravel(), []
    for lag in range(LAGS):
        before, after = base[: n - lag], base[lag:]
        ahead, behind, pairs = np.zeros_like(base), np.zeros_like(base), np.zeros((n, n))
        ahead[: n - lag] = seen[: n - lag] @ after
        behind[lag:] = seen[lag:] @ before
        pairs[np.arange(n - lag), np.arange(lag, n)] = np.einsum("nab,nba->n", seen[: n - lag], seen[lag:])
        inner = np.einsum("nap,naq->pq", before, after)
        pairs += (base @ inner - ahead).reshape(n, -1) @ flat.T - flat @ behind.reshape(n, -1).T
        found.append(np.bincount(distance, weights=pairs.ravel(), minlength=LONGEST)[:LONGEST])
    return np.array(found)
