from dataclasses import replace

import numpy as np
import pytest

from datasets.estimate import Status
from datasets.scoring.leaderboard import FARTHEST, leaderboard
from datasets.scoring.score import score

COUNT = 9
SIGMA = np.array([0.002, 0.002, 0.008, 0.3, 0.3, 0.3])


@pytest.fixture
def rows(truth_of, estimate_of):
    """Rows of an instrument whose errors are those of another one, larger by a factor, with fresh noise of a share beside it."""

    def made(*, scale=1.0, fresh=0.0, lost=()):
        base, other = np.random.default_rng(11), np.random.default_rng(12)
        found = []
        for k in range(COUNT):
            truth = truth_of(f"seq_{k:04d}", seed=k)
            error = base.normal(size=6) * SIGMA * scale + fresh * other.normal(size=6) * SIGMA
            estimate = estimate_of(truth, error, sigma=0.01)
            found.append(score(replace(estimate, status=Status.NO_CONVERGENCE) if k in lost else estimate, truth))
        return found

    return made


def board(**instruments):
    return leaderboard({"cell": instruments}, np.random.default_rng(0))


def test_the_nearer_one_is_first_by_the_factor_of_its_errors(rows):
    told = board(worse=rows(scale=3.0), better=rows())
    assert {(first.first, first.second) for first in told.firsts} == {("better", "worse")}
    assert all(2.0 < first.ratio < 3.0 for first in told.firsts)  # less than three: what is near zero by luck decides nothing
    assert all(first.decided and not first.lost for first in told.firsts)
    assert [standing.instrument for standing in told.standings[:2]] == ["better", "worse"]


@pytest.mark.parametrize("few", [1, 5])
def test_few_sequences_decide_nothing(rows, few):
    told = leaderboard({"cell": {"worse": rows(scale=3.0)[:few], "better": rows()[:few]}}, np.random.default_rng(0))
    assert not any(first.decided for first in told.firsts)
    assert all((first.low, first.high) == (0.0, np.inf) for first in told.firsts)


def test_equal_instruments_are_not_decided(rows):
    told = board(one=rows(fresh=1.0), other=rows(fresh=1.0, scale=-1.0))
    assert not any(first.decided for first in told.firsts)
    assert any(first.lost for first in told.firsts)


def test_giving_up_gains_nothing(rows):
    told = board(careful=rows(lost=(0, 1, 2, 3, 4)), whole=rows(scale=5.0))
    assert {first.first for first in told.firsts} == {"whole"}
    careful = next(standing for standing in told.standings if standing.instrument == "careful")
    assert (careful.measured, careful.n, careful.median) == (4, COUNT, np.inf)
    assert all(1.0 < first.ratio < FARTHEST for first in told.firsts)


def test_nobody_is_first_where_nobody_measures(rows):
    told = board(one=rows(lost=range(COUNT)), other=rows(lost=range(COUNT)))
    assert told.firsts == ()
    assert all(np.isnan(standing.inside_95) for standing in told.standings)


def test_alone_nobody_is_first(rows):
    assert board(one=rows()).firsts == ()
