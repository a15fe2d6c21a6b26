"""Jobs done by workers of a Dask scheduler, on this machine or on others that see the same files.

A job whose worker died is tried again by the scheduler, once. One whose second worker died, too, may only have waited behind the one
that is to blame: it is tried once more, alone. A scheduler that is gone is waited for; jobs without an outcome are then handed in anew.
"""

import logging
import os
import queue
import sys
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from importlib import import_module
from itertools import count, islice
from pathlib import Path
from typing import Any, cast
from uuid import uuid4

from datasets.errors import InputError, TumbleError
from tumble.engine.build import build, refuse_other_build
from tumble.engine.items import Job, Outcome, Outcomes, Task, died, failed
from tumble.engine.working import ALLOWED_DEATHS, late, perform, was_late
from tumble.one_thread import keep_to_one_thread

AHEAD = 2
"""Jobs handed in for each thread of the workers: one that it does and one that waits at the scheduler."""
LOOK_EVERY_S = 2.0
"""How often the number of workers is asked for, and whether the scheduler is still there."""
CONNECT_S = 15.0
"""How long a scheduler may take to answer at first."""
PATIENCE_S = 300.0
"""How long a scheduler that was there may be gone."""
CLOSE_S = 5.0
"""How long saying goodbye to a scheduler may take."""


@dataclass(frozen=True)
class Scheduler:
    """A Dask scheduler: its address (``tcp://host:8786``) or its scheduler file. ``limit_s``: how long (s) a job may take."""

    address: str
    limit_s: float | None = None
    patience_s: float = PATIENCE_S

    def outcomes(self, jobs: Sequence[Job]) -> Outcomes:
        """Outcomes as jobs are done."""
        if not jobs:
            return
        keep_to_one_thread(os.environ)
        suspects = []
        for job, outcome in self._answers([replace(job, task=_importable(job.task)) for job in jobs], most=None):
            if outcome is None:
                suspects.append(job)
            else:
                yield outcome
        for job, outcome in self._answers(suspects, most=1):
            yield outcome or died(job)

    def _answers(self, jobs: Sequence[Job], most: int | None) -> Iterator[tuple[Job, Outcome | None]]:
        """Each job with its outcome, ``None`` where it died with its workers; no more than ``most`` at once."""
        left, wait_s = {job.name: job for job in jobs}, CONNECT_S
        while left:
            with _client(self.address, wait_s) as client:
                for job, outcome in _Session(client, self.limit_s, most).answers(list(left.values())):
                    del left[job.name]
                    yield job, outcome
            wait_s = self.patience_s
            if left:
                print(f"tumble: {self.address} is gone; waiting for it, {wait_s:g} s at most", file=sys.stderr, flush=True)


def _importable(task: Task) -> Task:
    """The task under the name that workers import it by; of a program that runs as a module, that is not ``__main__``."""
    main = getattr(sys.modules["__main__"], "__spec__", None)
    if task.__module__ != "__main__" or main is None:
        return task
    return cast(Task, getattr(import_module(main.name), task.__qualname__))


@contextmanager
def _client(address: str, wait_s: float) -> Iterator[Any]:
    """A client whose workers have all been compared with this process."""
    distributed = import_distributed()
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)  # tracebacks of a lost connection: said here, in a sentence
    place: dict[str, Any] = {"scheduler_file": address} if os.path.isfile(address) else {"address": address}
    with ExitStack() as stack:
        try:
            client = distributed.Client(**place, timeout=wait_s, set_as_default=False)
            stack.callback(client.close, timeout=CLOSE_S)
            client.run_on_scheduler(_put_up_with_little)
            _compare_workers(client, address)
        except (OSError, ValueError) as error:
            raise TumbleError(
                f"--scheduler {address}: expected a Dask scheduler to answer within {wait_s:g} s, but {error}. Finished items are whole."
            ) from error
        yield client


def import_distributed() -> Any:
    """Dask's ``distributed``, which is not needed without a scheduler.

    Raises
    ------
    InputError
        Where it is not installed.
    """
    try:
        import distributed  # noqa: PLC0415 - 0.4 s, which runs on one machine do not need
    except ImportError as error:
        raise InputError(
            'Dask is needed for --scheduler and tumble cluster, and is not installed: pip install "tumble[cluster]".'
        ) from error
    return distributed


def _put_up_with_little(dask_scheduler: Any) -> None:
    """Give up a job whose second worker died, and let jobs wait at the scheduler, not behind one another."""
    dask_scheduler.allowed_failures = ALLOWED_DEATHS
    dask_scheduler.WORKER_SATURATION = 1.0


def _compare_workers(client: Any, address: str) -> None:
    if not client.nthreads():
        print(f"tumble: waiting for workers of {address}", file=sys.stderr, flush=True)
        client.wait_for_workers(1)
    for worker, threads in client.nthreads().items():
        if threads != 1:
            raise InputError(f"worker {worker}: expected one thread, got {threads}. Start it with --nthreads 1.")
    for worker, found in client.run(build, on_error="return").items():
        refuse_other_build(worker, found, build())


def perform_as(wanted: dict[str, Any], folder: str, job: Job, limit_s: float | None) -> Outcome:
    """Do a job in ``folder``, where this process is of the ``wanted`` build: workers may have come after all were compared."""
    try:
        refuse_other_build("of this item", build(), wanted)
        os.chdir(folder)  # recipes may name files from where the user stands
    except (InputError, OSError) as error:
        return failed(job, error)
    return perform(job, limit_s)


@dataclass
class _Session:
    """One connection to a scheduler."""

    client: Any
    limit_s: float | None
    most: int | None

    def answers(self, jobs: Sequence[Job]) -> Iterator[tuple[Job, Outcome | None]]:
        """Jobs with their outcomes until all are done or the connection is lost; a job whose workers died has none."""
        waiting, numbers, name, folder = iter(jobs), count(), f"tumble-{uuid4().hex}", str(Path.cwd())
        running: dict[str, tuple[Job, Any]] = {}
        finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
        room, looked = self._room(), time.monotonic()
        while True:
            for job in islice(waiting, max(room - len(running), 0)):
                future = self.client.submit(perform_as, build(), folder, job, self.limit_s, key=(name, next(numbers)), pure=False)
                running[future.key] = (job, future)  # a future that nobody holds is cancelled
                future.add_done_callback(finished.put)
            if not running:
                return
            try:
                future = self._next(finished)
                answer = None if future is None else (running[future.key][0], self._outcome(running[future.key][0], future))
                if time.monotonic() - looked > LOOK_EVERY_S:
                    room, looked = self._room(), time.monotonic()
            except (OSError, CancelledError):  # the scheduler is gone, and all that it had with it
                return
            if answer is not None:
                del running[future.key]
                yield answer

    def _room(self) -> int:
        return self.most or max(AHEAD * sum(self.client.nthreads().values()), 1)

    def _next(self, finished: "queue.SimpleQueue[Any]") -> Any:
        """The next future that is finished; ``None`` after a while."""
        try:
            return finished.get(timeout=LOOK_EVERY_S)
        except queue.Empty:
            if self.client.status != "running":
                raise CancelledError from None
            return None

    def _outcome(self, job: Job, future: Any) -> Outcome | None:
        if self.limit_s is not None and was_late(job):
            return late(job, self.limit_s)
        error = future.exception()
        if error is None:
            return future.result()
        killed = isinstance(error, import_distributed().KilledWorker)
        return None if killed else failed(job, error)
