"""Writes the page: data, style and script in one HTML file that opens from disk and asks nothing of a network."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from datasets.atomic_files import written_whole
from tumble.reports.csv_tables import TABLES, csv_text
from tumble.reports.packed import DISTANCE_STEPS, FINE
from tumble.reports.sequence_row import HEADS, TRUE_HEADS
from tumble.versions import versions

MOST_PICTURES = 4000
"""Over all sequences: 100 sequences have 40 each. Of pictures of 256 × 256 pixels, the largest, a page then has some 60 MB."""
LEAST_PER_SEQUENCE = 8

Parts = Mapping[str, Any]
"""What :func:`tumble.reports.payload.sequence_parts` makes of a sequence."""


def pictures_each(sequences: int) -> int:
    """How many pictures each of so many sequences may have."""
    return max(LEAST_PER_SEQUENCE, MOST_PICTURES // max(sequences, 1))


def write_page(parts: Sequence[Parts], path: Path, *, title: str) -> None:
    """Write the page to ``path`` and every table of it, as CSV, beside it."""
    page = render(parts, title=title)
    for name, text in _tables(parts).items():
        _write(path.parent / f"{name}.csv", text)
    _write(path, page)


def render(parts: Sequence[Parts], *, title: str) -> str:
    """The page's text."""
    environment = Environment(loader=PackageLoader("tumble.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    rows = [part["row"] for part in parts]
    known = any(cell[1] is not None for row in rows for cell in row["true_cells"])
    return environment.get_template("report.html.j2").render(
        title=title,
        rows=rows,
        heads=[*HEADS, *(TRUE_HEADS if known else ())],
        with_truth=known,
        statuses=sorted({row["status"] for row in rows}),
        summary=summary(rows),
        settings=_inside_script(json.dumps({"fine": FINE, "distance_steps": DISTANCE_STEPS})),
        blocks=[_inside_script(json.dumps(part["shown"], allow_nan=False, separators=(",", ":"))) for part in parts],
        tables={name: _inside_script(json.dumps(text)) for name, text in _tables(parts).items()},
        made_by=versions()["tumble"],
    )


def summary(rows: Sequence[Mapping[str, Any]]) -> str:
    """One sentence on all sequences."""
    converged = sum(row["status"] == "converged" for row in rows)
    return f"{converged} of {len(rows)} sequence{'s' if len(rows) != 1 else ''} converged."


def _tables(parts: Sequence[Parts]) -> dict[str, str]:
    return {name: csv_text(name, (row for part in parts for row in part["csv"][name])) for name in TABLES}


def _write(path: Path, text: str) -> None:
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _inside_script(text: str) -> str:
    """JSON that cannot end the script element it stands in."""
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
