"""Work in forks is the work that is done here."""

import multiprocessing
import os
import signal
import time
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from datasets.errors import InputError
from estimator.data.configuration import Configuration
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.registered import Registered
from estimator.fitting.side_by_side import each_of, processes, width
from estimator.measurements.silhouettes.registration import register
from tests.estimator.small_campaign import observations

HERE = os.getpid()


@dataclass(frozen=True)
class Holder:
    inner: Any
    other: Any


def test_answers_come_in_the_order_of_the_pieces_and_from_forks_that_fork_no_further() -> None:
    with processes(3):
        found = each_of(lambda i: (i * i, os.getpid(), width()), range(7))
        assert width() == 3
    assert [square for square, *_ in found] == [i * i for i in range(7)]
    assert HERE not in {pid for _, pid, _ in found}
    assert {inside for *_, inside in found} == {1}
    assert width() == 1


@pytest.mark.parametrize("most", [1, 2])
def test_what_was_given_comes_back_as_the_same_object_and_what_is_new_as_it_was_made(most: int) -> None:
    unpicklable = SimpleNamespace(call=lambda: 1)
    given = Holder(np.arange(3.0), (unpicklable, [Holder(1, 2)]))
    with processes(most):
        first, second = each_of(lambda i: (i, given.inner, given, Holder(given.other, np.full(2, i))), [0, 1], given)
    for i, found in enumerate((first, second)):
        assert found[0] == i
        assert found[1] is given.inner
        assert found[2] is given
        assert found[3].inner[0] is unpicklable
        assert found[3].inner[1][0] is given.other[1][0]
        np.testing.assert_array_equal(found[3].other, [i, i])


@pytest.mark.parametrize("most", [1, 2])
def test_what_work_raises_is_raised_here_and_each_piece_is_told(most: int) -> None:
    told = []

    def refuse(i: int) -> int:
        if i:
            raise InputError(f"piece {i}")
        return i

    with processes(most), pytest.raises(InputError, match="piece 1"):
        each_of(refuse, range(3), told=told.append)
    assert told == [0]
    with processes(most):
        assert each_of(abs, [-1, 2, -3], told=told.append) == [1, 2, 3]
    assert told == [0, -1, 2, -3]


def test_work_of_a_fork_that_was_killed_is_done_here() -> None:
    def killed(i: int) -> int:
        if os.getpid() != HERE:
            os._exit(9)
        return i

    told = []
    with processes(2):
        assert each_of(killed, range(4), told=told.append) == [0, 1, 2, 3]
    assert told == [0, 1, 2, 3]


def test_a_fork_that_a_signal_meant_for_the_parent_reaches_goes_on() -> None:
    def interrupted(i: int) -> int:
        if os.getpid() != HERE:
            os.kill(os.getpid(), signal.SIGINT)
        return i

    with processes(2):
        assert each_of(interrupted, range(3)) == [0, 1, 2]


def test_forks_are_stopped_where_one_raises() -> None:
    def work(i: int) -> int:
        if i:
            time.sleep(60)
        raise InputError("the first")

    began = time.monotonic()
    with processes(2), pytest.raises(InputError, match="the first"):
        each_of(work, range(4))
    assert time.monotonic() - began < 30
    assert not multiprocessing.active_children()


def test_what_cannot_be_sent_is_found_here_and_memory_that_one_process_has_is_enough() -> None:
    def made(i: int) -> object:
        class Local:
            number = i

        return Local()

    def short(i: int) -> int:
        if os.getpid() != HERE:
            raise MemoryError
        return i

    with processes(2):
        assert [found.number for found in each_of(made, range(3))] == [0, 1, 2]  # type: ignore[attr-defined]
        assert each_of(short, range(3)) == [0, 1, 2]


def test_a_campaign_is_found_and_explained_alike_by_one_process_and_by_several() -> None:
    def both(most: int) -> tuple[Registered, Explanation]:
        with processes(most):
            found = register(list(observations(drag=4.0)), Configuration())
            return found, explain(found.campaign, found.start, catalogue())

    (one, alone), (several, together) = both(1), both(2)
    for mine, theirs in zip(one.start.flights, several.start.flights, strict=True):
        np.testing.assert_array_equal(mine.x, theirs.x)
        np.testing.assert_array_equal(mine.v, theirs.v)
    assert alone.found
    assert alone.found == together.found
    assert [(s.added, s.group, s.odds, s.p) for s in alone.steps] == [(s.added, s.group, s.odds, s.p) for s in together.steps]
    assert alone.fit.cost == together.fit.cost
    assert alone.held_out.rms_px == together.held_out.rms_px
    for own, other in zip(alone.fit.state.theta, together.fit.state.theta, strict=True):
        np.testing.assert_array_equal(own, other)
