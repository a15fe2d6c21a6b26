"""How far along a run is, on standard error: a bar with the time left on a terminal, a line now and then elsewhere."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

Advance = Callable[[str], None]
"""Called with a name each time an item is done."""

LINE_EVERY_S = 10.0


@contextmanager
def progress(what: str, total: int, *, quiet: bool) -> Iterator[Advance]:
    """Show progress over ``total`` items; yields the function to call after each one."""
    if quiet:
        yield lambda name: None
    elif sys.stderr.isatty():
        with _bar(what, total) as advance:
            yield advance
    else:
        yield _lines(what, total)


@contextmanager
def _bar(what: str, total: int) -> Iterator[Advance]:
    numbers = (MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    columns = (TextColumn("{task.description}"), BarColumn(), *numbers)
    with Progress(*columns, console=Console(stderr=True), transient=True) as display:
        task = display.add_task(what, total=total)

        def advance(name: str) -> None:
            display.update(task, advance=1, description=f"{what} {name}")

        yield advance


def _lines(what: str, total: int) -> Advance:
    began = time.monotonic()
    state = {"done": 0, "last": began}

    def advance(name: str) -> None:
        state["done"] += 1
        now = time.monotonic()
        if now - state["last"] >= LINE_EVERY_S and state["done"] < total:
            state["last"] = now
            left = (now - began) / state["done"] * (total - state["done"])
            print(f"{what}: {state['done']} of {total} ({name}), about {left:.0f} s left", file=sys.stderr, flush=True)

    return advance
