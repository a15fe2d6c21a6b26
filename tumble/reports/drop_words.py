"""Which flights of recordings with impacts are used, in a sentence."""

from collections.abc import Mapping, Sequence
from typing import Any

MOST_NAMED = 6
"""Recordings whose flights are named one by one."""


def drops_sentence(drops: Sequence[Mapping[str, Any]]) -> str:
    """How many flights of each drop are used."""
    used = sum(len(each["flights"]) for each in drops)
    named = [f"{each['recording']}: {', '.join(map(str, each['flights']))}" for each in drops[:MOST_NAMED]]
    named += [f"and {len(drops) - MOST_NAMED} more"] if len(drops) > MOST_NAMED else []
    count = f"{len(drops)} recording{'s have' if len(drops) != 1 else ' has'} impacts"
    return f"{count}: {used} flights before, between and after them are used, each with a state of its own ({'; '.join(named)})."
