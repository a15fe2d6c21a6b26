"""Commands that a person can paste into a shell, whatever blanks and quotes are in them."""

import shlex
from pathlib import Path


def command(*words: str | Path) -> str:
    """``tumble`` with these words, quoted where a shell needs it."""
    return shlex.join(["tumble", *map(str, words)])
