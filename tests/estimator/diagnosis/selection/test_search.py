"""The search over sets finds what was planted, alone, together, and nothing where nothing was."""

from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.diagnosis.selection.path import At, judged_by, overrated
from estimator.diagnosis.selection.search import EXPECTED, MOST, UNKNOWN, Trial, searched
from tests.estimator.diagnosis.selection.made_quadratics import Made, evidence_of

Array = NDArray[np.float64]
ROWS, COLUMNS, ALIKE = 600, 12, 0.9
A, B, C = 3, 7, 10
"""Two that show only together, and one that shows alone."""


def design(seed: int) -> Array:
    """Twelve columns; ``B`` is much like ``A``."""
    rng = np.random.default_rng([seed, 5])
    X = rng.normal(size=(ROWS, COLUMNS))
    X[:, B] = ALIKE * X[:, A] + np.sqrt(1.0 - ALIKE**2) * X[:, B]
    return X


def trial(X: Array, theta: dict[int, float], seed: int, *, families: tuple[int, ...] = (), sigma: float = 1.0) -> Trial:
    rng = np.random.default_rng([seed, 6])
    y = sum(X[:, i] * value for i, value in theta.items()) + sigma * rng.normal(size=len(X))
    evidence = evidence_of([Made(X[:, [i]]) for i in range(X.shape[1])], np.asarray(y), noise_known=sigma == 1.0)
    return Trial(evidence, frozenset(families))


@pytest.mark.parametrize("seed", range(8))
def test_planted_effects_are_found_two_of_which_show_only_together(seed: int) -> None:
    """Alone each of the two explains what chance does."""
    made = trial(design(seed), {A: 0.9, B: -0.9, C: 0.5}, seed)
    alone = [made.evidence.log_evidence((e,)) - made.evidence.log_evidence(()) for e in (A, B)]
    assert max(alone) < 6.0
    found = searched(made)
    assert made.log_posterior((A, B, C)) > made.log_posterior((C,)) + 3.0
    assert found.best == (A, B, C)
    assert all(found.probability(e) > 0.9 for e in (A, B, C))


@pytest.mark.parametrize("seed", range(4))
def test_where_noise_is_larger_than_stated_it_is_no_effect(seed: int) -> None:
    """Half as much noise again than its model says, read off the misfit."""
    nothing, something = (trial(design(seed), theta, seed, sigma=1.5) for theta in ({}, {C: 0.8}))
    assert searched(nothing).best == ()
    assert searched(something).best == (C,)


def test_nothing_is_found_in_noise() -> None:
    """Of twenty campaigns of noise at most one names something."""
    named = [found.best for found in (searched(trial(design(seed), {}, seed)) for seed in range(20)) if found.best]
    assert len(named) <= 1, named


def test_probabilities_are_normalised_and_those_of_all_sets() -> None:
    """Of five columns all sets of up to two are looked at, or could be: what is left out is improbable."""
    X = design(1)[:, :5]
    made = trial(X, {0: 0.4, 3: 0.15}, 1)
    found = searched(made)
    assert sum(np.exp(found.log_probability)) == pytest.approx(1.0)
    assert list(found.log_probability) == sorted(found.log_probability, reverse=True)
    every = [s for n in range(6) for s in combinations(range(5), n)]
    log_p = np.array([made.log_posterior(s) for s in every])
    whole = np.exp(log_p - np.logaddexp.reduce(log_p))
    for e in range(5):
        assert found.probability(e) == pytest.approx(sum(p for s, p in zip(every, whole, strict=True) if e in s), abs=0.02)


def test_a_start_that_is_wrong_is_left() -> None:
    made = trial(design(2), {C: 0.5}, 2)
    assert searched(made, (0, A)).best == searched(made).best == (C,)


def test_a_set_costs_by_its_members_and_a_family_more() -> None:
    made = trial(design(3), {}, 3, families=(10, 11))
    own, wide = (made.log_posterior((e,)) - made.evidence.log_evidence((e,)) - made.log_posterior(()) for e in (0, 11))
    assert own + made.evidence.log_evidence(()) == pytest.approx(np.log(EXPECTED / 10))
    assert wide + made.evidence.log_evidence(()) == pytest.approx(np.log(UNKNOWN / 2))


def test_one_family_at_a_time_and_few_effects_compete() -> None:
    made = trial(design(3), {}, 3, families=(10, 11))
    assert made.allowed((0, 10))
    assert not made.allowed((10, 11))
    assert not made.allowed(tuple(range(MOST + 1)))
    assert made.log_posterior((10, 11)) == -np.inf


def test_a_family_stands_where_no_effect_explains_as_much() -> None:
    X = design(4)
    wide = np.concatenate([X, X[:, [C]] + 0.3 * np.random.default_rng(9).normal(size=(ROWS, 1))], axis=1)
    known, unknown = (trial(wide, {e: 0.6}, 4, families=(COLUMNS,)) for e in (C, COLUMNS))
    assert searched(known).best == (C,)
    assert COLUMNS in searched(unknown).best


@pytest.mark.parametrize("seed", range(4))
def test_no_probability_is_above_one(seed: int) -> None:
    """A document that says so is refused by its schema."""
    found = searched(trial(design(seed), {0: 0.9, C: 0.9}, seed))
    assert max(found.probability(e) for e in range(COLUMNS)) <= 1.0


def test_a_set_that_refits_refused_is_as_probable_as_they_say() -> None:
    """About the fit of nothing the first effect gains hundreds of nats; refitted it lost five, and the second was never refitted."""
    rng = np.random.default_rng(12)
    X = rng.normal(size=(60, 2))
    trial = Trial(evidence_of([Made(X[:, :1]), Made(X[:, 1:])], 5.0 * X.sum(axis=1) + rng.normal(size=60)), frozenset())
    at = At(cast("Any", None), cast("Any", None), trial, (), searched(trial))
    assert at.posterior.best == (0, 1)
    refused = tuple(overrated(at, members, gained) for members, gained in (((0,), -5.0), ((0, 1), -np.inf)))
    told = judged_by(at, replace(at.trial, overrated=refused, fitted=())).posterior
    assert told.best == ()
    assert told.probability(0) == pytest.approx(np.exp(-5.0) / (2.0 + np.exp(-5.0)))
    assert told.probability(1) == pytest.approx(1.0 / (2.0 + np.exp(-5.0)))


class Equals:
    """Evidence in whole nats, drawn by set: many sets are as probable as others."""

    def __init__(self, effects: int, levels: int, seed: int) -> None:
        self.of, self.known = SimpleNamespace(effects=range(effects)), dict[tuple[int, ...], float]()
        self._rng, self._levels = np.random.default_rng(seed), levels

    def log_evidence(self, members: tuple[int, ...]) -> float:
        if members not in self.known:
            self.known[members] = float(3 * len(members) + self._rng.integers(self._levels))
        return self.known[members]


@pytest.mark.timeout(60)
@pytest.mark.parametrize(("levels", "seed"), [(2, 2), (4, 3), (1, 0)])
def test_sets_that_are_as_probable_do_not_take_turns_for_ever(levels: int, seed: int) -> None:
    made = Trial(cast(Any, Equals(9, levels, seed)), frozenset())
    assert made.log_posterior(searched(made).best) == max(map(made.log_posterior, made.evidence.known))
