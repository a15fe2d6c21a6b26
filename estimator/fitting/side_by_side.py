"""Independent pieces of work side by side, in processes forked from this one.

A fork sees all that this process has, so nothing is sent to it; only what it found travels back. Of that, what it was given (campaigns,
fits, tests) travels as a reference and is the same object here; what is new is a copy. The work is the same and done in the same order
within each piece, so results do not depend on how many processes there are. Where a system cannot fork safely, or one process is
asked for, everything is done here, one piece after the other.
"""

import io
import multiprocessing
import pickle
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, fields, is_dataclass
from typing import Any, TypeVar

import cv2
import numpy as np

from datasets.local_processes import begin_worker, stop_workers

Piece = TypeVar("Piece")
Found = TypeVar("Found")
_most: ContextVar[int] = ContextVar("most", default=1)


@contextmanager
def processes(most: int) -> Iterator[None]:
    """Let work inside take up to ``most`` processes.

    OpenCV has one thread meanwhile: a fork has not the threads of its parent's pool, and would wait for them.
    """
    token, threads = _most.set(most), cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
        _most.reset(token)


def width() -> int:
    """How many pieces are worked on at once."""
    return _most.get() if _forks() else 1


def each_of(
    work: Callable[[Piece], Found], pieces: Sequence[Piece], *given: Any, told: Callable[[Piece], None] = lambda _: None
) -> list[Found]:
    """``work(piece)`` for each of the ``pieces``, in their order; ``told`` is called with each that is done.

    ``given``: what results hold of what was there before, and shall be the same objects; pieces are among it. Work must not change
    anything that outlives it. What it raises is raised here, of the first piece that raises.
    """
    jobs = min(width(), len(pieces))
    found: list[Found] = []
    answers = _in_forks(_Task(work, pieces, _parts_of((pieces, given), {})), jobs) if jobs > 1 else iter(())
    for piece in pieces:
        answer = next(answers, None)
        found.append(work(piece) if answer is None else answer.sent)
        told(piece)
    return found


@dataclass(frozen=True)
class _Answer:
    """What a fork found, if it could be sent."""

    sent: Any


def _in_forks(task: "_Task", jobs: int) -> Iterator[_Answer | None]:
    """What forks find, ``None`` where it cannot be sent; nothing more once one was killed, or memory was short: one process needs less."""
    _Fork.task = task
    try:
        with _pool(jobs) as pool:
            for answer in pool.map(_done, range(len(task.pieces))):
                yield None if answer is None else _Answer(_FromFork(io.BytesIO(answer), task.known).load())
    except (BrokenProcessPool, MemoryError, OSError):
        return
    finally:
        _Fork.task = None


@contextmanager
def _pool(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Forks, which are stopped where something is raised: what they still do is of no use then."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of threads that a fork has not: see :func:`_begun`
        with ProcessPoolExecutor(jobs, mp_context=multiprocessing.get_context("fork"), initializer=_begun) as pool:
            try:
                yield pool
            except BaseException:
                stop_workers()
                raise


def _forks() -> bool:
    """Whether a fork of this process can compute: on macOS, libraries of the system may not."""
    return "fork" in multiprocessing.get_all_start_methods() and sys.platform != "darwin"


@dataclass(frozen=True)
class _Task:
    """What forks are to do: ``known`` are the objects that travel as references, by identity."""

    work: Callable[[Any], Any]
    pieces: Sequence[Any]
    known: dict[int, Any]


class _Fork:
    """Where forks find their task: in the memory that they have from this process."""

    task: _Task | None = None


def _begun() -> None:
    """Fork no further; streams are new ones on the same files, since a thread of the parent may have held the locks of its own."""
    begin_worker()
    _most.set(1)
    sys.stdout, sys.stderr = (open(number, "w", buffering=1, closefd=False, encoding="utf-8") for number in (1, 2))


def _done(number: int) -> bytes | None:
    task = _Fork.task
    assert task is not None
    found, answer = task.work(task.pieces[number]), io.BytesIO()
    try:
        _ToParent(answer, task.known).dump(found)
    except (pickle.PicklingError, AttributeError, TypeError):  # as of a class that was made in the work
        return None
    return answer.getvalue()


def _parts_of(thing: Any, found: dict[int, Any]) -> dict[int, Any]:
    """All parts of a thing that is made of dataclasses, sequences and dictionaries, by identity."""
    if isinstance(thing, (tuple, list)):
        for each in thing:
            _parts_of(each, found)
    elif isinstance(thing, dict):
        _parts_of(list(thing.values()), found)
    elif id(thing) not in found and not isinstance(thing, (type, str, bytes, int, float, complex, bool, np.generic, type(None))):
        found[id(thing)] = thing
        if is_dataclass(thing):
            for field in fields(thing):
                _parts_of(getattr(thing, field.name), found)
    return found


class _ToParent(pickle.Pickler):
    """Writes what is ``known`` as a reference."""

    def __init__(self, file: io.BytesIO, known: dict[int, Any]) -> None:
        super().__init__(file, protocol=pickle.HIGHEST_PROTOCOL)
        self.known = known

    def persistent_id(self, obj: Any) -> int | None:
        """The identity of what is known."""
        return id(obj) if id(obj) in self.known else None


class _FromFork(pickle.Unpickler):
    """Reads references as what they are here."""

    def __init__(self, file: io.BytesIO, known: dict[int, Any]) -> None:
        super().__init__(file)
        self.known = known

    def persistent_load(self, pid: int) -> Any:
        """What is known by that identity."""
        return self.known[pid]
