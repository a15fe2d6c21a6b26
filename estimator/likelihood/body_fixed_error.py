"""The part of the errors that stays with a place on the body: its covariance, and how large it is.

Hollows and roughness make the tangent planes of noisy outlines wrong by an amount that depends on the place touched, told by its outward
normal, and on the side it is seen from, told by the viewing direction without its sign (outlines from ahead and from behind are the same
line). It is a stationary random field over both: ``cov = sigma² exp((cos a - 1) / A²) exp(-sin² b / 2 B²)``, a and b the angles between
normals and between viewing directions; both factors are positive definite on the sphere. A and B are read off products of residuals of
different sightings, of rough procedural bodies. The field is held in cells of both spheres, so that its covariance acts as one kernel on
each.

Its size differs from body to body (cut stones hardly have any). :func:`measured_variance` takes it from products of errors of different
sightings, which share nothing else [variance components by the method of moments: Searle, Casella and McCulloch, Variance Components,
1992, ch. 5].
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.spatial import KDTree

from estimator.geometry.sphere import fibonacci_sphere

Array = NDArray[np.float64]
Index = NDArray[np.int64]
NORMAL_RAD, VIEWING_RAD = float(np.radians(10.0)), float(np.radians(35.0))
"""Lengths over which the field is alike, in the normal and in the viewing direction. Measured on eight jagged bodies (notebook 9)."""


@dataclass(frozen=True)
class Grid:
    """How many cells the spheres of normals and of viewing directions are divided into."""

    normals: int
    viewing: int


FINE, COARSE = Grid(300, 48), Grid(120, 24)
"""12° by 29°, and 19° by 41° where matrices as large as the number of cells are needed."""


@dataclass(frozen=True)
class BodyPlaces:
    """Where on the body errors lie: cells (n, k, 2) of the outward normals, and (n,) of the directions they are seen along."""

    normal: Int[NDArray[np.int64], "n k 2"]
    viewing: Int[NDArray[np.int64], " n"]
    grid: Grid

    @property
    def cell(self) -> Index:
        """One number (n, k, 2) for both."""
        return np.asarray(self.normal * self.grid.viewing + self.viewing[:, None, None])


def body_places(
    normals: Float[NDArray[np.float64], "n k 2 3"], viewing: Float[NDArray[np.float64], "n 3"], grid: Grid = FINE
) -> BodyPlaces:
    """Places of tangencies with outward ``normals`` seen along ``viewing``, unit vectors in body axes."""
    place: Index = np.asarray(_nearest_normal(grid).query(normals)[1], dtype=np.int64)
    side = np.argmax(np.abs(viewing @ fibonacci_sphere(grid.viewing).T), axis=-1)
    return BodyPlaces(place, side.astype(np.int64), grid)


@cache
def _nearest_normal(grid: Grid) -> KDTree:
    return KDTree(fibonacci_sphere(grid.normals))


@cache
def _kernels(grid: Grid) -> tuple[Array, Array]:
    """Correlation between the cells of normals, and between those of viewing directions."""
    normals, viewing = fibonacci_sphere(grid.normals), fibonacci_sphere(grid.viewing)
    by_normal = np.exp((normals @ normals.T - 1.0) / NORMAL_RAD**2)
    return by_normal, np.exp(-0.5 * (1.0 - (viewing @ viewing.T) ** 2) / VIEWING_RAD**2)


def correlation(cells: Int[NDArray[np.int64], " q"], grid: Grid) -> Float[NDArray[np.float64], "q q"]:
    """Correlation of the field between cells."""
    by_normal, by_viewing = _kernels(grid)
    normal, viewing = np.divmod(cells, grid.viewing)
    return np.asarray(by_normal[np.ix_(normal, normal)] * by_viewing[np.ix_(viewing, viewing)])


def on_body(cells: Int[NDArray[np.int64], " r"], values: Float[NDArray[np.float64], "r p"], grid: Grid = FINE) -> Array:
    """Sums (normals, viewing, p) of ``values`` in their ``cells``."""
    rows = np.arange(len(cells))
    into = csr_array((np.ones(len(cells)), (cells, rows)), shape=(grid.normals * grid.viewing, len(cells)))
    return np.asarray(into @ values).reshape(grid.normals, grid.viewing, *values.shape[1:])


def field_product(total: Float[NDArray[np.float64], "b d p"], power: int = 1) -> Array:
    """``totalᵀ K total`` (p, p) of sums (normals, viewing, p), K the correlation to a power."""
    by_normal, by_viewing = (kernel**power for kernel in _kernels(Grid(*total.shape[:2])))
    spread = np.einsum("cd,bdp->bcp", by_viewing, np.tensordot(by_normal, total, axes=1), optimize=True)
    shape = (total.shape[0] * total.shape[1], total.shape[2])
    return np.asarray(total.reshape(shape).T @ spread.reshape(shape))


def field_covariance(
    cells: Int[NDArray[np.int64], " r"], influence: Float[NDArray[np.float64], "r p"], grid: Grid = FINE
) -> Float[NDArray[np.float64], "p p"]:
    """Covariance of ``sum influenceᵀ e`` where the errors ``e`` (r,) are the field, of variance one, in ``cells``."""
    return field_product(on_body(cells, influence, grid))


def body_noise(
    valid: Bool[NDArray[np.bool_], "n k"], weighted: Float[NDArray[np.float64], "n k 2 p"], places: BodyPlaces, *, sigma_px: float
) -> Float[NDArray[np.float64], "p p"]:
    """What a body-fixed error of ``sigma_px`` adds to the covariance of ``sum weightedᵀ e`` over valid pairs."""
    seen = np.repeat(valid[:, :, None], 2, axis=2)
    return sigma_px**2 * field_covariance(places.cell[seen], weighted[seen], places.grid)


def measured_variance(
    errors: tuple[Bool[NDArray[np.bool_], "n k"], Float[NDArray[np.float64], "n k 2"], Float[NDArray[np.float64], "n k 2"]],
    places: BodyPlaces,
    block: Int[NDArray[np.int64], " n"],
) -> float:
    """Variance (px²) of the field from products of errors of different blocks of sightings; it may come out negative.

    ``errors``: which pairs are valid, their errors (px) and weights (px⁻²). Weighted least squares of all products on the correlation.
    A fit has taken up part of the field, so it comes out too small. Zero where blocks share no place.
    """
    valid, e, weight = errors
    seen, cell = np.repeat(valid[:, :, None], 2, axis=2), places.cell
    whole, product, expected = np.zeros((places.grid.normals, places.grid.viewing, 2)), 0.0, 0.0
    for number in np.unique(block):
        here = seen & (block == number)[:, None, None]
        sums = on_body(cell[here], np.stack([weight[here] * e[here], weight[here]], axis=-1), places.grid)
        product -= float(field_product(sums[..., :1])[0, 0])
        expected -= float(field_product(sums[..., 1:], 2)[0, 0])
        whole += sums
    product += float(field_product(whole[..., :1])[0, 0])
    expected += float(field_product(whole[..., 1:], 2)[0, 0])
    return product / expected if expected > 0.0 else 0.0
