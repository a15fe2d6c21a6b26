"""What a run over several items says at its end."""

import sys
from collections.abc import Sequence

from tumble.engine import Outcome, failures


def say_failures(outcomes: Sequence[Outcome]) -> None:
    """One line on standard error per item that failed."""
    for outcome in failures(outcomes):
        print(f"tumble: {outcome.name} failed: {outcome.message}", file=sys.stderr)
    if failures(outcomes):
        others = "the other items are whole; " if len(failures(outcomes)) < len(outcomes) else ""
        print(f"tumble: {others}the same command with --resume tries what failed again.", file=sys.stderr)


def exit_code(outcomes: Sequence[Outcome]) -> int:
    """0 when every item is there, 2 when none is, 1 otherwise."""
    lost = len(failures(outcomes))
    if lost == 0:
        return 0
    return 2 if lost == len(outcomes) else 1
