"""Numbers, shares, paragraphs and tables in Markdown."""

import textwrap
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import binomtest

from datasets.atomic_files import written_whole

WIDTH = 140
"""Characters in a line of a page."""


def number(value: Any) -> str:
    """Three significant digits without exponent; a dash where there is no number."""
    value = float(value)
    if np.isnan(value):
        return "–"
    if value == 0 or not np.isfinite(value):
        return f"{value:g}"
    digits = max(0, 2 - int(np.floor(np.log10(abs(value)))))
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def percent(value: Any) -> str:
    """A number of per cent."""
    return "–" if np.isnan(value) else f"{number(value)}%"


def with_interval(row: Mapping[Any, Any]) -> str:
    """A median with its interval, or a dash where there is none."""
    if not np.isfinite(row["median"]):
        return "–"
    if not np.isfinite(row["low"]):
        return number(row["median"])
    return f"{number(row['median'])} ({number(row['low'])} to {number(row['high'])})"


def share(held: Any) -> str:
    """A share of yes and no in per cent, with its exact 95% interval [Clopper and Pearson 1934] and the count."""
    yes, n = int(np.sum(held)), len(held)
    if n == 0:
        return "–"
    interval = binomtest(yes, n).proportion_ci(0.95, method="exact")
    return f"{100 * yes / n:.1f}% ({100 * interval.low:.1f} to {100 * interval.high:.1f}%; {yes} of {n})"


def judged(held: Any, asked: float) -> str:
    """Whether a share of yes and no is as large as ``asked``, and whether so many tell: the lower end of its 95% interval is, too."""
    yes, n = int(np.sum(held)), len(held)
    if yes < asked * n:
        return "missed"
    low = binomtest(yes, n).proportion_ci(0.95, method="exact").low
    return "held" if low >= asked else "held by the share; too few to be sure"


def table(heads: Sequence[str], rows: Sequence[Sequence[Any]]) -> list[str]:
    """Lines of a Markdown table."""
    lines = ["| " + " | ".join(heads) + " |", "| " + " | ".join("---" for _ in heads) + " |"]
    return [*lines, *("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows)]


def paragraph(*sentences: str) -> list[str]:
    """Sentences as lines of a page."""
    return textwrap.wrap(" ".join(sentences), WIDTH, break_long_words=False, break_on_hyphens=False)


def write_page(lines: Sequence[str], path: Path) -> None:
    """Write a page."""
    with written_whole(path) as temporary:
        temporary.write_text(page_text(lines), encoding="utf-8")


def page_text(lines: Sequence[str]) -> str:
    """A page's text."""
    return "\n".join(lines).rstrip("\n") + "\n"
