"""An output directory belongs to one run: locked while it is written, described by ``run.json``, never overwritten silently.

``run.json`` holds the verb, the resolved configuration, versions, seed, renderer variant, schema version and the command, how the
run ended (``unfinished``: under way, stopped or killed; ``finished``; or ``finished_with_failures``, where ``failures`` names each
item that failed and why), and the ``files`` that it wrote. ``--force`` removes those and nothing else; a folder that holds other files, or
what the run reads, is refused. The lock is an advisory ``flock``: the system releases it however the process ends.
"""

import fcntl
import json
import os
import shlex
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from io import TextIOWrapper
from pathlib import Path
from typing import Any

from datasets.atomic_files import write_failure, written_whole
from datasets.errors import InputError
from tumble.differences import first_difference
from tumble.read_paths import refuse_to_replace_what_is_read
from tumble.versions import versions
from tumble.written_files import (
    LOCK_FILE,
    RUN_FILE,
    SCHEMA,
    files_below,
    half_written,
    own_marks,
    read_run,
    remove_files,
    written_by_tumble,
)

SCHEMA_VERSION = 1
UNFINISHED, FINISHED, FINISHED_WITH_FAILURES = "unfinished", "finished", "finished_with_failures"


@dataclass(frozen=True)
class Run:
    """What is about to be written: ``configuration`` is resolved (defaults included) and JSON-compatible.

    ``reads``: every file and folder that the run reads. ``beside``: names of further folders that it writes, next to its own.
    """

    verb: str
    configuration: Mapping[str, Any]
    seed: int | None = None
    variant: str | None = None
    reads: tuple[Path, ...] = field(kw_only=True)
    beside: tuple[str, ...] = field(default=(), kw_only=True)

    def places(self, path: Path) -> tuple[Path, ...]:
        """All folders that the run writes, where ``path`` is its own."""
        return (path, *(path.parent / name for name in self.beside))


@contextmanager
def output_directory(path: Path, run: Run, *, resume: bool, force: bool) -> Iterator[Path]:
    """Lock ``path`` for this run and describe it; yields ``path``.

    A run that fails before it has written anything leaves nothing behind.

    Raises
    ------
    InputError
        When another run is writing there, when it holds a run and neither ``resume`` nor ``force`` was given, when it
        holds anything else or what the run reads, or when ``resume`` was given with another configuration.
    """
    refuse_to_replace_what_is_read(path.parent if run.beside else path, run.reads, force=force)
    _refuse_other_files(path, run)
    with _made(path), _locked(path):
        others = _prepare(path, run, resume=resume, force=force)
        write_run(path, run)
        try:
            yield path
        except BaseException as error:
            if isinstance(error, Exception) and not _products(path, run):
                (path / RUN_FILE).unlink(missing_ok=True)
            else:
                _list_files(path, run, others)
            raise
        _list_files(path, run, others)
        _finish(path)


def note_failures(path: Path, reasons: Mapping[str, str], tracebacks: Mapping[str, str] | None = None) -> None:
    """Write into ``run.json`` which items failed and why, so that a run that lost some never reads as finished.

    ``tracebacks``: where, for those that failed of a fault of Tumble's.
    """
    if reasons:
        where = tracebacks or {}
        failures = [
            {"item": item, "reason": reason} | ({"traceback": where[item]} if item in where else {}) for item, reason in reasons.items()
        ]
        _write(path, {**_described(path), "failures": failures})


def _finish(path: Path) -> None:
    document = _described(path)
    _write(path, {**document, "state": FINISHED_WITH_FAILURES if document["failures"] else FINISHED})


def _described(path: Path) -> dict[str, Any]:
    document = read_run(path)
    if document is None:
        raise InputError(f"{path / RUN_FILE}: expected what this run wrote at its start; got nothing; something has removed it.")
    return document


@contextmanager
def _made(path: Path) -> Iterator[None]:
    """Make the folder; what is empty at the end goes again."""
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: expected a folder for --out, got a file.")
    missing = [folder for folder in (path, *path.parents) if not folder.exists()]
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_failure(path, error) from error
    try:
        yield
    finally:
        with suppress(OSError):  # the first that is not empty ends it
            for folder in missing:
                folder.rmdir()


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    with _lock_of(path) as lock:
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()
        try:
            yield
        finally:
            if not (path / RUN_FILE).exists():
                (path / LOCK_FILE).unlink(missing_ok=True)


