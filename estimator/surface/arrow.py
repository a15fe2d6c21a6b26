"""One Gauss-Newton step of a surface and of motions: the surface is eliminated, so that what is known of the motions is marginal over it.

The normal matrix is an arrow: its sparse part, of the surface, is factorised and eliminated [Triggs et al., Bundle adjustment, 2000,
section 6]. Rows that bear on the whole surface, those of its mass properties, would fill it and enter by Woodbury's identity.

How noisy samples are is found from the data, by the fixed point at which the evidence is largest [MacKay, Neural Computation 4 (1992) 415];
the trace of the large inverse by random signs [Hutchinson, Communications in Statistics 18 (1989) 1059]. Samples whose residuals are alike
along an outline count as that many fewer, and so do pictures that are off alike, one after the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk
from scipy.sparse import csr_array, diags_array, vstack

from estimator.likelihood.alike_poses import OfPictures
from estimator.surface.dissection import Factor, factorised
from estimator.surface.evenness import Believed
from estimator.surface.samples import Samples

Array = NDArray[np.float64]
PROBES = 8
"""Vectors of random signs a trace is estimated with: within a few percent of itself, by judgement."""


@dataclass(frozen=True)
class Whole:
    """Rows that bear on the whole surface: ``residual`` (k,) in standard deviations, its derivatives ``by_motion`` (k, p).

    ``by_corner`` (3 n, k): those by the corners' coordinates, less their sign.
    """

    residual: Float[NDArray[np.float64], " k"]
    by_motion: Float[NDArray[np.float64], "k p"]
    by_corner: Float[NDArray[np.float64], "3n k"]


@dataclass(frozen=True)
class Weighed:
    """A group's samples in standard deviations: residuals ``r`` (m,), derivatives ``J`` (m, u) by the surface, ``F`` (m, c) by motions.

    ``place`` (c,): where those lie among all of the motions' parameters; ``noise`` that samples are taken to have. Of pictures that have a
    time, what samples say of poses, and derivatives ``slow`` (m, k) by slow errors of these.
    """

    samples: Samples
    r: Float[NDArray[np.float64], " m"]
    J: csr_array
    F: Float[NDArray[np.float64], "m c"] | csr_array
    place: NDArray[np.int64]
    weight: Float[NDArray[np.float64], " m"]
    noise: "Noise"
    pictures: OfPictures | None
    slow: Float[NDArray[np.float64], "m k"]


@dataclass(frozen=True)
class Noise:
    """Of a group's samples: effective ``px``, and ``outline_px``, were none alike from picture to picture, the unit of Huber's weights."""

    px: float
    outline_px: float

    @classmethod
    def white(cls, px: float) -> "Noise":
        """Of samples of which none is alike."""
        return cls(px, px)


@dataclass(frozen=True)
class Eliminated:
    """The normal equations of the motions alone, ``H`` (p, p) and ``g`` (p,), and what the surface does about them.

    ``half`` (u, p + 1): what the ``factor`` takes to cross terms with each motion and to the surface's own gradient, ``whole`` rows in it.
    """

    H: Float[NDArray[np.float64], "p p"]
    g: Float[NDArray[np.float64], " p"]
    half: Float[NDArray[np.float64], "u p1"]
    factor: Factor
    groups: tuple[Weighed, ...]
    prior: Believed

    @cached_property
    def solved(self) -> Float[NDArray[np.float64], "u p1"]:
        """How the surface's unknowns answer to each motion, and by themselves."""
        return self.factor.backward(self.half)

    def of_motions(self, whole: Whole) -> Array:
        """Their normal matrix (p, p), ``whole`` rows in it, were the surface known."""
        H = np.asarray(whole.by_motion.T @ whole.by_motion)
        for group in self.groups:
            H[np.ix_(group.place, group.place)] += filled(group.F.T @ group.F)
        return H

    def corners(self, step: Array) -> Array:
        """Moves (n, 3) m of the corners that go with a ``step`` (p,) of the motions."""
        return np.asarray((self.prior.basis @ self._unknowns(step)).reshape(-1, 3))

    def noise(self, step: Array, rng: np.random.Generator) -> tuple[Noise, ...]:
        """That of each group as the residuals after a ``step`` (p,) of the motions show it."""
        unknowns = self._unknowns(step)
        left = [group.r + group.J @ unknowns + group.F @ step[group.place] for group in self.groups]
        taken = _taken(self.factor, [group.J for group in self.groups], rng)
        return tuple(_noise_of(z, g, each) for z, g, each in zip(left, self.groups, taken, strict=True))

    def _unknowns(self, step: Array) -> Array:
        return -self.factor.backward(self.half @ np.append(step, 1.0)[:, None])[:, 0]


