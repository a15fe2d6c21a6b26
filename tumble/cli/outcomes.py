"""What a run over several items says at its end: on standard error, in ``run.json`` and by its exit code."""

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from tumble.cli.exit_codes import ALL_MEASURED, BAD_INPUT, INCOMPLETE, OWN_FAULT
from tumble.engine import Outcome, failures
from tumble.output_directory import note_failures
from tumble.reasons import grouped, sentences


def report_failures(out: Path, outcomes: Sequence[Outcome], *, verbose: bool) -> None:
    """What failed, and why, on standard error and in ``run.json`` of ``out``; tracebacks of faults only where ``verbose``."""
    failed = failures(outcomes)
    for who, reason in grouped({outcome.name: outcome.message for outcome in failed}):
        print(f"tumble: {who} failed: {reason}", file=sys.stderr)
    faults = {outcome.name: outcome.traceback for outcome in failed if outcome.fault}
    if verbose:
        print("\n".join(faults.values()), file=sys.stderr)
    elif faults:
        print("tumble: this is a fault of tumble itself or of a library, not of the input; -v shows where.", file=sys.stderr)
    if failed:
        others = "the other items are whole; " if len(failed) < len(outcomes) else ""
        print(f"tumble: {others}the same command with --resume tries what failed again.", file=sys.stderr)
    note_failures(out, {outcome.name: outcome.message for outcome in failed}, faults)  # last: the disk may be full


def exit_code(outcomes: Sequence[Outcome]) -> int:
    """0 when every item is there, 1 when some are; when none is, 3 if a fault of Tumble's was among the reasons, otherwise 2."""
    lost = failures(outcomes)
    if not lost:
        return ALL_MEASURED
    if len(lost) < len(outcomes):
        return INCOMPLETE
    return OWN_FAULT if any(outcome.fault for outcome in lost) else BAD_INPUT


def tell_left_out(left_out: Mapping[str, str]) -> None:
    """Why sequences are left out, on standard error."""
    for sentence in sentences(left_out, "left out"):
        print(f"tumble: {sentence}", file=sys.stderr)


def what_next(command: str | None) -> str:
    """The last line of a verb: the command to type next; where nothing was measured, a sentence, since no verb can go on from there."""
    return NOTHING_TO_GO_ON_WITH if command is None else f"next: {command}"


NOTHING_TO_GO_ON_WITH = "Nothing to go on with: check what is named above, then run the same command again with --force."
"""What is said where nothing was measured."""
