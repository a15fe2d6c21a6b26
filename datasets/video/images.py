"""A TIFF stack, or a folder of single pictures (TIFF, PNG, BMP, PGM, JPEG) in the order of the numbers in their names.

They say how large pictures are and how many bits hold a value, but neither when they were taken nor how many of 16 bits carry signal. A
header is read before any picture is decoded, and a picture beyond the stated or the greatest size is refused.
"""

import re
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image

from datasets.errors import InputError
from datasets.tiff_codecs import JPEG as TIFF_JPEG
from datasets.tiff_pages import Page, decoded, index
from datasets.video.film import grey_of
from datasets.video.header import MOST_FRAMES, UNKNOWN_DEPTH, Header, Origin, Picture, Stated, check_size

TIFF_SUFFIXES = (".tif", ".tiff")
FORMATS = ("PNG", "BMP", "PPM", "JPEG")
SUFFIXES = (".png", ".bmp", ".pgm", ".jpg", ".jpeg")
DEEP_MODES = ("I;16", "I;16L", "I;16B", "I")
"""How Pillow calls grey of 16 bit."""
MOST_NAMED = 5
"""Jumps in pictures' names that are told by name; of further ones the number."""
LOSSY_JPEG = "JPEG changed the grey values in blocks of 8 x 8 px: outlines err alike along stretches, which no noise model knows"


@dataclass(frozen=True)
class TiffVideo:
    """The pages of a TIFF stack."""

    path: Path
    header: Header
    pages: tuple[Page, ...]

    def read(self, index: int) -> Picture:
        """Picture ``index``, (height, width) DN; see :class:`datasets.video.header.Video`."""
        return _page(self.path, self.pages[index], index)


def _page(path: Path, page: Page, number: int) -> Picture:
    try:
        with path.open("rb") as stream:
            return decoded(stream, page).astype(np.uint16, copy=False)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: frame {number} cannot be read ({error}).") from None


def read_tiff(path: Path) -> TiffVideo:
    """Open a TIFF stack, all pages of one size.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    pages = index(path)
    first = pages[0]
    for number, page in enumerate(pages):
        if page.shape != first.shape or page.dtype != first.dtype:
            raise InputError(
                f"{path}: frame {number}: expected {first.shape[1]} x {first.shape[0]} px of {first.dtype} as in frame 0, "
                f"got {page.shape[1]} x {page.shape[0]} of {page.dtype}."
            )
    lossy = LOSSY_JPEG if any(page.scheme == TIFF_JPEG for page in pages) else ""
    return TiffVideo(path, _header(path, "TIFF stack", (first.shape, first.dtype.itemsize * 8), len(pages), lossy), pages)


@dataclass(frozen=True)
class ImageFolder:
    """Pictures in files of their own, in order."""

    path: Path
    header: Header
    files: tuple[Path, ...]

    def read(self, index: int) -> Picture:
        """Picture ``index``, (height, width) DN; see :class:`datasets.video.header.Video`."""
        picture = read_image(self.files[index])
        shape = (self.header.height_px, self.header.width_px)
        if picture.shape != shape:
            raise InputError(
                f"{self.files[index]}: expected {shape[1]} x {shape[0]} px as in {self.files[0].name}, "
                f"got {picture.shape[1]} x {picture.shape[0]}."
            )
        return picture


def read_image_folder(path: Path) -> ImageFolder:
    """Open a folder of pictures; other files in it are left alone.

    Raises
    ------
    InputError
        Naming the folder or the first file, what was expected and what came.
    """
    known = (*TIFF_SUFFIXES, *SUFFIXES)
    files = sorted((file for file in path.iterdir() if file.suffix.lower() in known and file.is_file()), key=in_order)
    kinds = sorted({file.suffix.lower() for file in files})
    if len(kinds) != 1:
        raise InputError(f"{path}: expected pictures of one kind ({', '.join(known)}), got {' and '.join(kinds) or 'none'}.")
    if len(files) > MOST_FRAMES:
        raise InputError(f"{path}: expected at most {MOST_FRAMES} pictures, got {len(files)}.")
    size = image_size(files[0])
    lossy = LOSSY_JPEG if kinds[0] in (".jpg", ".jpeg") else ""
    header = _header(path, f"folder of {kinds[0]}", size, len(files), lossy)
    return ImageFolder(path, replace(header, remark=_gaps(files)), tuple(files))


def _gaps(files: Sequence[Path]) -> str:
    """Where the last numbers in the names jump though they rise evenly elsewhere; empty where they do not."""
    numbers = np.array([next((int(n) for n in reversed(re.findall(r"[0-9]{1,18}", file.stem))), -1) for file in files])
    steps = np.diff(numbers)
    if len(steps) == 0 or (steps == steps.min()).all() or steps.min() < 1:
        return ""
    jumps = np.flatnonzero(steps > steps.min())
    named = [f"from {files[k].name} to {files[k + 1].name}" for k in jumps[:MOST_NAMED]]
    more = f" and at {len(jumps) - MOST_NAMED} further places" if len(jumps) > MOST_NAMED else ""
    return (
        f"the names jump {', '.join(named)}{more}: pictures are missing there, and times are counted as if none were; "
        "take what lies between two jumps with --frames"
    )


def in_order(file: Path) -> tuple[tuple[str, int], ...]:
    """A key that sorts ``frame_2`` before ``frame_10``."""
    pieces = re.findall(r"([^0-9]*)([0-9]{0,18})", file.name)
    return tuple((text, int(number or 0)) for text, number in pieces)


def read_image(path: Path) -> Picture:
    """One grey picture (height, width) DN of a file of any of these kinds; colours become luma.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    if path.suffix.lower() in TIFF_SUFFIXES:
        pages = index(path)
        if len(pages) > 1:
            raise InputError(
                f"{path}: expected a TIFF of one picture in a folder of pictures, got a stack of {len(pages)}; import it by its name."
            )
        return _page(path, pages[0], 0)
    with _opened(path) as image:
        values = np.asarray(image if image.mode in DEEP_MODES else image.convert("L" if image.mode in ("1", "L") else "RGB"))
        largest = _largest_of_pgm(path)
        if largest is not None:  # Pillow stretches values to 16 bit
            values = np.rint(values * (largest / 65535.0))
        return grey_of(values[..., ::-1] if values.ndim == 3 else values)


