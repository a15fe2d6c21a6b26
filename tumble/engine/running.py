"""Runs a task over items: what is done already is left, the rest is handed to an executor."""

from collections.abc import Callable, Sequence
from contextlib import closing
from typing import Protocol

from tumble.engine.items import Item, Job, Outcome, Outcomes, State, Task, job_of
from tumble.engine.marks import is_done
from tumble.engine.working import forget_late


class Executor(Protocol):
    """A way to do jobs. It holds a few of them at a time, so memory does not grow with their number."""

    def outcomes(self, jobs: Sequence[Job]) -> Outcomes:
        """One outcome for each job, in any order."""


def run(task: Task, items: Sequence[Item], *, executor: Executor, advance: Callable[[str], None]) -> tuple[Outcome, ...]:
    """Run ``task`` over ``items``; outcomes in the order of ``items``, whose names differ.

    A failing item becomes an outcome; ``KeyboardInterrupt`` passes through, after the workers are stopped.

    Raises
    ------
    InputError
        Where an item was done with other settings, or an executor cannot begin.
    """
    jobs = [job_of(task, item) for item in items]
    todo = [job for job in jobs if not is_done(job)]
    missing = {job.name for job in todo}
    outcomes = {job.name: Outcome(job.name, State.SKIPPED) for job in jobs if job.name not in missing}
    for name in outcomes:
        advance(name)
    for job in todo:
        forget_late(job)
    with closing(executor.outcomes(todo)) as done:
        for outcome in done:
            outcomes[outcome.name] = outcome
            advance(outcome.name)
    return tuple(outcomes[item.name] for item in items)