def _lock_of(path: Path) -> TextIOWrapper:
    """The lock file, held; it is opened again where another run removed it in between."""
    while True:
        lock = (path / LOCK_FILE).open("a+", encoding="utf-8")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            with lock:
                lock.seek(0)
                owner = lock.read().strip() or "unknown"
            raise InputError(f"{path}: process {owner} is writing there. Wait for it, or choose another --out.") from error
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(lock.fileno()), (path / LOCK_FILE).stat()):
                return lock
        lock.close()


def _products(path: Path, run: Run) -> set[Path]:
    """Files in the run's folders beside its own marks."""
    return files_below(run.places(path)) - own_marks(path)


def _refuse_other_files(path: Path, run: Run) -> None:
    if path.is_dir() and read_run(path) is None:
        for other in sorted(_products(path, run)):
            raise InputError(f"{path}: holds files that no run of tumble wrote ({_short(other, path)}); choose another --out.")


def _short(file: Path, path: Path) -> str:
    return os.path.relpath(file, path)


def _prepare(path: Path, run: Run, *, resume: bool, force: bool) -> set[Path]:
    """Empty the folder, or see to it that it is empty or holds the same run; the files in it that are not Tumble's."""
    _refuse_other_files(path, run)
    before, products = read_run(path), _products(path, run)
    if before is None or (before["state"] == FINISHED_WITH_FAILURES and not products):
        return set()
    others = products - written_by_tumble(path, products)
    if force:
        _refuse_to_remove(others, path)
        remove_files(run.places(path), products)
        return set()
    if not resume:
        raise InputError(f"{path}: holds {_words(before)}. Add --resume to go on with it or --force to replace it.")
    _same_run(path, run, before)
    remove_files(run.places(path), half_written(products - others))
    return others


def _refuse_to_remove(others: set[Path], path: Path) -> None:
    if others:
        more = f" and {len(others) - 1} more" if len(others) > 1 else ""
        raise InputError(
            f"{path}: expected only files that tumble wrote for --force to remove, got {_short(min(others), path)}{more}, which it did not "
            "write. Move what is yours away, or choose another --out."
        )


def _list_files(path: Path, run: Run, others: set[Path]) -> None:
    """Write into ``run.json`` what the run wrote."""
    files = sorted(_short(file, path) for file in _products(path, run) - others)
    _write(path, {**_described(path), "files": files})


def _words(document: Mapping[str, Any]) -> str:
    verb = f"of `tumble {document['verb']}`"
    if document["state"] == FINISHED_WITH_FAILURES:
        return f"a run {verb} that finished with failures ({len(document['failures'])})"
    return f"the {document['state']} run {verb}"


def _same_run(path: Path, run: Run, before: Mapping[str, Any]) -> None:
    wanted = json.loads(json.dumps({"verb": run.verb, "configuration": run.configuration}))
    found = {"verb": before["verb"], "configuration": before["configuration"]}
    different = first_difference(found, wanted)
    if different:
        raise InputError(f"{path / RUN_FILE}: --resume needs the same run, but {different}. Use --force to replace it, or another --out.")


def write_run(path: Path, run: Run) -> None:
    """Write ``run.json`` of a run that begins."""
    _write(
        path,
        {
            "schema": SCHEMA,
            "schema_version": SCHEMA_VERSION,
            "verb": run.verb,
            "state": UNFINISHED,
            "failures": [],
            "command": shlex.join(["tumble", *sys.argv[1:]]),
            "beside": list(run.beside),
            "seed": run.seed,
            "variant": run.variant,
            "configuration": run.configuration,
            "versions": versions(),
        },
    )


def _write(path: Path, document: Mapping[str, Any]) -> None:
    dated = {**document, "written": datetime.now(UTC).isoformat(timespec="seconds")}
    with written_whole(path / RUN_FILE) as temporary:
        temporary.write_text(json.dumps(dated, indent=2) + "\n", encoding="utf-8")
