"""Files appear whole or not at all: written under a temporary name beside the target, then renamed.

A rename within one folder is atomic on POSIX and on Windows (``os.replace``), so a reader, a crash or Ctrl-C never sees half a
file. A disk that is full (or any other :class:`OSError`) ends in a :class:`~datasets.errors.TumbleError` that says what to do, and
the temporary file is removed.
"""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from datasets.errors import TumbleError

_FULL = (errno.ENOSPC, errno.EDQUOT)


def temporary_beside(path: Path) -> Path:
    """A hidden name in the same folder, unique to this process of this machine, for a file on its way to ``path``."""
    return path.with_name(f".{path.name}.{os.uname().nodename}-{os.getpid()}.partial")


def write_failure(path: Path, error: OSError) -> TumbleError:
    """The error to raise when ``path`` could not be written."""
    if error.errno in _FULL:
        return TumbleError(
            f"{path}: the disk is full; nothing was left half written. Free some space or choose another --out, then go on with --resume."
        )
    return TumbleError(f"{path}: cannot be written ({error.strerror or error}). Check the folder's permissions, or choose another --out.")


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Hand out a temporary path to write to; rename it to ``path`` when the block ends well, remove it otherwise.

    Raises
    ------
    TumbleError
        When writing fails, for instance on a full disk.
    """
    temporary = temporary_beside(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise write_failure(path, error) from error
    finally:
        temporary.unlink(missing_ok=True)