def image_size(path: Path) -> tuple[tuple[int, int], int]:
    """Height and width (px), and the bits that hold a value, from a file's header alone."""
    if path.suffix.lower() in TIFF_SUFFIXES:
        page = index(path)[0]
        return (page.shape[0], page.shape[1]), page.dtype.itemsize * 8
    with _opened(path) as image:
        return (image.height, image.width), 16 if image.mode in DEEP_MODES else 8


@contextmanager
def _opened(path: Path) -> Iterator[Image.Image]:
    """The file's header, its size checked before anything is decoded; what Pillow raises inside becomes an error that names the file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of large pictures, which are refused here
            with Image.open(path, formats=FORMATS) as image:
                check_size(path, image.width, image.height, 1)
                _check_png(path)
                yield image
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file.") from None
    except PermissionError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    except InputError:
        raise
    except Exception as error:  # Pillow raises whatever its readers raise
        kinds = ", ".join(FORMATS)
        raise InputError(f"{path}: expected a picture ({kinds}), got a file that is damaged or of another kind ({error}).") from None


def _head(path: Path) -> bytes:
    """The first bytes of a file, more than the headers of these kinds take."""
    with path.open("rb") as stream:
        return stream.read(1024)


def _check_png(path: Path) -> None:
    """Refuse PNG in colours of 16 bit, of which Pillow would keep 8 without a word."""
    head = _head(path)
    if head.startswith(b"\x89PNG") and len(head) > 25 and head[24] == 16 and head[25] != 0:
        raise InputError(f"{path}: expected grey of 8 or 16 bit, or colours of 8 bit, got colours of 16 bit; save it as grey.")


def _largest_of_pgm(path: Path) -> int | None:
    """The largest value that a binary PGM states where that is more than a byte's; ``None`` for other files."""
    found = re.match(rb"P5\s+(?:#[^\n]*\n\s*)*[0-9]+\s+(?:#[^\n]*\n\s*)*[0-9]+\s+(?:#[^\n]*\n\s*)*([0-9]{1,5})\s", _head(path))
    largest = 0 if found is None else int(found[1])
    return largest if largest > 255 else None


def _header(path: Path, kind: str, size: tuple[tuple[int, int], int], count: int, lossy: str) -> Header:
    (height, width), bits = size
    check_size(path, width, height, count)
    depth = Stated(8, Origin.READ, "8 bit") if bits == 8 else Stated(16, Origin.ASSUMED, UNKNOWN_DEPTH)
    return Header(kind=f"{kind}, {bits} bit", width_px=width, height_px=height, count=count, bit_depth=depth, lossy=lossy)
