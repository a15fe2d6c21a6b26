"""The mark that an item is done: the settings that the product was made with, and its digest.

A product without a mark, or that is not the one marked, is made again: it may be half of one, or of a run that was killed. A product of
other settings is refused, since a run of two kinds of results reads like one of one kind. Paths among the settings are kept relative to
the product, so that a run that was moved as a whole can go on.
"""

import json
import os
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.file_digests import file_sha256
from tumble.differences import first_difference
from tumble.engine.items import Job

SUFFIX = ".done"


def mark_path(product: Path) -> Path:
    """Where the mark of ``product`` lies."""
    return product.with_name(f".{product.name}{SUFFIX}")


def mark_done(job: Job) -> None:
    """Mark a job whose task has ended well; a task that leaves no product on purpose is done anew by the next run."""
    if not job.product.is_file():
        return
    mark = {"settings": _settings(job), "product": file_sha256(job.product)}
    with written_whole(mark_path(job.product)) as temporary:
        temporary.write_text(json.dumps(mark) + "\n", encoding="utf-8")


def is_done(job: Job) -> bool:
    """Whether the product is there, whole, and made with these settings.

    Raises
    ------
    InputError
        Where it was made with other ones.
    """
    mark = _read(mark_path(job.product))
    if mark is None or not job.product.is_file():
        return False
    wanted = {"settings": _settings(job)}
    different = first_difference({key: mark.get(key) for key in wanted}, wanted)
    if different:
        raise InputError(f"{job.product}: expected a result of the same settings to go on with, but {different}. Choose another --out.")
    return bool(mark.get("product") == file_sha256(job.product))


def _read(path: Path) -> dict[str, Any] | None:
    try:
        mark = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return mark if isinstance(mark, dict) else None


def _settings(job: Job) -> Any:
    settings = {key: value for key, value in job.payload.items() if key not in job.apart}
    return json.loads(json.dumps(_relative(settings, str(job.product.parent)), default=str))


def _relative(value: Any, folder: str) -> Any:
    if isinstance(value, dict):
        return {str(key): _relative(each, folder) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_relative(each, folder) for each in value]
    return os.path.relpath(value, folder) if isinstance(value, str) and os.path.isabs(value) else value
