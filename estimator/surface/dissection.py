"""Cholesky factors of matrices that join each corner of a surface with those at most two edges away, by nested dissection.

The corners of a subdivided icosahedron are halved again and again by separators that no matrix entry reaches across [George, SIAM J. Numer.
Anal. 10 (1973) 345]: which rows fill is known once for all surfaces, and what is left of the work are dense blocks, each the part of a
separator or of a leaf with the later corners that it touches [multifrontal method: Duff and Reid, ACM Trans. Math. Softw. 9 (1983) 302].
A general sparse factorisation of the same matrices takes three times as long.
"""

from dataclasses import dataclass
from functools import cache

import numba
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray
from scipy.linalg.blas import dsyrk, dtrsm
from scipy.linalg.lapack import dpotrf
from scipy.sparse import csr_array

from estimator.fitting.stable_inverse import NothingSeen
from estimator.surface.star_surface import Sphere

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LEAF = 60
"""Corners that are not halved any more: fastest in a trial run, between 30 and 120 within a tenth."""


@dataclass(frozen=True, eq=False)
class Block:
    """Corners ``own`` (k,), eliminated together, later ones that they ``touch`` (b,), and ``children``: blocks that touch these first."""

    own: Index
    touch: Index
    children: tuple[int, ...]


@cache
def blocks_of(ball: Sphere) -> tuple[Block, ...]:
    """The blocks in which the corners of a sphere are eliminated, children first."""
    near = csr_array(abs(ball.laplacian) @ abs(ball.laplacian))
    parts = _halved(np.arange(len(ball.directions)), ball.directions, near)
    rank, block_of = (np.empty(near.shape[0], dtype=np.int64) for _ in range(2))
    rank[np.concatenate(parts)] = np.arange(len(rank))
    for number, own in enumerate(parts):
        block_of[own] = number
    touched: list[Index] = []
    children: list[list[int]] = [[] for _ in parts]
    for number, own in enumerate(parts):
        reached = np.unique(np.concatenate([near[own].indices, *(touched[child] for child in children[number])]))
        later = reached[block_of[reached] > number]
        touched.append(later[np.argsort(rank[later])])
        if len(later):
            children[block_of[touched[number][0]]].append(number)
    return tuple(Block(*each[:2], tuple(each[2])) for each in zip(parts, touched, children, strict=True))


def _halved(corners: Index, directions: Array, near: csr_array) -> list[Index]:
    """Two halves of ``corners`` (k,), halved in turn, then the corners between them; all alone where they are few."""
    if len(corners) <= LEAF:
        return [corners]
    at = directions[corners]
    along = at @ np.linalg.eigh(np.cov(at.T))[1][:, 2]
    upper = along > np.median(along)
    beyond = np.zeros(len(directions))
    beyond[corners[upper]] = 1.0
    lower = corners[~upper]
    between = near[lower] @ beyond > 0.0
    return [*_halved(lower[~between], directions, near), *_halved(corners[upper], directions, near), lower[between]]


@dataclass(frozen=True, eq=False)
class Front:
    """A block's unknowns from ``first`` to ``end`` in order of elimination and the later ones it touches, ``rest`` (b,).

    ``L`` (k, k) and ``below`` (b, k): its columns of the factor.
    """

    first: int
    end: int
    rest: Index
    L: Array
    below: Array


@dataclass(frozen=True, eq=False)
class Factor:
    """The Cholesky factor of a matrix (u, u), its unknowns eliminated in an ``order`` (u,)."""

    order: Index
    fronts: tuple[Front, ...]

    def solve(self, right: Float[NDArray[np.float64], "u r"]) -> Float[NDArray[np.float64], "u r"]:
        """What the matrix takes to ``right``."""
        return self.backward(self.forward(right))

    def forward(self, right: Float[NDArray[np.float64], "u r"]) -> Float[NDArray[np.float64], "u r"]:
        """What the factor takes to ``right``, in the order of elimination."""
        x = np.ascontiguousarray(right[self.order])
        for front in self.fronts:
            own = x[front.first : front.end]
            dtrsm(1.0, front.L, own.T, side=1, lower=1, trans_a=1, overwrite_b=1)  # transposed it lies as BLAS has it: in place
            x[front.rest] -= front.below @ own
        return x

    def backward(self, half: Float[NDArray[np.float64], "u r"]) -> Float[NDArray[np.float64], "u r"]:
        """What the transposed factor takes to ``half``, which is in the order of elimination."""
        x, solved = half.copy(), np.empty_like(half)
        for front in reversed(self.fronts):
            own = x[front.first : front.end]
            own -= front.below.T @ x[front.rest]
            dtrsm(1.0, front.L, own.T, side=1, lower=1, overwrite_b=1)
        solved[self.order] = x
        return solved


