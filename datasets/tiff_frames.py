"""Pictures in TIFF stacks: written page by page, read lazily page by page, so that memory does not grow with the recording.

One page per picture, grey, 16 bit (8 bit is read too), BigTIFF when written. Pages are indexed and checked once; each read opens the
file, so that nothing stays open and a reader may be sent to another process. Backgrounds are stacks of their own.
"""

import contextlib
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
import tifffile
from numpy.typing import NDArray

from datasets.atomic_files import temporary_beside, write_failure
from datasets.errors import InputError
from datasets.tiff_pages import Page, decoded, index

Picture = NDArray[np.uint16]


@dataclass(frozen=True)
class TiffFrames:
    """Pictures of a TIFF stack; implements :class:`datasets.observation.Frames`.

    Parameters
    ----------
    path
        The stack, one page per picture.
    bit_depth
        Bits that carry signal.
    background_path
        A stack of backgrounds, or ``None``.
    background_pages
        Which page of the backgrounds belongs to each picture; ``None``: the first page to all.
    """

    path: Path
    bit_depth: int
    background_path: Path | None = None
    background_pages: tuple[int, ...] | None = None

    @cached_property
    def _pages(self) -> tuple[Page, ...]:
        return index(self.path)

    @cached_property
    def _backgrounds(self) -> tuple[Page, ...]:
        return index(self.background_path) if self.background_path is not None else ()

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width (px) of the pictures."""
        height, width = self._pages[0].shape
        return height, width

    def __len__(self) -> int:
        return len(self._pages)

    def read(self, index: int) -> Picture:
        """Picture ``index``, (height, width).

        Raises
        ------
        InputError
            When the page is cut off, or has values beyond the bit depth.
        """
        return _read(self.path, self._pages, index, self.bit_depth)

    def background(self) -> Picture | None:
        """The first background, (height, width), or ``None``."""
        return _read(self.background_path, self._backgrounds, 0, self.bit_depth) if self.background_path is not None else None

    def background_of(self, index: int) -> Picture | None:
        """The background that belongs to picture ``index``, (height, width), or ``None``."""
        if self.background_path is None or self.background_pages is None:
            return self.background()
        return _read(self.background_path, self._backgrounds, self.background_pages[index], self.bit_depth)

    def check(self, count: int, width_px: int, height_px: int, what: str) -> None:
        """Compare the stack's number of pictures and their size with what ``what`` (a sentence's subject) expects.

        Raises
        ------
        InputError
            Naming the file, what was expected and what came.
        """
        if len(self) != count:
            missing = f"; frame {len(self)} and later are missing" if len(self) < count else ""
            raise InputError(f"{self.path}: expected {count} frames ({what}), got {len(self)}{missing}.")
        self._check_size(self.path, self._pages, (height_px, width_px), what)
        if self.background_path is not None:
            self._check_size(self.background_path, self._backgrounds, (height_px, width_px), what)
            highest = max(self.background_pages, default=0) if self.background_pages is not None else 0
            if highest >= len(self._backgrounds):
                raise InputError(f"{self.background_path}: expected at least {highest + 1} pages, got {len(self._backgrounds)}.")

    @staticmethod
    def _check_size(path: Path, pages: tuple[Page, ...], shape: tuple[int, int], what: str) -> None:
        for number, page in enumerate(pages):
            if page.shape != shape:
                height, width = page.shape
                raise InputError(
                    f"{path}: frame {number}: expected {shape[1]} x {shape[0]} px (width x height; {what}), got {width} x {height}."
                )


class FrameStackWriter:
    """Append pictures to a TIFF stack one at a time; the file appears under its name only when :meth:`close` was reached.

    Used as a context manager: leaving the block well closes the stack, leaving it by an exception removes what was written.
    ``compression`` is a scheme of TIFF that loses nothing (``zlib``; worth it for masks, not for noisy pictures), or ``None``.
    """

    def __init__(self, path: Path, *, compression: str | None = None) -> None:
        self.path = path
        self._compression = compression
        self._temporary = temporary_beside(path)
        self._count = 0
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._writer = tifffile.TiffWriter(self._temporary, bigtiff=True)
        except OSError as error:
            raise write_failure(path, error) from error

    def append(self, picture: Picture) -> None:
        """Append one picture (height, width) of 16-bit values.

        Raises
        ------
        TumbleError
            When it cannot be written, for instance on a full disk; nothing is left half written.
        """
        if picture.dtype != np.uint16 or picture.ndim != 2:
            raise TypeError(f"expected a (height, width) array of uint16, got {picture.dtype} {picture.shape}")
        try:
            self._writer.write(
                picture, photometric="minisblack", metadata=None, software=False, contiguous=False, compression=self._compression
            )
        except OSError as error:
            self.discard()
            raise write_failure(self.path, error) from error
        self._count += 1

    def close(self) -> None:
        """Finish the stack and give it its name."""
        try:
            self._writer.close()
            self._temporary.replace(self.path)
        except OSError as error:
            self.discard()
            raise write_failure(self.path, error) from error

    def discard(self) -> None:
        """Remove what was written so far."""
        with contextlib.suppress(OSError):
            self._writer.close()
        self._temporary.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if kind is None:
            self.close()
        else:
            self.discard()


def write_stack(path: Path, pictures: list[Picture]) -> None:
    """Write a small stack at once, for instance the backgrounds of the rig's cameras."""
    with FrameStackWriter(path) as writer:
        for picture in pictures:
            writer.append(picture)


def _read(path: Path, pages: tuple[Page, ...], number: int, bit_depth: int) -> Picture:
    """One page as 16-bit values, its range checked against the bit depth."""
    page, number = pages[number], number % len(pages)
    try:
        with path.open("rb") as stream:
            picture: Picture = decoded(stream, page).astype(np.uint16, copy=False)
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: frame {number} cannot be read ({error}).") from error
    if picture.size and int(picture.max()) >= 1 << bit_depth:
        raise InputError(
            f"{path}: frame {number}: expected values of {bit_depth} bit (at most {(1 << bit_depth) - 1}), got {int(picture.max())}; "
            "state the right bit_depth, or shift left-aligned values down."
        )
    return picture
