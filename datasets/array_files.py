"""Named arrays in ``.npz`` files: an array is read only when its member of the archive has the size that its header states.

A zip archive may hold a few bytes that become gigabytes, an array's header may state any shape; both are compared, and bounded by
:data:`LARGEST_ARRAY_BYTES`, before memory is taken.
"""

import math
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from datasets.atomic_files import written_whole
from datasets.errors import InputError

LARGEST_ARRAY_BYTES = 2**28
"""16 million points of outlines: ten thousand pictures with 1600 points each."""
_HEADERS = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}


def write_arrays(path: Path, arrays: Mapping[str, NDArray[np.generic]]) -> None:
    """Write named arrays as ``.npz``; the same arrays give the same bytes."""
    with written_whole(path) as temporary, temporary.open("wb") as stream:
        np.savez(stream, allow_pickle=False, **arrays)


def read_arrays(path: Path, names: Sequence[str]) -> dict[str, NDArray[np.generic]]:
    """The named arrays of an ``.npz`` file.

    Raises
    ------
    InputError
        When it is missing, cut off, of another kind, too large, or lacks one of the arrays.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            absent = [name for name in names if f"{name}.npy" not in archive.namelist()]
            if absent:
                raise InputError(f"{path}: expected the arrays {', '.join(names)}, got without {', '.join(absent)}.")
            return {name: _array(archive, name, path) for name in names}
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except InputError:
        raise
    except Exception as error:  # zipfile, zlib and NumPy raise whatever their readers raise
        raise InputError(f"{path}: expected an .npz file, got one that is cut off or of another kind ({error}).") from None


def _array(archive: zipfile.ZipFile, name: str, path: Path) -> NDArray[np.generic]:
    """One array, its sizes compared with those that its header states before it is read."""
    size = archive.getinfo(f"{name}.npy").file_size
    if size > LARGEST_ARRAY_BYTES:
        raise InputError(f"{path}: {name}: expected an array of at most {LARGEST_ARRAY_BYTES} bytes, got {size}.")
    with archive.open(f"{name}.npy") as stream:
        version = npy.read_magic(stream)
        if version not in _HEADERS:
            raise InputError(f"{path}: {name}: expected an array in version 1 or 2 of NumPy's format, got {version[0]}.{version[1]}.")
        shape, _, dtype = _HEADERS[version](stream)
        stated, held = math.prod(shape) * dtype.itemsize, size - stream.tell()
    if dtype.kind not in "fiu":
        raise InputError(f"{path}: {name}: expected numbers, got {dtype} of shape {shape}.")
    if stated != held:
        raise InputError(f"{path}: {name}: expected {stated} bytes for {dtype} of shape {shape}, got {held}.")
    with archive.open(f"{name}.npy") as stream:
        return np.asarray(npy.read_array(stream, allow_pickle=False))
