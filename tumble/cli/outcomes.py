"""What a run over several items says at its end: on standard error, in ``run.json`` and by its exit code."""

import sys
from collections.abc import Sequence
from pathlib import Path

from tumble.engine import Outcome, failures
from tumble.output_directory import note_failures


def report_failures(out: Path, outcomes: Sequence[Outcome]) -> None:
    """Each item that failed, with its reason: one line on standard error, and into ``run.json`` of ``out``."""
    for outcome in failures(outcomes):
        print(f"tumble: {outcome.name} failed: {outcome.message}", file=sys.stderr)
    if failures(outcomes):
        others = "the other items are whole; " if len(failures(outcomes)) < len(outcomes) else ""
        print(f"tumble: {others}the same command with --resume tries what failed again.", file=sys.stderr)
    note_failures(out, {outcome.name: outcome.message for outcome in failures(outcomes)})  # last: the disk may be full


def exit_code(outcomes: Sequence[Outcome]) -> int:
    """0 when every item is there, 2 when none is, 1 otherwise."""
    lost = len(failures(outcomes))
    if lost == 0:
        return 0
    return 2 if lost == len(outcomes) else 1
