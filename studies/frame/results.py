"""A study's result: tidy rows in a CSV file, and beside it what they were made with."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from studies.frame.digests import of_bytes

DIGITS = "%.6g"


@dataclass(frozen=True)
class Again:
    """``cases`` of all ``of`` that were drawn at random and made anew with ``code``: their rows are the same."""

    cases: int
    of: int
    code: Mapping[str, str]


@dataclass(frozen=True)
class Result:
    """Rows of all cases, labels first, and what made them.

    ``settings`` as they were asked for; ``sources``: short digests of the plan's files; ``code``: of the libraries; ``versions`` of
    software; ``failed``: cases that could not be made or measured for a fault, which are missing among the rows; ``again``: of how many
    cases other code has made the same rows, if it was asked to.
    """

    study: str
    settings: Mapping[str, Any]
    sources: Mapping[str, str]
    code: Mapping[str, str]
    versions: Mapping[str, str]
    failed: tuple[str, ...]
    rows: pd.DataFrame
    again: Again | None = None
    rows_digest: str = ""


def write_result(result: Result, folder: Path) -> Result:
    """Write both files and read them back, so that a page copies what the files hold."""
    table = table_of(result.rows)
    written = {key: getattr(result, key) for key in ("study", "settings", "sources", "code", "versions", "failed")}
    again = {} if result.again is None else {"again": asdict(result.again)}
    document = {**written, **again, "rows": len(result.rows), "rows_digest": of_bytes(table.encode())}
    for path, text in (
        (_rows_of(result.study, folder), table),
        (_document_of(result.study, folder), json.dumps(document, indent=1) + "\n"),
    ):
        with written_whole(path) as temporary:
            temporary.write_text(text, encoding="utf-8")
    return read_result(result.study, folder)


def table_of(rows: pd.DataFrame) -> str:
    """Rows as their file holds them."""
    return str(rows.to_csv(index=False, float_format=DIGITS, lineterminator="\n"))


def read_result(study: str, folder: Path) -> Result:
    """A result from its two files.

    Raises
    ------
    InputError
        Where one is missing, or the rows are not those that the document was written with.
    """
    path, rows = _document_of(study, folder), _rows_of(study, folder)
    for file in (path, rows):
        if not file.is_file():
            raise InputError(f"{file}: expected the result of {study}, found nothing")
    document = json.loads(path.read_text(encoding="utf-8"))
    digest = of_bytes(rows.read_bytes())
    if digest != document["rows_digest"]:
        raise InputError(f"{rows}: expected rows with the digest {document['rows_digest']}, got {digest}")
    told = {key: document[key] for key in ("study", "settings", "sources", "code", "versions", "rows_digest")}
    again = Again(**document["again"]) if "again" in document else None
    return Result(**told, failed=tuple(document["failed"]), again=again, rows=pd.read_csv(rows))


def _document_of(study: str, folder: Path) -> Path:
    return folder / f"{study}.json"


def _rows_of(study: str, folder: Path) -> Path:
    return folder / f"{study}.csv"
