"""Jobs done in this process, or in local ones."""

import multiprocessing
import os
from collections import Counter, deque
from collections.abc import Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field

from datasets.local_processes import begin_worker, stop_workers
from tumble.engine.items import Job, Outcome, Outcomes, died, failed
from tumble.engine.working import ALLOWED_DEATHS, late, perform, was_late
from tumble.one_thread import keep_to_one_thread


@dataclass(frozen=True)
class Serial:
    """One job after the other, in this process."""

    def outcomes(self, jobs: Sequence[Job]) -> Outcomes:
        """Outcomes in the order of ``jobs``."""
        yield from map(perform, jobs)


@dataclass(frozen=True)
class Processes:
    """``count`` local processes, each a pool of one worker: where it dies, no other job can be to blame.

    ``limit_s``: how long (s) a job may take.
    """

    count: int
    limit_s: float | None = None

    def outcomes(self, jobs: Sequence[Job]) -> Outcomes:
        """Outcomes as jobs are done; workers are stopped where the caller stops asking."""
        if self.limit_s is None and min(self.count, len(jobs)) < 2:
            yield from Serial().outcomes(jobs)
            return
        keep_to_one_thread(os.environ)
        at_work = _AtWork(deque(jobs), [_pool() for _ in range(min(self.count, len(jobs)))], self.limit_s)
        try:
            yield from at_work.outcomes()
        except BaseException:
            stop_workers()
            raise
        finally:
            for pool in at_work.pools:
                pool.shutdown(wait=True, cancel_futures=True)


def _pool() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(max_workers=1, mp_context=multiprocessing.get_context("spawn"), initializer=begin_worker)


@dataclass
class _AtWork:
    """Jobs that wait, and pools with the job that each has; a pool gets its next job when it has done one."""

    waiting: deque[Job]
    pools: list[ProcessPoolExecutor]
    limit_s: float | None
    running: dict[Future[Outcome], tuple[Job, int]] = field(default_factory=dict)
    deaths: Counter[str] = field(default_factory=Counter)

    def outcomes(self) -> Outcomes:
        for slot in range(len(self.pools)):
            self._next(slot)
        while self.running:
            finished, _ = wait(self.running, return_when=FIRST_COMPLETED)
            for future in finished:
                job, slot = self.running.pop(future)
                outcome = self._outcome(job, slot, future)
                self._next(slot)
                if outcome is not None:
                    yield outcome

    def _next(self, slot: int) -> None:
        if self.waiting:
            job = self.waiting.popleft()
            self.running[self.pools[slot].submit(perform, job, self.limit_s)] = (job, slot)

    def _outcome(self, job: Job, slot: int, future: Future[Outcome]) -> Outcome | None:
        """The outcome; ``None`` where the worker died and the job is tried again."""
        error = future.exception()
        if not isinstance(error, BrokenProcessPool):
            return future.result() if error is None else failed(job, error)
        self.pools[slot].shutdown(wait=False)
        self.pools[slot] = _pool()
        if was_late(job):
            return late(job, self.limit_s)
        self.deaths[job.name] += 1
        if self.deaths[job.name] > ALLOWED_DEATHS:
            return died(job)
        self.waiting.append(job)
        return None
