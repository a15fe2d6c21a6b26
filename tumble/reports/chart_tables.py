"""The numbers of a chart as a table that unfolds below it: for a screen reader, and for whoever wants to read a value off."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

from markupsafe import escape


def table_behind(heads: Sequence[str], rows: Iterable[Sequence[Any]]) -> str:
    """An unfolding table as HTML; numbers with four digits."""
    head = "".join(f'<th scope="col">{escape(text)}</th>' for text in heads)
    body = "".join(f"<tr>{''.join(f'<td>{escape(_cell(value))}</td>' for value in row)}</tr>" for row in rows)
    table = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    return f'<details class="numbers"><summary>In numbers</summary><div class="scroll" tabindex="0">{table}</div></details>'


def _cell(value: Any) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
