"""Writes the page: data, style and script in one HTML file that opens from disk and asks nothing of a network."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from datasets.atomic_files import written_whole
from tumble.reports.payload import sequence_payload
from tumble.reports.record import Record
from tumble.versions import versions

MOST_PICTURES = 1600
"""Over all sequences: keeps a page below about 20 MB."""
LEAST_PER_SEQUENCE = 8


def write_page(records: Sequence[Record], path: Path, *, title: str) -> None:
    """Write the report of ``records`` to ``path``."""
    most = max(LEAST_PER_SEQUENCE, MOST_PICTURES // max(len(records), 1))
    sequences = [sequence_payload(record, most_frames=most) for record in records]
    text = render(sequences, title=title)
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def render(sequences: Sequence[dict[str, Any]], *, title: str) -> str:
    """The page's text."""
    environment = Environment(loader=PackageLoader("tumble.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.get_template("report.html.j2").render(
        title=title,
        sequences=sequences,
        summary=summary(sequences),
        data=_inside_script(json.dumps({"sequences": sequences}, allow_nan=False, separators=(",", ":"))),
        made_by=versions()["tumble"],
    )


def summary(sequences: Sequence[dict[str, Any]]) -> str:
    """One sentence on all sequences."""
    converged = sum(sequence["status"] == "converged" for sequence in sequences)
    return f"{converged} of {len(sequences)} sequence{'s' if len(sequences) != 1 else ''} converged."


def _inside_script(text: str) -> str:
    """JSON that cannot end the script element it stands in."""
    return text.replace("&", "\\u0026").replace("<", "\\u003c").replace(">", "\\u003e")
