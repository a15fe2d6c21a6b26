"""Where tables and sentences are printed: nothing is folded where neither a terminal nor ``COLUMNS`` says how wide it is."""

import os
import sys

from tumble.console import Console

WIDE = 10_000
"""Characters of a line in a pipe or a file: wider than any table."""


def console() -> Console:
    """Standard output as it is now."""
    return Console(width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDE)
