"""Values of every sequence that are integrated out leave what all columns at once leave."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.likelihood.reduced import Own, Quadratic, independent, posterior

Array = NDArray[np.float64]
SEQUENCES, OWN, FEW, ROWS = 6, 2, 3, 8
FEW_ROWS = np.arange(FEW)
OWN_ROWS = tuple(FEW + OWN * s + np.arange(OWN) for s in range(SEQUENCES))


def quadratic(seed: int, *, hanging: bool = False) -> Quadratic:
    """Few shared columns and two own ones for each sequence; ``hanging``: sequences share something, so their columns are no blocks."""
    rng = np.random.default_rng(seed)
    n = SEQUENCES * ROWS
    X = np.zeros((n, FEW + SEQUENCES * OWN))
    X[:, :FEW] = rng.normal(size=(n, FEW))
    for s, rows in enumerate(OWN_ROWS):
        X[ROWS * s : ROWS * (s + 1), rows] = rng.normal(size=(ROWS, OWN))
    y = X @ rng.normal(size=X.shape[1]) + rng.normal(size=n)
    if hanging:
        X[:, FEW:] -= 0.3 * X[:, FEW:].mean(axis=0)
    return Quadratic(X.T @ X, X.T @ y, float(y @ y))


def sizes(seed: int) -> tuple[Array, Array, Array]:
    """Standard deviations (k,) of the few columns, limits (m,) of the own ones, and their prior variances (s,) in those units."""
    rng = np.random.default_rng(seed)
    return rng.uniform(0.1, 3.0, FEW), rng.uniform(0.1, 3.0, SEQUENCES * OWN), rng.uniform(0.1, 3.0, SEQUENCES)


def eliminated(own: Own, variance: Array) -> tuple[Quadratic, Array]:
    """The quadratic of the few columns with the units integrated out under prior ``variance`` (s,) of the sequences.

    Beside it the units' covariance where the few are known: (m,) where they are independent, else (m, m).
    """
    prior, few = variance[own.owner], own.few
    if own.information.ndim == 1:
        ratio = 1.0 + prior * own.information
        covariance, half = prior / ratio, 0.5 * float(np.log(ratio).sum())
        mean, root = covariance * own.pull, np.sqrt(covariance)[:, None] * own.cross
        taken = root.T @ root
    else:
        alone = posterior(Quadratic(own.information, own.pull, 0.0), np.sqrt(prior))
        covariance, half, mean = alone.covariance, alone.half_log_det, alone.mean
        taken = own.cross.T @ covariance @ own.cross
    misfit = few.misfit - float(own.pull @ mean)
    return Quadratic(few.information - taken, few.pull - own.cross.T @ mean, misfit, few.half_log_det + half), covariance


def units(own: Own, covariance: Array, few: Array) -> Array:
    """Means (m,) of the units at values (k,) of the few columns; ``covariance`` (m,) or (m, m)."""
    left = own.pull - own.cross @ few
    return covariance * left if covariance.ndim == 1 else covariance @ left


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("hanging", [False, True])
@pytest.mark.parametrize("rows", [OWN_ROWS, (*OWN_ROWS[:-1], OWN_ROWS[-1][:1])])
def test_elimination_is_the_posterior_of_all_columns(seed: int, hanging: bool, rows: tuple[NDArray[np.int64], ...]) -> None:
    whole, (few, limits, variance) = quadratic(seed, hanging=hanging), sizes(seed)
    index = np.concatenate(rows)
    limits = limits[: len(index)]
    sigma = limits * np.sqrt(np.repeat(variance, [len(r) for r in rows]))
    every = posterior(whole.take(np.concatenate([FEW_ROWS, index])), np.concatenate([few, sigma]))
    taken = Own.of(whole, rows, limits).beside(FEW_ROWS)
    assert (taken.information.ndim == 2) is hanging
    left, covariance = eliminated(taken, variance)
    shared = posterior(left, few)
    assert shared.misfit == pytest.approx(every.misfit, rel=1e-9)
    assert shared.half_log_det == pytest.approx(every.half_log_det, rel=1e-9)
    np.testing.assert_allclose(shared.mean, every.mean[:FEW], rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(shared.covariance, every.covariance[:FEW, :FEW], rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(taken.axes @ units(taken, covariance, shared.mean), every.mean[FEW:], rtol=1e-7, atol=1e-10)
    alone = posterior(whole.take(index), sigma)
    spread = covariance if covariance.ndim == 1 else np.diag(covariance)
    np.testing.assert_allclose(taken.axes**2 @ spread, np.diag(alone.covariance), rtol=1e-8)


def test_values_without_a_prior_scale_are_not_there() -> None:
    whole, (few, limits, _) = quadratic(1), sizes(1)
    left = eliminated(Own.of(whole, OWN_ROWS, limits).beside(FEW_ROWS), np.zeros(SEQUENCES))[0]
    with_few, without = posterior(left, few), posterior(whole.take(FEW_ROWS), few)
    assert with_few.misfit == pytest.approx(without.misfit)
    assert with_few.half_log_det == pytest.approx(without.half_log_det)


def test_a_set_without_columns_leaves_everything() -> None:
    whole = quadratic(2)
    nothing = posterior(whole.take(np.zeros(0, dtype=np.int64)), np.zeros(0))
    assert (nothing.misfit, nothing.half_log_det) == (whole.misfit, 0.0)


def test_sequences_that_share_a_thing_do_not_pass_for_blocks() -> None:
    assert independent(quadratic(3).information, OWN_ROWS)
    assert not independent(quadratic(3, hanging=True).information, OWN_ROWS)
