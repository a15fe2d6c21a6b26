"""Pixels of 10 and 12 bit that lie without gaps in a file, the most significant bits first.

Phantom and Photron cameras alike: four pixels of 10 bit in five bytes, two of 12 bit in three.
"""

import numpy as np
from numpy.typing import NDArray

Pixels = NDArray[np.uint16]
Bytes = NDArray[np.uint8]
GROUPS = {10: (4, 5), 12: (2, 3)}
"""Of a number of bits the pixels and the bytes of the smallest whole group."""


def packed_size(pixels: int, bits: int) -> int:
    """Bytes that ``pixels`` values of ``bits`` take, a last group that is not full counted whole."""
    pixels_in_group, bytes_in_group = GROUPS[bits]
    return -(-pixels // pixels_in_group) * bytes_in_group


def unpacked(data: Bytes, pixels: int, bits: int) -> Pixels:
    """The first ``pixels`` values of ``bits`` (10 or 12) in ``data``, whose size is :func:`packed_size`."""
    in_group, size = GROUPS[bits]
    groups = data.reshape(-1, size)
    found = np.empty((len(groups), in_group), np.uint16)
    for k in range(in_group):
        byte, left = divmod(k * bits, 8)  # a value lies in two bytes: all that is left of the first, then the rest
        high = groups[:, byte].astype(np.uint16) & np.uint16(0xFF >> left)
        rest = bits - (8 - left)
        found[:, k] = high << np.uint16(rest) | groups[:, byte + 1] >> np.uint8(8 - rest)
    return found.reshape(-1)[:pixels]


def packed(values: Pixels, bits: int) -> bytes:
    """``values`` without gaps; the inverse of :func:`unpacked`, used to write recordings."""
    in_group, _ = GROUPS[bits]
    whole = np.zeros(-(-values.size // in_group) * in_group, np.uint64)
    whole[: values.size] = values.reshape(-1)
    shifts = np.arange(in_group - 1, -1, -1, dtype=np.uint64) * np.uint64(bits)
    words = (whole.reshape(-1, in_group) << shifts).sum(axis=1, dtype=np.uint64)
    size = GROUPS[bits][1]
    return words.astype(">u8").view(np.uint8).reshape(-1, 8)[:, 8 - size :].tobytes()
