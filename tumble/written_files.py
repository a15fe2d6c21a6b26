"""Which files in an output folder Tumble wrote. ``--force`` removes these and no others.

When a run ends, well or not, ``run.json`` lists the files that it wrote. A run inside the folder (``quickstart`` has four) lists its own.
A run that was killed had no time to list anything: its files are known by the names that Tumble gives.
"""

import fnmatch
import json
import os
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

from datasets.errors import InputError

SCHEMA = "tumble-run"
RUN_FILE = "run.json"
LOCK_FILE = ".tumble-lock"
NAMES = (
    *("observation.json", "dataset.json", "truth.json", "case.json", "mesh*.ply", "motion.npz", "*outlines*.npz", "*.tif"),
    *("*.surface.ply", "*.surface.companion.ply"),
    *("*.estimate.json", "*.answer.json", "campaign.json", "diagnosis.json", "contact_validation.json", "report.html"),
    *("scores.csv", "scores.json", "impacts.csv", "collisions.csv", "figures.json", "verdict.json", "summary.json"),
    *(
        "cases.csv",
        "parameters.csv",
        "velocities.csv",
        "demo.toml",
        "[clo0-9][0-9][0-9][0-9].json",
        "*.pulse",
        "*.partial",
        ".*.done",
        ".*.late",
    ),
    *("import.toml", "*draft.toml", "*.check.html", "calibration.json", "calibration.html", "gate.html"),
)
"""Names that Tumble gives to files: what a killed run may have written."""


def read_run(path: Path) -> dict[str, Any] | None:
    """``run.json`` of ``path``; ``None`` where there is none or it is not ours."""
    try:
        document = json.loads((path / RUN_FILE).read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except ValueError as error:
        raise InputError(f"{path / RUN_FILE}: expected JSON, got something else ({error}).") from error
    return document if isinstance(document, dict) and document.get("schema") == SCHEMA else None


def files_below(folders: Iterable[Path]) -> set[Path]:
    """Files and links at any depth; links are not followed."""
    return {file for folder in folders for file in _files(folder)}


def _files(folder: Path) -> Iterator[Path]:
    for root, folders, names in os.walk(folder):
        links = [name for name in folders if Path(root, name).is_symlink()]
        yield from (Path(root, name) for name in (*names, *links))


def own_marks(path: Path) -> set[Path]:
    """``run.json`` and the lock of ``path`` itself."""
    return {path / RUN_FILE, path / LOCK_FILE}


def written_by_tumble(path: Path, files: set[Path]) -> set[Path]:
    """Those of ``files`` that the run of ``path``, or a run further inside, wrote."""
    ours: set[Path] = set()
    for folder in {path, *(file.parent for file in files if file.name == RUN_FILE)}:
        document = read_run(folder)
        if document is not None:
            ours |= own_marks(folder) | _listed(folder, document) | _left_by_killed(folder, document, files)
    return ours & files


def _listed(folder: Path, document: Mapping[str, Any]) -> set[Path]:
    return {Path(os.path.normpath(folder / name)) for name in document.get("files", [])}


def _left_by_killed(folder: Path, document: Mapping[str, Any], files: set[Path]) -> set[Path]:
    if "files" in document:
        return set()
    places = [folder, *(folder.parent / name for name in document.get("beside", []))]
    return {file for file in files if any(place in file.parents for place in places) and _has_known_name(file)}


def _has_known_name(file: Path) -> bool:
    return any(fnmatch.fnmatch(file.name, pattern) for pattern in NAMES)


def half_written(files: Iterable[Path]) -> set[Path]:
    """Those of ``files`` that a killed run was writing, or that lie in a folder that it was."""
    return {file for file in files if any(fnmatch.fnmatch(name, ".*-[0-9]*.partial") for name in (file.name, file.parent.name))}


def remove_files(folders: Iterable[Path], files: Iterable[Path]) -> None:
    """Remove ``files``, and what folders inside ``folders`` are empty then."""
    for file in files:
        file.unlink()
    for folder in folders:
        for root, _, _ in sorted(os.walk(folder), reverse=True):  # deepest first
            if Path(root) != folder and not any(Path(root).iterdir()):
                Path(root).rmdir()


def refuse_other_file(path: Path, mark: str, option: str) -> None:
    """Refuse to replace a file that is not Tumble's; an empty one is nobody's.

    Parameters
    ----------
    path
        The file that ``option`` names.
    mark
        Words that every file of this kind has in it.
    option
        As the user typed it, for the message.

    Raises
    ------
    InputError
        Where the file is there and has no ``mark``.
    """
    if path.is_dir():
        raise InputError(f"{option} {path}: expected the name of a file, got a folder.")
    if path.exists() and mark not in (text := path.read_text(encoding="utf-8", errors="replace")) and text.strip():
        raise InputError(f"{option} {path}: expected a new file, or an earlier one of tumble to replace, got another. Choose another name.")
