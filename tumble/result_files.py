"""Where observations and estimates lie: in a dataset, in a folder of their own, or named one by one."""

from pathlib import Path

from datasets.errors import InputError
from datasets.observation_files import FILE as OBSERVATION_FILE

SUFFIX = ".estimate.json"


def observations_in(source: Path) -> tuple[Path, ...]:
    """Observation folders of a dataset, of an ``observations`` folder, or ``source`` itself.

    Raises
    ------
    InputError
        Where there is none.
    """
    if (source / OBSERVATION_FILE).is_file():
        return (source,)
    root = source / "observations" if (source / "observations").is_dir() else source
    found = tuple(sorted(path.parent for path in root.glob(f"*/{OBSERVATION_FILE}"))) if root.is_dir() else ()
    if not source.exists():
        raise InputError(f"{source}: there is no such file or folder.")
    if not found:
        raise InputError(f"{source}: expected a dataset or an observation ({OBSERVATION_FILE} in it), got nothing like it.")
    return found


def estimate_path(out: Path, sequence: str) -> Path:
    """Where the estimate of ``sequence`` lies."""
    return out / f"{sequence}{SUFFIX}"


def estimates_in(folder: Path) -> tuple[Path, ...]:
    """Estimate files of a folder, or the file itself.

    Raises
    ------
    InputError
        Where there is none.
    """
    if folder.is_file():
        return (folder,)
    found = tuple(sorted(folder.glob(f"*{SUFFIX}"))) if folder.is_dir() else ()
    if not folder.exists():
        raise InputError(f"{folder}: there is no such file or folder.")
    if not found:
        raise InputError(f"{folder}: expected estimates (*{SUFFIX}), got none.")
    return found
