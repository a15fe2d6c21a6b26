"""What the likelihood cannot tell apart is one group; what it can is not."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.diagnosis.selection.groups import FACTOR, MOST_NAMED, Name, group_of, sureness
from estimator.diagnosis.selection.search import Overrated, Trial, searched, try_pairs
from tests.estimator.diagnosis.selection.made_quadratics import BOTH, Made, evidence_of, own_columns

Array = NDArray[np.float64]
ROWS = 120
X = np.random.default_rng(31).normal(size=(ROWS, 8))
NOISE = np.random.default_rng(32).normal(size=ROWS)


def trial(*made: Made, y: Array, families: tuple[int, ...] = ()) -> Trial:
    return Trial(evidence_of(made, y), frozenset(families))


def alone(column: Array, limit: float = 1.0) -> Made:
    return Made(column[:, None], ((-limit, limit),))


def effects_of(group: tuple[Name, ...]) -> list[int]:
    """Of names that are one effect each."""
    return [effect for name in group for effect in name.effects]


def test_exactly_collinear_columns_are_aliases_of_equal_likelihood() -> None:
    """In other units, too: three times the column with a third of the range is the same effect under another name."""
    y = 0.6 * X[:, 0] + NOISE
    made = trial(alone(X[:, 0]), alone(3.0 * X[:, 0], 1.0 / 3.0), alone(X[:, 1]), y=y)
    group = group_of(made, (0,), 0)
    assert effects_of(group) == [0, 1]
    assert group[1].log_odds == pytest.approx(0.0, abs=1e-6)
    fits = [made.evidence.fitted((e,)).log_likelihood for e in (0, 1)]
    assert fits[0] == pytest.approx(fits[1], abs=1e-6)


def test_orthogonal_columns_are_no_aliases() -> None:
    Q = np.linalg.qr(X)[0] * np.sqrt(ROWS)
    made = trial(*(alone(Q[:, i]) for i in range(4)), y=0.6 * Q[:, 0] + 0.6 * Q[:, 1] + NOISE)
    assert searched(made).best == (0, 1)
    for member in (0, 1):
        assert effects_of(group_of(made, (0, 1), member)) == [member]


def test_an_alias_of_a_wider_range_is_named_though_it_is_less_probable() -> None:
    """Equal likelihood is enough; the odds say which name is the more probable one."""
    made = trial(alone(X[:, 0], 0.8), alone(1e-3 * X[:, 0], 8e6), y=0.6 * X[:, 0] + NOISE)
    first, other = group_of(made, (0,), 0)
    assert (first.effects, other.effects) == ((0,), (1,))
    assert other.log_odds < first.log_odds == 0.0


@pytest.mark.parametrize("limits", [(-1.0, 0.0), (-0.2, 0.2)])
def test_an_alias_that_would_need_what_is_not_believed_is_not_named(limits: tuple[float, float]) -> None:
    """Neither by its sign, nor by its size."""
    made = trial(alone(X[:, 0]), Made(X[:, :1], (limits,)), y=0.6 * X[:, 0] + NOISE)
    assert effects_of(group_of(made, (0,), 0)) == [0]


def test_within_a_factor_of_twenty_is_alike_and_beyond_is_not() -> None:
    """Columns turned out of one another until the data tell them apart by more than the factor."""
    names = []
    for turn in (0.05, 0.6):
        other = np.cos(turn) * X[:, 0] + np.sin(turn) * X[:, 1]
        made = trial(alone(X[:, 0]), alone(other), y=0.6 * X[:, 0] + NOISE)
        odds = made.log_posterior((1,)) - made.log_posterior((0,))
        names.append(effects_of(group_of(made, (0,), 0)))
        assert (odds > -np.log(FACTOR)) == (len(names[-1]) == 2)
    assert names == [[0, 1], [0]]


def test_what_every_sequence_has_for_itself_is_no_alias_for_fitting_better() -> None:
    """Forty free values fit any shared cause; only where they are as probable are they a name of it."""
    sequences, each = 40, 3
    own = Made(20.0 * own_columns(sequences, each), (BOTH,), tuple(range(sequences)))
    cause = np.kron(np.random.default_rng(3).uniform(0.5, 1.5, sequences), np.ones(each))
    y = 20.0 * 0.5 * cause + NOISE
    made = trial(alone(20.0 * cause), own, y=y)
    assert made.evidence.fitted((1,)).log_likelihood > made.evidence.fitted((0,)).log_likelihood - np.log(FACTOR)
    assert effects_of(group_of(made, (0,), 0)) == [0]


def test_a_place_that_is_searched_for_counts_where_it_is_worth_the_search() -> None:
    """One of twenty sequences shows it; the others' columns stand for no name, and the shared cause is none."""
    sequences, each = 20, 6
    own = Made(own_columns(sequences, each), (BOTH,), tuple(range(sequences)))
    y = np.zeros(ROWS)
    y[:each] = 8.0
    made = Trial(evidence_of([alone(X[:, 0]), own], y + NOISE, tried={1: 30}), frozenset())
    assert len(made.evidence.rows(1)) == 1 < len(made.evidence.of.rows(1))
    assert effects_of(group_of(made, (1,), 1)) == [1]


