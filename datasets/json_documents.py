"""JSON documents of the project: written deterministically, read with precise errors.

Every document names its ``format`` and ``schema_version`` and may carry ``sha256``, the digest of the rest of its content (canonical
JSON: sorted keys, no spaces). A reader rejects, each with its own message: a file that is missing, empty or cut off; values that no
document may hold (:mod:`datasets.plain_values`); JSON that is not one of ours; a document of a newer schema; one edited after it was
written (digest); one that does not fit the published JSON Schema in ``datasets/schemas``. Floats round-trip exactly (shortest repr).
Numbers that JSON does not know are the strings ``"NaN"``, ``"Infinity"`` and ``"-Infinity"``, and only where a schema allows them.
"""

import hashlib
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.plain_values import first_fault, integer, unique
from datasets.schema_errors import first_violation, shown

SCHEMA_VERSION = 1
_SPECIAL = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf}

Document = dict[str, Any]


def plain(value: Any) -> Any:
    """``value`` as JSON types: arrays as nested lists, NumPy scalars as Python's, tuples as lists, NaN and infinities as strings."""
    match value:
        case np.ndarray() if value.dtype.kind in "biuf" and np.isfinite(value).all():  # nothing in it has to be looked at
            return value.tolist()
        case np.ndarray() | np.generic():
            return plain(value.tolist())
        case dict():
            return {str(key): plain(entry) for key, entry in value.items()}
        case list() | tuple():
            return [plain(entry) for entry in value]
        case float() if not math.isfinite(value):
            return "NaN" if math.isnan(value) else ("Infinity" if value > 0 else "-Infinity")
        case None | bool() | int() | float() | str():
            return value
    raise TypeError(f"cannot be written as JSON: {type(value).__name__}")


def revived(value: Any) -> Any:
    """The inverse of :func:`plain` for free-form content: the strings for NaN and infinities become floats again."""
    match value:
        case dict():
            return {key: revived(entry) for key, entry in value.items()}
        case list():
            return [revived(entry) for entry in value]
        case str():
            return _SPECIAL.get(value, value)
    return value


def digest(document: Document) -> str:
    """SHA-256 of the content, without ``sha256`` itself and whatever the file's layout."""
    content = {key: value for key, value in document.items() if key != "sha256"}
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def write_document(path: Path, kind: str, content: Document) -> None:
    """Write ``content`` as a document of ``kind`` (``"observation"``, ``"estimate"``...), byte for byte the same for the same content."""
    document = {**plain(content), "format": f"tumble {kind}", "schema_version": SCHEMA_VERSION}
    document["sha256"] = digest(document)
    with written_whole(path) as temporary:
        temporary.write_text(_layout(document) + "\n", encoding="utf-8", newline="\n")


def read_document(path: Path, kind: str) -> Document:
    """Read and check a document of ``kind``.

    Raises
    ------
    InputError
        Naming the file and what is wrong with it, see the module's description.
    """
    document = parsed_json(path)
    _check_kind(path, kind, document)
    _check_digest(path, document)
    violation = first_violation(document, kind)
    if violation is not None:
        raise InputError(f"{path}: {violation}")
    return document


def _layout(value: Any, indent: int = 0) -> str:
    """JSON text with one key per line and lists of plain values on one line, so that people can read and edit it."""
    pad = " " * (indent + 1)
    if isinstance(value, dict) and value:
        lines = [f"{pad}{json.dumps(key)}: {_layout(value[key], indent + 1)}" for key in sorted(value)]
        return "{\n" + ",\n".join(lines) + "\n" + " " * indent + "}"
    if isinstance(value, list) and any(isinstance(entry, dict | list) for entry in value):
        return "[\n" + ",\n".join(pad + _layout(entry, indent + 1) for entry in value) + "\n" + " " * indent + "]"
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def parsed_json(path: Path) -> Any:
    """JSON of ``path``, without what :mod:`datasets.plain_values` refuses.

    Raises
    ------
    InputError
        Naming the file, where it is missing, empty, cut off or no JSON.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: expected JSON text in UTF-8, got binary data.") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from error
    if not text.strip():
        raise InputError(f"{path}: expected JSON, got an empty file.")
    try:
        document = json.loads(text, parse_constant=float, parse_int=integer, object_pairs_hook=unique)
    except json.JSONDecodeError as error:
        cut = error.pos >= len(text.rstrip()) or error.msg.startswith("Unterminated")
        cause = "the file ends too early; it seems to be cut off" if cut else f"not valid JSON ({error.msg})"
        raise InputError(f"{path}: line {error.lineno}, column {error.colno}: {cause}.") from None
    except RecursionError:
        raise InputError(f"{path}: not a file of this project (nested too deeply).") from None
    fault = first_fault(document, "$")
    if fault is not None:
        raise InputError(f"{path}: {fault}.")
    return document


def _check_kind(path: Path, kind: str, document: Any) -> None:
    came = document.get("format") if isinstance(document, dict) else None
    if came != f"tumble {kind}":
        described = f'"format": {shown(came)}' if came is not None else 'JSON without "format"'
        raise InputError(f'{path}: expected "format": "tumble {kind}", got {described}; this is another kind of file.')
    version = document.get("schema_version")
    if isinstance(version, int) and version > SCHEMA_VERSION:
        raise InputError(
            f"{path}: expected schema version {SCHEMA_VERSION} or older, got {version}; a newer Tumble wrote it. Upgrade this one."
        )


def _check_digest(path: Path, document: Document) -> None:
    stated = document.get("sha256")
    if stated is not None and stated != digest(document):
        raise InputError(
            f"{path}: was edited after being written (its sha256 does not fit its content). "
            'If the edit is wanted, delete the "sha256" line to accept it; otherwise make the file again.'
        )
