"""How far along a run is, on standard error: a bar with the time left on a terminal, a line now and then elsewhere.

Items that take long may leave a *pulse*: a small file with the share that is done, written by whichever process works on the
item and read here, so that one long item has a time left, too.
"""

import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from pathlib import Path

from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeElapsedColumn

from tumble.console import Console

Advance = Callable[[str], None]
"""Called with a name each time an item is done."""

PULSE = ".pulse"
EVERY_S = 0.5
LINE_EVERY_S = 10.0
RESUMED_S = 0.5
"""What is done so early was done by an earlier run, and says nothing of the time left."""


@contextmanager
def progress(what: str, total: int, *, quiet: bool, pulses: Path | None = None) -> Iterator[Advance]:
    """Show progress over ``total`` items; yields the function to call after each one. ``pulses``: the folder to look for pulses in."""
    if quiet:
        yield lambda name: None
        return
    show = _bar if sys.stderr.isatty() else _lines
    with show(what, total) as update, _watched(update, pulses) as advance:
        yield advance


def write_pulse(path: Path, done: int, total: int) -> None:
    """Say that ``done`` of ``total`` parts of an item are done; a pulse that cannot be written does not matter."""
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"{done / max(total, 1):.4f}", encoding="ascii")


def pulse_sum(folder: Path | None) -> float:
    """The sum of the shares done of the items under way."""
    return sum(_share(path) for path in folder.glob(f"*{PULSE}")) if folder is not None else 0.0


def _share(path: Path) -> float:
    try:
        return float(path.read_text(encoding="ascii"))
    except (OSError, ValueError):  # just removed, or just being written
        return 0.0


Update = Callable[[float, str], None]
"""Told how many items are done, parts counted, and the name of the last one."""


@contextmanager
def _watched(update: Update, pulses: Path | None) -> Iterator[Advance]:
    """Call ``update`` when an item is done and, in between, twice a second."""
    done, last = [0], [""]
    stopped = threading.Event()

    def watch() -> None:
        while not stopped.wait(EVERY_S):
            update(done[0] + pulse_sum(pulses), last[0])

    def advance(name: str) -> None:
        done[0] += 1
        last[0] = name
        update(done[0] + pulse_sum(pulses), name)

    thread = threading.Thread(target=watch, daemon=True)
    thread.start()
    try:
        yield advance
    finally:
        stopped.set()
        thread.join()


class Pace:
    """The time left, from what is done since the start.

    Nothing is learned between two items, so there the time left runs down; it does not grow with every second that the next one takes.
    Where that one takes longer than all that was left, nobody knows how long.
    """

    def __init__(self, now: float) -> None:
        self.began, self.at, self.done, self.before = now, now, 0.0, 0.0

    def left_s(self, now: float, done: float, total: int) -> float | None:
        """Seconds left when ``done`` of ``total`` are done at the time ``now`` (s); ``None`` where nobody knows."""
        if now - self.began < RESUMED_S:
            self.before = self.done = done
        elif done > self.done:
            self.at, self.done = now, done
        if not self.before < self.done:
            return None
        left = (self.at - self.began) / (self.done - self.before) * (total - self.done) - (now - self.at)
        return left if left >= 0.0 else None


@contextmanager
def _bar(what: str, total: int) -> Iterator[Update]:
    pace = Pace(time.monotonic())
    left = TextColumn("{task.fields[left]}")
    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeElapsedColumn(), left)
    with Progress(*columns, console=Console(stderr=True), transient=True) as display:
        task = display.add_task(what, total=total, left="")

        def update(done: float, name: str) -> None:
            left = pace.left_s(time.monotonic(), done, total)
            told = "" if left is None else f"{timedelta(seconds=round(left))} left"
            display.update(task, completed=done, description=f"{what} {name}", left=told)

        yield update


@contextmanager
def _lines(what: str, total: int) -> Iterator[Update]:
    pace = Pace(time.monotonic())
    last = [pace.began]

    def update(done: float, name: str) -> None:
        now = time.monotonic()
        left = pace.left_s(now, done, total)
        if now - last[0] < LINE_EVERY_S or not pace.before < done < total:
            return
        last[0] = now
        told = "this one takes longer than those before" if left is None else f"about {left:.0f} s left"
        print(f"{what}: {done / total:.0%} of {total}, {told}", file=sys.stderr, flush=True)

    yield update