def test_members_are_no_names_and_few_are_named() -> None:
    made = trial(*(alone(X[:, 0]) for _ in range(8)), y=0.6 * X[:, 0] + NOISE)
    group = effects_of(group_of(made, (2,), 2))
    assert len(group) == MOST_NAMED
    assert group[0] == 2


def test_something_unknown_is_a_name_where_it_does_nearly_as_well() -> None:
    """A family that explains as much is named, however wide; one that explains something else is not."""
    made = trial(alone(X[:, 0]), alone(X[:, 0]), alone(X[:, 1]), y=0.6 * X[:, 0] + NOISE, families=(1, 2))
    assert effects_of(group_of(made, (0,), 0)) == [0, 1]


def test_two_effects_together_are_a_name_of_one() -> None:
    """One effect of four numbers beside two of one number each, of which either alone explains half."""
    four = Made(X[:, :4], (BOTH,) * 4)
    made = trial(four, alone(X[:, 0]), alone(X[:, 1]), alone(X[:, 5]), y=0.5 * X[:, 0] + 0.5 * X[:, 1] + NOISE)
    try_pairs(made, (0,))
    group = group_of(made, (0,), 0)
    assert [name.effects for name in group] == [(0,), (1, 2)]
    assert group[1].members == (1, 2)


def test_what_another_set_has_of_no_use_is_no_name() -> None:
    """A weak effect beside one that is not told from nothing: each may be exchanged for the other, but neither stands for the other."""
    Q = np.linalg.qr(X)[0] * np.sqrt(ROWS)
    noise = NOISE - Q @ (Q.T @ NOISE) / ROWS
    made = trial(alone(Q[:, 0]), alone(Q[:, 1]), y=0.27 * Q[:, 0] + 0.05 * Q[:, 1] + noise)
    assert made.log_posterior((1,)) > made.log_posterior((0,)) - np.log(FACTOR)
    assert effects_of(group_of(made, (0,), 0)) == [0]


def test_what_stands_for_another_member_is_no_name_and_makes_nothing_surer() -> None:
    """A weak effect beside a strong one with six aliases, orthogonal to it: they are the strong one's names alone."""
    Q = np.linalg.qr(X)[0] * np.sqrt(ROWS)
    noise = NOISE - Q @ (Q.T @ NOISE) / ROWS
    made = trial(alone(Q[:, 0]), *(alone(Q[:, 1]) for _ in range(7)), y=0.36 * Q[:, 0] + 0.6 * Q[:, 1] + noise)
    posterior = searched(made)
    assert effects_of(group_of(made, (0, 1), 0)) == [0]
    assert len(group_of(made, (0, 1), 1)) == MOST_NAMED
    assert sureness(made, (0, 1), 0) == pytest.approx(posterior.probability(0), abs=0.01)
    assert sureness(made, (0, 1), 1) > 0.999
    # A fit of its own without it, that does nearly as well, is what counts.
    assert sureness(made, (0, 1), 1, most=1.0) == pytest.approx(np.e / (1.0 + np.e))


def test_a_step_that_a_refit_refused_counts_less_beside_all_that_was_fitted() -> None:
    made = trial(alone(X[:, 0]), alone(X[:, 1]), alone(X[:, 2]), y=0.6 * X[:, :3].sum(axis=1) + NOISE)
    less = Trial(made.evidence, made.families, (Overrated(frozenset({1}), frozenset(), frozenset({0}), 5.0),))
    lost = {members: made.log_posterior(members) - less.log_posterior(members) for members in ((), (0,), (1,), (0, 1), (0, 1, 2), (0, 2))}
    assert lost == {(): 0.0, (0,): 0.0, (1,): 0.0, (0, 1): pytest.approx(5.0), (0, 1, 2): pytest.approx(5.0), (0, 2): 0.0}
    ended = Trial(made.evidence, made.families, (), fitted=(0,))
    assert ended.log_posterior((0, 1, 2)) == ended.log_posterior((0,)) < made.log_posterior((0, 1, 2))
