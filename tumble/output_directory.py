"""An output directory belongs to one run: locked while it is written, described by ``run.json``, never overwritten silently.

``run.json`` holds the verb, the resolved configuration, versions, seed, renderer variant, schema version and the command, and how the
run ended: ``unfinished`` (under way, stopped or killed), ``finished``, or ``finished_with_failures``, where ``failures`` names each
item that failed and why. The lock is an advisory ``flock``: the system releases it however the process ends, so a killed run leaves
nothing to clean up.
"""

import fcntl
import json
import os
import shutil
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from datasets.atomic_files import write_failure, written_whole
from datasets.errors import InputError
from tumble.versions import versions

SCHEMA = "tumble-run"
SCHEMA_VERSION = 1
RUN_FILE = "run.json"
LOCK_FILE = ".tumble-lock"
UNFINISHED, FINISHED, FINISHED_WITH_FAILURES = "unfinished", "finished", "finished_with_failures"


@dataclass(frozen=True)
class Run:
    """What is about to be written: ``configuration`` is resolved (defaults included) and JSON-compatible."""

    verb: str
    configuration: Mapping[str, Any]
    seed: int | None = None
    variant: str | None = None


@contextmanager
def output_directory(path: Path, run: Run, *, resume: bool, force: bool) -> Iterator[Path]:
    """Lock ``path`` for this run and describe it; yields ``path``.

    Raises
    ------
    InputError
        When another run is writing there, when it holds a run and neither ``resume`` nor ``force`` was given, when it
        holds anything else, or when ``resume`` was given with another configuration.
    """
    _make(path)
    with _locked(path):
        _prepare(path, run, resume=resume, force=force)
        write_run(path, run)
        yield path
        _finish(path)


def note_failures(path: Path, reasons: Mapping[str, str]) -> None:
    """Write into ``run.json`` which items failed and why, so that a run that lost some never reads as finished."""
    if reasons:
        failures = [{"item": item, "reason": reason} for item, reason in reasons.items()]
        _write(path, {**_described(path), "failures": failures})


def _finish(path: Path) -> None:
    document = _described(path)
    _write(path, {**document, "state": FINISHED_WITH_FAILURES if document["failures"] else FINISHED})


def _described(path: Path) -> dict[str, Any]:
    document = read_run(path)
    if document is None:
        raise InputError(f"{path / RUN_FILE}: expected what this run wrote at its start; something has removed it.")
    return document


def _make(path: Path) -> None:
    if path.exists() and not path.is_dir():
        raise InputError(f"{path}: expected a folder for --out, found a file.")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_failure(path, error) from error


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    with (path / LOCK_FILE).open("a+", encoding="utf-8") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.seek(0)
            owner = lock.read().strip() or "unknown"
            raise InputError(f"{path}: process {owner} is writing there. Wait for it, or choose another --out.") from error
        lock.truncate(0)
        lock.write(str(os.getpid()))
        lock.flush()
        yield


def _prepare(path: Path, run: Run, *, resume: bool, force: bool) -> None:
    others = [entry for entry in path.iterdir() if entry.name != LOCK_FILE]
    if not others:
        return
    before = read_run(path)
    if before is None:
        raise InputError(f"{path}: holds files that no run of tumble wrote ({others[0].name}); choose another --out.")
    if force:
        _empty(others)
    elif resume:
        _same_run(path, run, before)
    else:
        held = _words(before)
        raise InputError(f"{path}: holds {held}. Add --resume to go on with it or --force to replace it.")


def _words(document: Mapping[str, Any]) -> str:
    verb = f"of `tumble {document['verb']}`"
    if document["state"] == FINISHED_WITH_FAILURES:
        return f"a run {verb} that finished with failures ({len(document['failures'])})"
    return f"the {document['state']} run {verb}"


def _empty(entries: list[Path]) -> None:
    for entry in entries:
        if entry.is_dir() and not entry.is_symlink():
            shutil.rmtree(entry)
        else:
            entry.unlink()


def _same_run(path: Path, run: Run, before: Mapping[str, Any]) -> None:
    wanted = json.loads(json.dumps({"verb": run.verb, "configuration": run.configuration}))
    found = {"verb": before["verb"], "configuration": before["configuration"]}
    different = first_difference(found, wanted)
    if different:
        raise InputError(f"{path / RUN_FILE}: --resume needs the same run, but {different}. Use --force to replace it, or another --out.")


def first_difference(found: Any, wanted: Any, name: str = "") -> str:
    """Where two JSON values differ first, in words; empty when they agree."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        for key in sorted(set(found) | set(wanted)):
            different = first_difference(found.get(key), wanted.get(key), f"{name}.{key}" if name else key)
            if different:
                return different
        return ""
    return "" if found == wanted else f"{name} was {found!r} and is now {wanted!r}"


def read_run(path: Path) -> dict[str, Any] | None:
    """``run.json`` of ``path``; ``None`` where there is none or it is not ours."""
    try:
        document = json.loads((path / RUN_FILE).read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except ValueError as error:
        raise InputError(f"{path / RUN_FILE}: expected JSON, found something else ({error}).") from error
    return document if isinstance(document, dict) and document.get("schema") == SCHEMA else None


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
            "command": " ".join(["tumble", *sys.argv[1:]]),
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
