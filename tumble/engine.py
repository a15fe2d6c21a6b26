"""Runs one task over many items, here or in local processes, so that no item can lose another.

A task is a picklable function from a plain dict to a plain dict. It writes its own product under a temporary name and renames it,
so a product that exists is whole; on resuming, items whose product exists are skipped. Each local process is a pool of
one worker: when a worker dies (killed, out of memory, a library that aborts) only the item it held is lost, and it is named.
"""

import multiprocessing
import os
import traceback
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from datasets.errors import TumbleError
from datasets.local_processes import begin_worker, stop_workers
from tumble.one_thread import keep_to_one_thread

Task = Callable[[dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True)
class Item:
    """One piece of work: a name for people, the task's argument, and the file that exists once it is done."""

    name: str
    payload: dict[str, Any]
    product: Path


class State(StrEnum):
    """What became of an item."""

    DONE = "done"
    SKIPPED = "skipped"
    FAILED = "failed"


@dataclass(frozen=True)
class Outcome:
    """What became of one item; ``message`` says why it failed.

    ``fault``: it failed of something that Tumble does not raise on purpose; ``traceback`` says where, that of a worker included.
    """

    name: str
    state: State
    message: str = ""
    result: dict[str, Any] = field(default_factory=dict)
    fault: bool = False
    traceback: str = ""


def run(task: Task, items: Sequence[Item], *, jobs: int, advance: Callable[[str], None]) -> tuple[Outcome, ...]:
    """Run ``task`` over ``items`` with ``jobs`` processes (1: in this one); outcomes in the order of ``items``.

    A failing item becomes an outcome; ``KeyboardInterrupt`` passes through, after the workers are stopped.
    """
    todo = [item for item in items if not item.product.exists()]
    outcomes = {item.name: Outcome(item.name, State.SKIPPED) for item in items if item not in todo}
    for name in outcomes:
        advance(name)
    source = _serially(task, todo) if jobs == 1 or len(todo) < 2 else _in_processes(task, todo, min(jobs, len(todo)))
    for outcome in source:
        outcomes[outcome.name] = outcome
        advance(outcome.name)
    return tuple(outcomes[item.name] for item in items)


def failures(outcomes: Iterable[Outcome]) -> tuple[Outcome, ...]:
    """Those that failed."""
    return tuple(outcome for outcome in outcomes if outcome.state is State.FAILED)


def _failed(item: Item, error: BaseException) -> Outcome:
    if isinstance(error, TumbleError):
        return Outcome(item.name, State.FAILED, str(error))
    died = isinstance(error, BrokenProcessPool)
    message = "its process died (killed, out of memory, or a library that aborted)" if died else f"{type(error).__name__}: {error}"
    where = "".join(traceback.format_exception(error))
    return Outcome(item.name, State.FAILED, message, fault=True, traceback=f"{item.name}:\n{where}")


def _serially(task: Task, items: Sequence[Item]) -> Iterable[Outcome]:
    for item in items:
        try:
            yield Outcome(item.name, State.DONE, result=task(item.payload))
        except Exception as error:  # whatever one item raises must not lose its neighbours
            yield _failed(item, error)


def _in_processes(task: Task, items: Sequence[Item], jobs: int) -> Iterable[Outcome]:
    keep_to_one_thread(os.environ)
    pools = [_pool() for _ in range(jobs)]
    waiting = list(reversed(items))
    running: dict[Future[dict[str, Any]], tuple[Item, int]] = {}
    try:
        for slot in range(jobs):
            _next(task, waiting, pools, slot, running)
        while running:
            finished, _ = wait(running, return_when=FIRST_COMPLETED)
            for future in finished:
                item, slot = running.pop(future)
                outcome = _outcome(item, future)
                if isinstance(future.exception(), BrokenProcessPool):
                    pools[slot] = _pool()
                _next(task, waiting, pools, slot, running)
                yield outcome
    except BaseException:
        stop_workers()
        raise
    finally:
        for pool in pools:
            pool.shutdown(wait=True, cancel_futures=True)


def _pool() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(max_workers=1, mp_context=multiprocessing.get_context("spawn"), initializer=begin_worker)


def _next(
    task: Task, waiting: list[Item], pools: list[ProcessPoolExecutor], slot: int, running: dict[Future[dict[str, Any]], tuple[Item, int]]
) -> None:
    if waiting:
        item = waiting.pop()
        running[pools[slot].submit(task, item.payload)] = (item, slot)


def _outcome(item: Item, future: Future[dict[str, Any]]) -> Outcome:
    error = future.exception()
    return _failed(item, error) if error else Outcome(item.name, State.DONE, result=future.result())