def weighed(samples: Samples, prior: Believed, noise: Noise, huber: float, place: NDArray[np.int64] | None = None) -> Weighed:
    """Samples over their noise, those far off held by Huber's weights; ``place`` (c,) of their motions, ``None``: there are no others."""
    w = np.sqrt(huber / np.maximum(np.abs(samples.gap_px) / noise.outline_px, huber)) / noise.px
    by, each = samples.by_motion, diags_array(w)
    place = np.arange(by.shape[1]) if place is None else place
    F = csr_array(each @ by) if isinstance(by, csr_array) else by * w[:, None]
    J = csr_array(each @ (samples.by_corner @ prior.basis))
    pictures = None if samples.by_pose is None else OfPictures(samples.by_pose * w[:, None], samples.starts)
    slow = np.zeros((len(w), 0)) if samples.by_slow is None else samples.by_slow * w[:, None]
    return Weighed(samples, samples.gap_px * w, J, F, place, w, noise, pictures, slow)


def eliminated(groups: Sequence[Weighed], prior: Believed, whole: Whole) -> Eliminated:
    """The normal equations without the surface."""
    rows, values = prior.rows, prior.values
    factor = factorised(csr_array(vstack([rows, *(group.J for group in groups)])), prior.corner, prior.sphere)
    by_surface = prior.basis.T @ whole.by_corner
    border, gradient = -by_surface @ whole.by_motion, rows.T @ values - by_surface @ whole.residual
    H, g = whole.by_motion.T @ whole.by_motion, whole.by_motion.T @ whole.residual
    for group in groups:
        border[:, group.place] += filled(group.J.T @ group.F)
        gradient += group.J.T @ group.r
        H[np.ix_(group.place, group.place)] += filled(group.F.T @ group.F)
        g[group.place] += group.F.T @ group.r
    taken, half = _halves(factor, by_surface, np.column_stack([border, gradient]))
    H, g = H - taken[:-1, :-1], g - taken[:-1, -1]
    return Eliminated(np.asarray(0.5 * (H + H.T)), np.asarray(g), half, factor, tuple(groups), prior)


def with_columns(fitted: Eliminated, whole: Whole, columns: Sequence[Array], at: int) -> tuple[Eliminated, Whole]:
    """The equations about the same surface with k more parameters of the motions, from place ``at`` on.

    ``columns`` (m, k): by how much they move the weighted samples of the last groups. They are none of the ``whole`` rows.
    """
    others, moved = fitted.groups[: -len(columns)], list(zip(fitted.groups[-len(columns) :], columns, strict=True))
    count, k = len(fitted.g), columns[0].shape[1]
    old, new = np.r_[:at, at + k : count + k], np.arange(at, at + k)
    border = np.sum([group.J.T @ each for group, each in moved], axis=0)
    taken, half = _halves(fitted.factor, fitted.prior.basis.T @ whole.by_corner, border)
    cross, gradient = -(fitted.half.T @ fitted.factor.forward(border)), np.insert(fitted.g, np.full(k, at), 0.0)
    for group, each in moved:
        cross[group.place] += group.F.T @ each
        gradient[new] += each.T @ group.r
    H = np.zeros((count + k,) * 2)
    H[np.ix_(old, old)], H[np.ix_(old, new)], H[np.ix_(new, old)] = fitted.H, cross[:-1], cross[:-1].T
    H[np.ix_(new, new)] = np.sum([each.T @ each for each in columns], axis=0) - taken
    gradient[new] += cross[-1]
    halves = np.zeros((len(half), count + k + 1))
    halves[:, np.append(old, count + k)], halves[:, new] = fitted.half, half
    groups = [replace(each, place=old[each.place]) for each in others]
    groups += [replace(group, F=np.column_stack([filled(group.F), each]), place=np.append(old[group.place], new)) for group, each in moved]
    whole = replace(whole, by_motion=np.insert(whole.by_motion, np.full(k, at), 0.0, axis=1))
    return replace(fitted, H=H, g=gradient, half=halves, groups=tuple(groups)), whole


