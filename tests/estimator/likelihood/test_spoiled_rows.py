"""Rows that a tracker got wrong are set aside, and nothing else is: in made residuals of unit noise, three axes a row."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.likelihood.spoiled_rows import Path, kept_rows

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]
ODDS = 20.0
SEQUENCES = 12


def set_aside(make: Callable[[np.random.Generator, int], Array], sequences: int = SEQUENCES, seed: int = 5) -> list[Flags]:
    """Which rows of each sequence are not kept."""
    rng = np.random.default_rng(seed)
    made = [make(rng, number) for number in range(sequences)]
    kept = kept_rows([Path.of(r, np.isfinite(r), np.arange(len(r)) / 100.0) for r in made], ODDS, 1e-16)
    return [~each for each in kept]


@pytest.mark.parametrize(("rows", "share", "off"), [(12, 0.03, 30.0), (12, 0.08, 300.0), (8, 0.08, 300.0), (60, 0.03, 30.0)])
def test_rows_that_are_far_off_are_set_aside(rows: int, share: float, off: float) -> None:
    """Of 8 to 60 rows, whose parabola a row that is off bends."""
    spoiled: list[Flags] = []

    def make(rng: np.random.Generator, _: int) -> Array:
        bad = rng.uniform(size=rows) < share
        spoiled.append(bad)
        directions = rng.normal(size=(rows, 3))
        return np.asarray(rng.normal(size=(rows, 3)) + off * bad[:, None] * directions / np.linalg.norm(directions, axis=1, keepdims=True))

    found, bad = np.concatenate(set_aside(make)), np.concatenate(spoiled)
    assert bad.sum() >= 4
    assert np.count_nonzero(found & bad) >= 0.85 * bad.sum()
    assert not (found & ~bad).any()


def tails(rng: np.random.Generator, _: int) -> Array:
    """Student's noise of three degrees of freedom."""
    return np.asarray(rng.standard_t(3, size=(30, 3)))


def wobble(rng: np.random.Generator, number: int) -> Array:
    """A misfit of 20 standard deviations in every fourth sequence, of a period of eight rows."""
    turning = np.sin(2.0 * np.pi * np.arange(40)[:, None] / 8.0 + rng.uniform(0.0, 6.0, 3))
    return np.asarray(rng.normal(size=(40, 3)) + 20.0 * (number % 4 == 0) * turning)


def push(rng: np.random.Generator, number: int) -> Array:
    """A sudden velocity in every third sequence."""
    after = np.maximum(np.arange(40) - rng.integers(4, 36), 0)
    return np.asarray(rng.normal(size=(40, 3)) + 10.0 * (number % 3 == 0) * after[:, None] * [1.0, 0.5, -0.2])


def of_its_own(rng: np.random.Generator, _: int) -> Array:
    """Sequences of other noise."""
    return np.asarray(rng.normal(size=(30, 3)) * 8.0 ** rng.uniform())


@pytest.mark.parametrize("make", [tails, wobble, push, of_its_own])
@pytest.mark.parametrize("sequences", [1, SEQUENCES])
def test_nothing_else_is(make: Callable[[np.random.Generator, int], Array], sequences: int) -> None:
    """Neither tails, nor what a model misses, nor a push, nor a sequence whose noise is larger."""
    assert not np.concatenate(set_aside(make, sequences)).any()


def test_a_second_half_that_lies_elsewhere_is_kept() -> None:
    """Something happened to the body or to the clock there: most rows of a run are no outliers."""

    def step(rng: np.random.Generator, _: int) -> Array:
        return np.asarray(rng.normal(size=(40, 3)) + 20.0 * (np.arange(40) >= 20)[:, None])

    assert not np.concatenate(set_aside(step)).any()


@pytest.mark.parametrize(("seed", "sequences", "freedom"), [(0, 20, 4.0), (3, 20, 4.0), (4, 20, 4.0), (9, 30, 2.5)])
def test_the_search_ends_where_noise_has_heavy_tails_and_is_alike(seed: int, sequences: int, freedom: float) -> None:
    """No row stands out of such noise, and many are nearly off."""
    rng, rows, paths = np.random.default_rng(seed), 60, []
    for _ in range(sequences):
        drawn = rng.standard_t(freedom, (rows + 1, 3))
        paths.append(Path.of(drawn[1:] + drawn[:-1], np.ones((rows, 3), dtype=np.bool_), np.arange(rows) * 0.01))
    kept = kept_rows(paths, 20.0, 0.0)
    assert np.mean(np.concatenate(kept)) > 0.9
