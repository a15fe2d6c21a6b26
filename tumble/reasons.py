"""Why items were lost, each reason said once however many it struck."""

import re
from collections.abc import Iterable, Mapping
from pathlib import PurePath

NUMBER = re.compile(r"\d[\d.]*(e[+-]?\d+)?")
NAMED = 8
"""Names that a sentence lists before it only counts; ``run.json`` has them all."""


def grouped(reasons: Mapping[str, str]) -> list[tuple[str, str]]:
    """Who, and why: those whose reasons differ in their own name and in numbers alone are told together, with the words of the first."""
    groups: dict[str, list[str]] = {}
    for name, reason in reasons.items():
        groups.setdefault(_without_name(name, reason), []).append(name)
    return [(_who(names), reasons[names[0]]) for names in groups.values()]


def _without_name(name: str, reason: str) -> str:
    return NUMBER.sub("…", reason.replace(name, "…").replace(PurePath(name).stem, "…"))


def listed(names: Iterable[str], most: int = NAMED) -> str:
    """Names with commas, the first few where there are many."""
    told = list(names)
    return ", ".join(told[:most]) + (f" and {len(told) - most} more" if len(told) > most else "")


def _who(names: list[str]) -> str:
    return names[0] if len(names) == 1 else f"{len(names)} of them ({listed(names)})"


def sentences(reasons: Mapping[str, str], what: str) -> list[str]:
    """``NAME is left out: REASON`` with ``what`` as ``left out``."""
    return [f"{who} {'are' if ' of them (' in who else 'is'} {what}: {reason}" for who, reason in grouped(reasons)]
