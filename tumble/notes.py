"""What readers changed in the input, told once for a run: the first note, and how many more there are."""

import sys
from collections.abc import Iterable


def tell_notes(notes: Iterable[str], *, quiet: bool) -> None:
    """Tell notes of observations on standard error."""
    told = list(notes)
    if not told or quiet:
        return
    others = f" The same in {len(told) - 1} more." if len(told) > 1 else ""
    print(f"tumble: note: {told[0]}{others}", file=sys.stderr)
