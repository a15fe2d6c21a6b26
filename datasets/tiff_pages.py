"""Pages of a TIFF stack: headers checked before anything is decoded, pixels decoded into at most the size that the header states.

tifffile reads the headers. A damaged or forged header is refused by its sizes alone: a page that comes twice, a picture beyond
:data:`~datasets.vocabulary.camera.LARGEST_PICTURE_PX`, strips or tiles of no size or of another number, bytes beyond the file's end,
compressed bytes that cannot become as many pixels as are stated. Decoding stops beyond the stated size
(:mod:`datasets.tiff_codecs`), so a small file cannot fill the memory.
"""

import logging
import math
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
import tifffile
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.tiff_codecs import DECODERS, JPEG, RATIOS, WORDS, jpeg
from datasets.vocabulary.camera import LARGEST_PICTURE_PX, LARGEST_SIDE_PX

GREY_TYPES = (np.dtype(np.uint8), np.dtype(np.uint16))

logging.getLogger("tifffile").addHandler(logging.NullHandler())
# What tifffile would print of a damaged file is said by the errors raised here.


@dataclass(frozen=True)
class Page:
    """One page: ``shape`` (height, width) px, and its strips or tiles of ``block`` (height, width) px, row by row.

    ``offsets`` and ``counts`` (bytes) say where each block lies; ``dtype`` has the file's byte order; ``scheme`` is TIFF's number of the
    compression; ``differenced``: each value is the difference from its left neighbour (TIFF's predictor 2).
    ``tables``: what JPEG strips have in common.
    """

    shape: tuple[int, int]
    dtype: np.dtype[np.generic]
    block: tuple[int, int]
    offsets: tuple[int, ...]
    counts: tuple[int, ...]
    scheme: int
    differenced: bool
    tables: bytes | None = None


def index(path: Path) -> tuple[Page, ...]:
    """Every page of ``path``.

    Raises
    ------
    InputError
        Naming the file and the page, where one is damaged, too large, or not grey of 8 or 16 bit.
    """
    try:
        size = path.stat().st_size
        with tifffile.TiffFile(path) as stack:
            pages = _pages(path, stack, size)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except PermissionError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    except InputError:
        raise
    except Exception as error:  # tifffile raises whatever its readers raise
        raise InputError(f"{path}: expected a TIFF stack, got a file that is cut off or of another kind ({error}).") from None
    if not pages:
        raise InputError(f"{path}: expected a TIFF stack, got one without pictures.")
    return pages


def decoded(stream: BinaryIO, page: Page) -> NDArray[np.generic]:
    """The values (height, width) of a page, in the file's type.

    Raises
    ------
    ValueError
        When a strip or tile does not have the size that the page states.
    """
    (height, width), (rows, columns) = page.shape, page.block
    across = math.ceil(width / columns)
    picture = np.empty(page.shape, page.dtype)
    for k, (offset, count) in enumerate(zip(page.offsets, page.counts, strict=True)):
        top, left = k // across * rows, k % across * columns
        tall = rows if columns != width else min(rows, height - top)  # the last strip ends with the picture, the last tile does not
        stream.seek(offset)
        values = _values(stream.read(count), page, tall)
        picture[top : top + rows, left : left + columns] = values[: height - top, : width - left]
    return picture


def _values(data: bytes, page: Page, tall: int) -> NDArray[np.generic]:
    """The values (tall, columns) of one strip or tile."""
    row = page.block[1] * page.dtype.itemsize
    least, most = tall * row, page.block[0] * row  # some programs fill the last strip up
    if page.scheme == JPEG:
        raw = jpeg(data, ((tall, page.block[1]), page.block), page.tables)
    else:
        raw = DECODERS[page.scheme](data, most)
    if not least <= len(raw) <= most:
        raise ValueError(f"expected {least} bytes in a strip or tile, got {len(raw) if len(raw) < least else 'more'}")
    values = np.frombuffer(raw, page.dtype, count=tall * page.block[1]).reshape(tall, page.block[1])
    return np.cumsum(values, axis=1, dtype=page.dtype.newbyteorder("=")) if page.differenced else values


def _pages(path: Path, stack: tifffile.TiffFile, size: int) -> tuple[Page, ...]:
    found: list[Page] = []
    seen: set[int] = set()
    for number, page in enumerate(stack.pages):
        if page.offset in seen:
            raise InputError(f"{path}: frame {number}: expected another page, got one that is there already; the file's pages are a loop.")
        seen.add(page.offset)
        found.append(_page(page, f"{path}: frame {number}", size))
    _check_end(path, stack, len(found))
    return tuple(found)


