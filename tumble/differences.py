"""Where two documents differ, in words."""

from typing import Any

WAS_AND_IS = "{name} was {found!r} and is now {wanted!r}"


def first_difference(found: Any, wanted: Any, name: str = "", *, words: str = WAS_AND_IS) -> str:
    """Where two JSON values differ first, in words; empty when they agree."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        for key in sorted(set(found) | set(wanted)):
            different = first_difference(found.get(key), wanted.get(key), f"{name}.{key}" if name else key, words=words)
            if different:
                return different
        return ""
    return "" if found == wanted else words.format(name=name, found=found, wanted=wanted)
