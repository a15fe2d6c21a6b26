"""What a worker does with a job, whatever engine it works for."""

import faulthandler
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from datasets.errors import TumbleError
from tumble.engine.items import Job, Outcome, State, failed
from tumble.engine.marks import mark_done

ALLOWED_DEATHS = 1
"""How often the process of a job may die before the job is given up: a job that was killed once by chance is not lost, and one that kills
what runs it kills no more than two."""


def perform(job: Job, limit_s: float | None = None) -> Outcome:
    """Do a job and mark it as done; whatever it raises is its outcome.

    The process ends where the job takes longer than ``limit_s`` (s), and leaves a note of where it was.
    """
    try:
        with _limited(job, limit_s):
            outcome = Outcome(job.name, State.DONE, result=job.task(job.payload))
            mark_done(job)
        return outcome
    except Exception as error:  # whatever one job raises must not lose its neighbours
        return failed(job, error)


@contextmanager
def _limited(job: Job, limit_s: float | None) -> Iterator[None]:
    """End the process after ``limit_s``, from a thread outside of Python: a library that hangs is ended, too."""
    if limit_s is None:
        yield
        return
    if was_late(job):
        raise TumbleError(_late_words(limit_s))
    note = _note_path(job)
    note.parent.mkdir(parents=True, exist_ok=True)
    with note.open("w", encoding="utf-8") as file:
        faulthandler.dump_traceback_later(limit_s, exit=True, file=file)
        try:
            yield
        finally:
            faulthandler.cancel_dump_traceback_later()
            note.unlink(missing_ok=True)


def _note_path(job: Job) -> Path:
    return job.product.with_name(f".{job.product.name}.late")


def _late_words(limit_s: float | None) -> str:
    return f"expected to be done within --time-limit ({limit_s:g} s), but was not"


def was_late(job: Job) -> bool:
    """Whether an attempt of this run ended since it took too long."""
    note = _note_path(job)
    return note.is_file() and note.stat().st_size > 0


def late(job: Job, limit_s: float | None) -> Outcome:
    """The outcome of a job that took too long; its traceback is the note's."""
    where = _note_path(job).read_text(encoding="utf-8", errors="replace")
    forget_late(job)
    return Outcome(job.name, State.FAILED, _late_words(limit_s), traceback=f"{job.name}:\n{where}")


def forget_late(job: Job) -> None:
    """Remove the note of a job that took too long."""
    _note_path(job).unlink(missing_ok=True)