def _check_end(path: Path, stack: tifffile.TiffFile, count: int) -> None:
    """That the last page says that it is the last: where the file is cut off, tifffile finds fewer pages and goes on."""
    at = stack.pages.next_page_offset
    if at is None:
        return
    stack.filehandle.seek(at)
    width = stack.tiff.offsetsize
    if int.from_bytes(stack.filehandle.read(width), "little" if stack.byteorder == "<" else "big") != 0:
        raise InputError(f"{path}: expected another page after frame {count - 1}, got none; the file is cut off or damaged.")


def _page(page: tifffile.TiffPage, where: str, size: int) -> Page:
    _check_kind(page, where)
    height, width = page.shape
    block = (int(page.tilelength), int(page.tilewidth)) if page.is_tiled else (min(int(page.rowsperstrip), height), width)
    if min(block) < 1:
        raise InputError(f"{where}: expected strips or tiles of some size, got {block[1]} x {block[0]} px.")
    offsets, counts = tuple(map(int, page.dataoffsets)), tuple(map(int, page.databytecounts))
    expected = math.ceil(height / block[0]) * math.ceil(width / block[1])
    if not len(offsets) == len(counts) == expected:
        raise InputError(f"{where}: expected {expected} strips or tiles, got {len(offsets)} places and {len(counts)} sizes.")
    total = expected * math.prod(block)
    if total > LARGEST_PICTURE_PX:
        raise InputError(f"{where}: expected strips or tiles of at most {LARGEST_PICTURE_PX:.0e} px in all, got {total:.1e}.")
    end = max(start + count for start, count in zip(offsets, counts, strict=True))
    if end > size:
        raise InputError(f"{where} is cut off (it should end at byte {end}, the file has {size}).")
    dtype = np.dtype(page.dtype).newbyteorder(page.parent.byteorder)
    found = Page((height, width), dtype, block, offsets, counts, int(page.compression), int(page.predictor) == 2, page.jpegtables)
    _check_claim(found, where)
    return found


def _check_kind(page: tifffile.TiffPage, where: str) -> None:
    """That a page is a grey picture of a type, size and compression that is read here."""
    if page.dtype not in GREY_TYPES or len(page.shape) != 2 or page.bitspersample not in (8, 16):
        bits = f"{page.bitspersample} bit, " if page.dtype in GREY_TYPES else ""
        raise InputError(f"{where}: expected grey pictures of 16 (or 8) bit, got {bits}{page.dtype} of shape {page.shape}.")
    if page.photometric != tifffile.PHOTOMETRIC.MINISBLACK:
        name = getattr(page.photometric, "name", page.photometric)
        raise InputError(
            f"{where}: expected grey pictures in which 0 is black (MINISBLACK), got {name}; "
            "its numbers do not mean light, so convert the stack first."
        )
    if not 0 < min(page.shape) <= max(page.shape) <= LARGEST_SIDE_PX or math.prod(page.shape) > LARGEST_PICTURE_PX:
        raise InputError(
            f"{where}: expected 1 to {LARGEST_SIDE_PX} px along each side and at most {LARGEST_PICTURE_PX:.0e} px, "
            f"got {page.shape[1]} x {page.shape[0]}."
        )
    scheme = int(page.compression)
    known = scheme in DECODERS or (scheme == JPEG and page.bitspersample == 8 and int(page.predictor) == 1)
    if not known or int(page.predictor) not in (1, 2) or int(page.fillorder) != 1:
        name = getattr(page.compression, "name", page.compression)
        raise InputError(
            f"{where}: expected pictures with {WORDS}, got compression {name} with predictor "
            f"{int(page.predictor)} and fill order {int(page.fillorder)}; write the stack anew without compression."
        )


def _check_claim(page: Page, where: str) -> None:
    """That every strip or tile has enough bytes to become the pixels that are stated."""
    ratio = RATIOS[page.scheme]
    rows = page.shape[0] % page.block[0] or page.block[0] if page.block[1] == page.shape[1] else page.block[0]
    least = rows * page.block[1] * page.dtype.itemsize
    if min(page.counts) * ratio < least:
        raise InputError(
            f"{where}: expected at least {math.ceil(least / ratio)} bytes in a strip or tile of {page.block[1]} x {page.block[0]} px, "
            f"got {min(page.counts)}."
        )
