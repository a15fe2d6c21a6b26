"""Where tables and sentences are printed.

Names are text, never markup. Nothing is folded where neither a terminal nor ``COLUMNS`` says how wide it is.
"""

import os
import sys

from rich.console import Console

WIDE = 10_000
"""Characters of a line in a pipe or a file: wider than any table."""


def console() -> Console:
    """Standard output as it is now."""
    return Console(markup=False, highlight=False, soft_wrap=False, width=None if sys.stdout.isatty() or "COLUMNS" in os.environ else WIDE)
