"""Numbers in MATLAB's files of version 5 to 7 [MAT-File Format, MathWorks]: variables of doubles or singles, and cell arrays of such.

A reader of our own: SciPy's ends the process on some damaged files. A file is elements of a type, a size and data; compressed ones hold one
more element. Everything is checked against the bytes that are there before it is used.
"""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError

Array = NDArray[np.float64]

HEADER_BYTES = 128
MATRIX, COMPRESSED = 14, 15
CELL, DOUBLE, SINGLE = 1, 6, 7
COMPLEX = 0x0800
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
LARGEST_INFLATED = 2**24
"""Bytes of one variable: a rig takes kilobytes."""
LONGEST_NAME = 63


def read_matlab(path: Path, data: bytes) -> dict[str, list[Array]]:
    """Of every variable its array, of a cell array the arrays in it (column by column); others are left out.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    mark = data[126:128]
    if len(data) < HEADER_BYTES or mark not in (b"IM", b"MI"):
        raise InputError(f"{path}: expected a MATLAB file of version 5 to 7 (save with -v7), got another kind.")
    order = "<" if mark == b"IM" else ">"
    found: dict[str, list[Array]] = {}
    try:
        for kind, content in _inflated(data[HEADER_BYTES:], order):
            if kind == MATRIX:
                name, arrays = _matrix(content, order)
                if arrays:
                    found[name] = arrays
    except (struct.error, zlib.error, RuntimeError, ValueError, RecursionError, KeyError, IndexError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a MATLAB file, got one that is damaged ({type(error).__name__}: {error}).") from None
    return found


def _inflated(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """The same as :func:`_elements`, with what compressed ones hold in their place."""
    for kind, content in _elements(data, order):
        if kind == COMPRESSED:
            yield next(_elements(zlib.decompressobj().decompress(content, LARGEST_INFLATED), order))
        else:
            yield kind, content


def _elements(data: bytes, order: str) -> Iterator[tuple[int, bytes]]:
    """Type and content of the elements one after the other."""
    at = 0
    while at + 8 <= len(data):
        kind, size = struct.unpack_from(f"{order}II", data, at)
        if kind >> 16:  # up to four bytes stand in the tag itself
            kind, size, start, step = kind & 0xFFFF, kind >> 16, at + 4, 8
            if size > 4:
                raise ValueError(f"expected at most 4 bytes in a small element, got {size}")
        else:
            start, step = at + 8, 8 + (size if kind == COMPRESSED else -(-size // 8) * 8)
        if start + size > len(data):
            raise ValueError(f"expected {size} bytes, got {len(data) - start}")
        yield kind, data[start : start + size]
        at += step


def _matrix(content: bytes, order: str) -> tuple[str, list[Array]]:
    """Name and arrays of a matrix; no arrays where it is of a kind that is left out."""
    parts = list(_elements(content, order))
    if len(parts) < 3:
        return "", []
    (flags,) = struct.unpack_from(f"{order}I", parts[0][1])
    shape = tuple(np.frombuffer(parts[1][1], f"{order}i4").tolist())
    name = parts[2][1][:LONGEST_NAME].decode("latin-1")
    if flags & 0xFF == CELL:
        inner = [_matrix(part, order)[1] for kind, part in parts[3:] if kind == MATRIX]
        return name, [arrays[0] for arrays in inner if len(arrays) == 1]
    if flags & 0xFF not in (DOUBLE, SINGLE) or flags & COMPLEX or len(parts) < 4:
        return name, []
    values = np.frombuffer(parts[3][1], f"{order}{NUMBERS[parts[3][0]]}").astype(np.float64)
    if not 2 <= len(shape) <= 3 or min(shape) < 0:
        return name, []
    return name, [values.reshape(shape, order="F")]
