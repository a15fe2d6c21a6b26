"""What no document may hold, whatever its format: numbers that a double or a 64-bit integer cannot hold, keys given twice, deep nesting.

JSON and TOML let them through or end in errors of Python's own; here the first one is found with its place.
"""

import math
from collections import Counter
from typing import Any

DEEPEST = 64
"""Levels of nesting; the deepest document of this project has about ten."""
LARGEST_INTEGER = 2**63 - 1


class Twice:
    """Stands in a document for the value of a key that came twice."""


def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A table of its entries (for ``json.loads``), :class:`Twice` under a key that comes twice."""
    table = dict(pairs)
    if len(table) < len(pairs):
        table |= {key: Twice() for key, count in Counter(key for key, _ in pairs).items() if count > 1}
    return table


def integer(text: str) -> int | float:
    """An integer (for ``json.loads``), infinity in place of one so long that Python refuses to convert it."""
    return int(text) if len(text) < 4 * len(str(LARGEST_INTEGER)) else math.inf


def first_fault(document: Any, root: str) -> str | None:
    """The first value that cannot stay, in the order of the document, as "at PLACE: expected ..., got ..."; ``root`` begins each place."""
    waiting: list[tuple[Any, tuple[Any, ...], int]] = [(document, (root,), 1)]
    while waiting:
        value, place, depth = waiting.pop()
        fault = _fault(value, depth)
        if fault is not None:
            return f"at {_written(place)}: {fault}"
        if isinstance(value, dict | list):
            entries = value.items() if isinstance(value, dict) else enumerate(value)
            waiting += [(entry, (place, key), depth + 1) for key, entry in entries][::-1]
            if isinstance(value, dict) and not all(map(_encodable, value)):
                return f"at {_written(place)}: expected keys in Unicode, got one with half a surrogate pair"
    return None


def _fault(value: Any, depth: int) -> str | None:
    match value:
        case bool() | None:
            return None
        case float():
            return None if math.isfinite(value) else f"expected a finite number, got {_named(value)}"
        case int():
            return None if abs(value) <= LARGEST_INTEGER else "expected an integer of at most 64 bit, got a longer one"
        case str():
            return None if _encodable(value) else "expected text in Unicode, got half a surrogate pair"
        case Twice():
            return "expected the key once, got twice"
        case dict() | list() if depth > DEEPEST:
            return f"expected at most {DEEPEST} levels of nesting, got more"
    return None


def _named(value: float) -> str:
    return "NaN" if math.isnan(value) else "Infinity or a number beyond 1.8e308"


def _encodable(text: str) -> bool:
    return text.isascii() or not any("\ud800" <= letter <= "\udfff" for letter in text)


def _written(place: tuple[Any, ...]) -> str:
    """A place such as ``$.cameras[1].name``, from links of (place before, key)."""
    keys: list[Any] = []
    while len(place) == 2:
        place, key = place
        keys.append(key)
    parts = [f"[{key}]" if isinstance(key, int) else f".{key}" for key in reversed(keys)]
    return "".join([place[0], *parts]).removeprefix(".")
