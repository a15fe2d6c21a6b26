"""What is to be done, item by item, and what became of it."""

import os
import traceback
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

from datasets.errors import TumbleError

Task = Callable[[dict[str, Any]], dict[str, Any]]


@dataclass(frozen=True)
class Item:
    """One piece of work: a name for people, the task's argument, and the file that exists once it is done.

    Paths in the payload may be relative; the task gets them as text, made absolute: a worker may run in another folder. ``apart`` names
    what is in the payload and makes no difference to the product; all else is a setting, which a run that goes on must share.
    """

    name: str
    payload: dict[str, Any]
    product: Path
    apart: tuple[str, ...] = ()


@dataclass(frozen=True)
class Job:
    """An item on its way to whoever does it: its payload is plain, its paths are absolute."""

    name: str
    task: Task
    payload: dict[str, Any]
    product: Path
    apart: tuple[str, ...]


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


Outcomes = Generator[Outcome, None, None]
"""Outcomes as they come; closing it ends the work."""


def job_of(task: Task, item: Item) -> Job:
    """The job of an item."""
    return Job(item.name, task, plain_paths(item.payload), item.product.absolute(), item.apart)


def plain_paths(value: Any) -> Any:
    """``value`` with every path in it as absolute text; parts without paths are not copied, since items may share them."""
    if isinstance(value, Path):
        return os.path.abspath(value)
    if isinstance(value, dict):
        found = {key: plain_paths(each) for key, each in value.items()}
        return found if any(found[key] is not value[key] for key in value) else value
    if isinstance(value, (list, tuple)):
        made = type(value)(plain_paths(each) for each in value)
        return made if any(one is not other for one, other in zip(made, value, strict=True)) else value
    return value


def failures(outcomes: Iterable[Outcome]) -> tuple[Outcome, ...]:
    """Those that failed."""
    return tuple(outcome for outcome in outcomes if outcome.state is State.FAILED)


def failed(job: Job, error: BaseException) -> Outcome:
    """The outcome of a job that raised ``error``."""
    if isinstance(error, TumbleError):
        return Outcome(job.name, State.FAILED, str(error))
    where = "".join(traceback.format_exception(error))
    return Outcome(job.name, State.FAILED, f"{type(error).__name__}: {error}", fault=True, traceback=f"{job.name}:\n{where}")


def died(job: Job) -> Outcome:
    """The outcome of a job whose process ended with it, more often than is put up with."""
    message = "its process died (killed, out of memory, or a library that aborted)"
    return Outcome(job.name, State.FAILED, message, fault=True, traceback=f"{job.name}:\n{message}")