def filled(products: Any) -> Array:
    """A matrix with its zeros, be it sparse or not."""
    return np.asarray(products.toarray() if hasattr(products, "toarray") else products)


def _halves(factor: Factor, by_surface: Array, right: Array) -> tuple[Array, Array]:
    """What eliminating the surface takes (r, r) from products of ``right`` (u, r), and what the factor takes to that.

    Rows that bear on the whole surface would fill the factorised matrix: they enter by Woodbury's identity.
    """
    halves, r = factor.forward(np.column_stack([right, by_surface])), right.shape[1]
    upper = dsyrk(1.0, halves.T)
    products = upper + np.triu(upper, 1).T
    answer = np.linalg.solve(np.eye(len(products) - r) + products[r:, r:], products[r:, :r])
    return products[:r, :r] - products[:r, r:] @ answer, halves[:, :r] - halves[:, r:] @ answer


def _taken(factor: Factor, groups: Sequence[csr_array], rng: np.random.Generator) -> list[float]:
    """How many of each group's weighted rows (m, u) the surface's unknowns take up: trace of ``rows A^-1 rows^T``."""
    towards = np.column_stack([rows.T @ rng.choice([-1.0, 1.0], size=(rows.shape[0], PROBES)) for rows in groups])
    return np.sum(factor.forward(towards) ** 2, axis=0).reshape(-1, PROBES).mean(axis=1).tolist()


def _noise_of(left: Array, group: Weighed, taken: float) -> Noise:
    """Noise of residuals (m,) ``left`` in units of that assumed, Huber's weights in them; what is alike counts as fewer samples.

    Slow errors of poses are no noise. ``taken``: how many samples the surface takes up.
    """
    repeats = 1.0
    if group.pictures is not None and len(left):
        F = filled(group.F)
        fitted, every = (group.pictures.base(columns) for columns in (F, np.column_stack([F, group.slow])))
        left = group.pictures.beside(left, fitted, every)
        repeats = group.pictures.repeats(left, every)
    size = np.sqrt(left @ left / max(len(left) - taken, 1.0))
    outline_px = group.noise.px * float(size * np.sqrt(_alike(left, group.samples.starts)))
    return Noise(outline_px * float(np.sqrt(repeats)), outline_px)


def _alike(left: Array, starts: NDArray[np.int64]) -> float:
    """One and twice the sum of the residuals' correlations along outlines up to the first that is none [Geyer, Stat. Sci. 7 (1992) 473]."""
    products = _lagged_products(left, starts)
    rho = products[1:] / products[0]
    none = np.flatnonzero(rho <= 0.0)
    return float(1.0 + 2.0 * rho[: none[0] if len(none) else len(rho)].sum())


def _lagged_products(left: Array, starts: NDArray[np.int64]) -> Array:
    """Means of products of residuals so many samples apart, round and round, over all outlines that are twice as long or longer."""
    counts = np.diff(starts)
    total, number = np.zeros((2, max(int(counts.max()) // 2, 1)))
    for first, count in zip(starts[:-1].tolist(), counts.tolist(), strict=True):
        lags = max(count // 2, 1) if count else 0
        total[:lags] += np.fft.irfft(np.abs(np.fft.rfft(left[first : first + count])) ** 2, count)[:lags] if count else 0.0
        number[:lags] += count
    return np.asarray(total / number)