def factorised(rows: csr_array, corner: Index, ball: Sphere) -> Factor:
    """The factor of the normal matrix (u, u) of weighted ``rows`` (r, u), whose unknowns move each one ``corner`` (u,) of a surface.

    The matrix itself is not made: each row's products are added to the block in which the first of its unknowns is eliminated.

    Raises
    ------
    NothingSeen
        Where the matrix is not positive definite.
    ValueError
        Where a row joins corners that are more than two edges apart, so that no block has both. (One that has both, where separators meet,
        takes the row as any other.)
    """
    blocks, counts = blocks_of(ball), np.bincount(corner, minlength=len(ball.directions))
    eliminated = np.concatenate([block.own for block in blocks])
    starts = np.zeros(len(counts) + 1, dtype=np.int64)
    starts[1:] = np.cumsum(counts[eliminated])
    begins = np.empty(len(counts), dtype=np.int64)
    begins[eliminated] = starts[:-1]
    order = np.argsort(begins[corner], kind="stable")
    ends = starts[np.cumsum([len(block.own) for block in blocks])]
    columns = np.argsort(order)[rows.indices]
    row_order, row_starts = _by_block(rows.indptr, columns, np.repeat(np.arange(len(blocks)), np.diff(ends, prepend=0)))
    local = np.full(len(order), -1)
    fronts: list[Front] = []
    left: list[Array] = []
    first = 0
    for number, (block, end) in enumerate(zip(blocks, ends.tolist(), strict=True)):
        rest = _unknowns(begins[block.touch], counts[block.touch])
        local[first:end], local[rest] = np.arange(end - first), end - first + np.arange(len(rest))
        k, b = end - first, len(rest)
        own, below, beyond = (np.zeros(shape, order="F") for shape in ((k, k), (b, k), (b, b)))
        mine = row_order[row_starts[number] : row_starts[number + 1]]
        if not _gathered(own, below, beyond, (rows.indptr, columns, rows.data, mine), local):
            raise ValueError("expected rows that join corners at most two edges apart, got one that joins others")
        for child in block.children:
            _added(own, below, beyond, left[child], local[fronts[child].rest])
            left[child] = np.zeros((0, 0))
        local[first:end] = local[rest] = -1
        front, more = _front(own, below, beyond, first, rest)
        fronts.append(front)
        left.append(more)
        first = end
    return Factor(order, tuple(fronts))


def _unknowns(begins: Index, counts: Index) -> Index:
    """All numbers from each of ``begins`` on, as many as ``counts`` say."""
    ends = np.cumsum(counts)
    return np.arange(int(counts.sum())) + np.repeat(begins - ends + counts, counts)


def _front(own: Array, below: Array, beyond: Array, first: int, rest: Index) -> tuple[Front, Array]:
    """A block's columns of the factor, in place of its ``own`` (k, k) and ``below`` (b, k), and what they leave ``beyond`` (b, b)."""
    L, wrong = dpotrf(own, lower=1, overwrite_a=1)
    if wrong:
        raise NothingSeen("a surface that is not determined")
    if len(rest):
        below = dtrsm(1.0, L, below, side=1, lower=1, trans_a=1, overwrite_b=1)
        beyond = dsyrk(-1.0, below, beta=1.0, c=beyond, lower=1, overwrite_c=1)
    return Front(first, first + len(L), rest, L, below), beyond


@numba.njit(cache=True)
def _by_block(pointers, columns, block):  # type: ignore[no-untyped-def]
    """Numbers of sparse rows in the order of the first ``block`` (u,) that has one of their columns, and where those of each begin."""
    first, starts = np.full(len(pointers) - 1, -1), np.zeros(block[-1] + 2, np.int64)
    for r in range(len(first)):
        if pointers[r] < pointers[r + 1]:
            first[r] = block[columns[pointers[r] : pointers[r + 1]].min()]
            starts[first[r] + 1] += 1
    starts = np.cumsum(starts)
    order, place = np.empty(starts[-1], np.int64), starts.copy()
    for r in range(len(first)):
        if first[r] >= 0:
            order[place[first[r]]] = r
            place[first[r]] += 1
    return order, starts


@numba.njit(cache=True)
def _gathered(own, below, beyond, rows, local):  # type: ignore[no-untyped-def]
    """Add the products of those sparse ``rows`` that are a block's, where ``local`` (u,) says; whether it says where for all of them."""
    pointers, columns, values, mine = rows
    k = len(own)
    for r in mine:
        for at in range(pointers[r], pointers[r + 1]):
            here = local[columns[at]]
            if here < 0:
                return False
            for to in range(pointers[r], at + 1):
                there = local[columns[to]]
                i, j, product = max(here, there), min(here, there), values[at] * values[to]
                if i < k:
                    own[i, j] += product
                elif j < k:
                    below[i - k, j] += product
                else:
                    beyond[i - k, j - k] += product
    return True


@numba.njit(cache=True)
def _added(own, below, beyond, left, place):  # type: ignore[no-untyped-def]
    """Add the lower half of what a child ``left`` (b, b) at its ``place`` (b,), which ascends."""
    k, mine = len(own), np.searchsorted(place, len(own))
    for j in range(mine):
        for i in range(j, mine):
            own[place[i], place[j]] += left[i, j]
        for i in range(mine, len(place)):
            below[place[i] - k, place[j]] += left[i, j]
    for j in range(mine, len(place)):
        for i in range(j, len(place)):
            beyond[place[i] - k, place[j] - k] += left[i, j]
