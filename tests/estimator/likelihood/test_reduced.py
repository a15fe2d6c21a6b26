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
    """The quadratic of the few columns with the units integrated out under prior ``variance`` (g,) of the groups.

    Beside it the units' covariance (m, m) where the few are known.
    """
    few, alone = own.few, posterior(Quadratic(own.information, own.pull, 0.0), np.sqrt(variance[own.group]))
    misfit = few.misfit - float(own.pull @ alone.mean)
    information = few.information - own.cross.T @ alone.covariance @ own.cross
    return Quadratic(information, few.pull - own.cross.T @ alone.mean, misfit, few.half_log_det + alone.half_log_det), alone.covariance


def units(own: Own, covariance: Array, few: Array) -> Array:
    """Means (m,) of the units at values (k,) of the few columns; ``covariance`` (m, m)."""
    return covariance @ (own.pull - own.cross @ few)


def taken_out(whole: Quadratic, limits: Array, rows: tuple[NDArray[np.int64], ...] = OWN_ROWS, *, effects: int = 1) -> Own:
    """The own columns ``rows``, of one effect or, one column each, of two; ``limits`` (m,)."""
    groups = rows if effects == 1 else tuple(np.array([row]) for each in rows for row in each)
    sequence = np.repeat(np.arange(len(rows)), [1 if effects == 1 else len(each) for each in rows])
    return Own.of(whole, groups, sequence, np.concatenate([np.zeros(FEW), limits])).beside(FEW_ROWS)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("hanging", [False, True])
@pytest.mark.parametrize("rows", [OWN_ROWS, (*OWN_ROWS[:-1], OWN_ROWS[-1][:1])])
@pytest.mark.parametrize("effects", [1, 2])
def test_elimination_is_the_posterior_of_all_columns(seed: int, hanging: bool, rows: tuple[NDArray[np.int64], ...], effects: int) -> None:
    whole, (few, limits, variance) = quadratic(seed, hanging=hanging), sizes(seed)
    index = np.concatenate(rows)
    limits = limits[: len(index)]
    taken = taken_out(whole, limits, rows, effects=effects)
    assert len(taken.blocks) == (2 if hanging else SEQUENCES + 1)
    prior = np.resize(variance, taken.group[-1] + 1)
    sigma = limits * np.sqrt(prior[taken.group])
    every = posterior(whole.take(np.concatenate([FEW_ROWS, index])), np.concatenate([few, sigma]))
    left, covariance = eliminated(taken, prior)
    shared = posterior(left, few)
    assert shared.misfit == pytest.approx(every.misfit, rel=1e-9)
    assert shared.half_log_det == pytest.approx(every.half_log_det, rel=1e-9)
    np.testing.assert_allclose(shared.mean, every.mean[:FEW], rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(shared.covariance, every.covariance[:FEW, :FEW], rtol=1e-8, atol=1e-12)
    np.testing.assert_array_equal(taken.rows, index)
    np.testing.assert_allclose(taken.limits * units(taken, covariance, shared.mean), every.mean[FEW:], rtol=1e-7, atol=1e-10)


def test_values_without_a_prior_scale_are_not_there() -> None:
    whole, (few, limits, _) = quadratic(1), sizes(1)
    left = eliminated(taken_out(whole, limits), np.zeros(SEQUENCES))[0]
    with_few, without = posterior(left, few), posterior(whole.take(FEW_ROWS), few)
    assert with_few.misfit == pytest.approx(without.misfit)
    assert with_few.half_log_det == pytest.approx(without.half_log_det)


def test_a_set_without_columns_leaves_everything() -> None:
    whole = quadratic(2)
    nothing = posterior(whole.take(np.zeros(0, dtype=np.int64)), np.zeros(0))
    assert (nothing.misfit, nothing.half_log_det) == (whole.misfit, 0.0)


def test_sequences_that_share_a_thing_do_not_pass_for_blocks() -> None:
    assert independent(quadratic(3).information, OWN_ROWS, np.arange(SEQUENCES))
    assert not independent(quadratic(3, hanging=True).information, OWN_ROWS, np.arange(SEQUENCES))
