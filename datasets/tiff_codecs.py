"""The compressions of TIFF strips and tiles that are read; each stops beyond the size that a header states.

None, deflate and PackBits with Python's own means; LZW, Zstandard and JPEG with imagecodecs, which is given a buffer of the stated size and
refuses what does not fit into it.
"""

import zlib
from collections.abc import Callable

import imagecodecs
import numpy as np
import tifffile

NONE, LZW, JPEG, PACKBITS = (int(tifffile.COMPRESSION[name]) for name in ("NONE", "LZW", "JPEG", "PACKBITS"))
DEFLATE, ADOBE_DEFLATE, ZSTD = (int(tifffile.COMPRESSION[name]) for name in ("DEFLATE", "ADOBE_DEFLATE", "ZSTD"))


def _inflated(data: bytes, most: int) -> bytes:
    """Deflate data, uncompressed up to the first byte beyond ``most``."""
    try:
        return zlib.decompressobj().decompress(data, most + 1)
    except zlib.error as error:
        raise ValueError(f"expected deflate data, got damaged ones ({error})") from None


def _unpacked(data: bytes, most: int) -> bytes:
    """PackBits data, unpacked up to the run that goes beyond ``most`` bytes."""
    found, at = bytearray(), 0
    while at < len(data) - 1 and len(found) <= most:
        head = data[at]
        if head < 128:
            found += data[at + 1 : at + 2 + head]
            at += 2 + head
        elif head > 128:
            found += data[at + 1 : at + 2] * (257 - head)
            at += 2
        else:
            at += 1
    return bytes(found)


def _library(decode: Callable[..., bytes], name: str) -> Callable[[bytes, int], bytes]:
    def decoded(data: bytes, most: int) -> bytes:
        try:
            return bytes(decode(data, out=most + 1))
        except Exception as error:  # imagecodecs has an exception of its own for every codec
            raise ValueError(f"expected {name} data, got damaged ones ({error})") from None

    return decoded


DECODERS: dict[int, Callable[[bytes, int], bytes]] = {
    NONE: lambda data, most: data[:most],
    ADOBE_DEFLATE: _inflated,
    DEFLATE: _inflated,
    PACKBITS: _unpacked,
    LZW: _library(imagecodecs.lzw_decode, "LZW"),
    ZSTD: _library(imagecodecs.zstd_decode, "Zstandard"),
}
"""From the bytes of a strip or tile, and how many it may become at most, to its values' bytes."""
RATIOS = {NONE: 1, PACKBITS: 64, DEFLATE: 1032, ADOBE_DEFLATE: 1032, LZW: 4096, ZSTD: 2**17, JPEG: 1024}
"""Bytes that one compressed byte becomes at most: a deflate match of 258 bytes takes 2 bits, a PackBits run of 128 takes 2 bytes, an LZW
code of 9 bits up to 4096 bytes, a Zstandard block of 128 kB a few bytes, a JPEG block of 64 bytes at least 2 bits."""
WORDS = "no compression, or deflate, LZW, PackBits, Zstandard or JPEG (8 bit)"


def jpeg(data: bytes, shapes: tuple[tuple[int, int], ...], tables: bytes | None) -> bytes:
    """The values' bytes of a JPEG strip or tile of one of ``shapes`` (height, width); ``tables``: those that the page keeps for all.

    Raises
    ------
    ValueError
        When it is damaged or of another size.
    """
    said = ""
    for shape in shapes:
        try:
            return bytes(imagecodecs.jpeg8_decode(data, tables=tables, out=np.empty(shape, np.uint8)).tobytes())
        except Exception as error:
            said = str(error)
    raise ValueError(f"expected JPEG data, got damaged ones or of another size ({said})")
