"""What is known of a recording as TOML: ``import.toml`` beside an observation, ``draft.toml`` where something is missing."""

import json
from collections.abc import Sequence
from pathlib import Path

from datasets.atomic_files import written_whole
from tumble.importing.request import Missing, Value

IMPORT_FILE, DRAFT_FILE = "import.toml", "draft.toml"
HEAD = """\
# What `tumble import` knows of this recording, and where each value is from:
# read (from the file), given (on the command line), assumed (the note says why).
"""


def write_values(path: Path, values: Sequence[Value], missing: Sequence[Missing], command: str) -> None:
    """Write what is known and what is missing; ``command``: what to type to complete it, empty where nothing is missing."""
    with written_whole(path) as temporary:
        temporary.write_text(toml(values, missing, command), encoding="utf-8")


def toml(values: Sequence[Value], missing: Sequence[Missing], command: str) -> str:
    """The text of such a file."""
    lines = [HEAD]
    for value in values:
        note = [f"note = {_text(value.note)}"] if value.note else []
        lines += [f"[{value.name}]", f"value = {_plain(value.plain)}", f"origin = {_text(value.origin.value)}", *note, ""]
    if missing:
        lines += ["# Not an observation yet. Missing is:", ""]
    for each in missing:
        lines += [f"[missing.{each.name}]", f"why = {_text(each.why)}", f"type = {_text(each.what_to_type)}", ""]
    if command:
        lines += ["# When all is there, type:", f"# {command}", ""]
    return "\n".join(lines)


def _plain(value: bool | float | str | list[float]) -> str:
    if isinstance(value, str):
        return _text(value)
    return json.dumps(value)


def _text(text: str) -> str:
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
