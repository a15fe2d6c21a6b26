"""AVI, MP4 and MOV films, decoded by OpenCV's FFmpeg: FFV1 and other grey films as they are, all others turned to grey of 8 bit.

Grey of 8 and 16 bit comes through to the bit (FFV1, raw, HuffYUV). Anything else (MJPEG, H.264, ...) was compressed with loss or has
colours; it is read as luma of 8 bit, and the header says what that costs. The frame rate of a film is that of its playback, not the
camera's (and FFmpeg tells no more than 600 Hz of an AVI), so it is shown, and the camera's has to be stated. Pictures are decoded one
after the other; going back begins anew. Damage within a picture goes unnoticed, as in formats without compression: FFmpeg conceals it.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import cv2
import numpy as np

from datasets.errors import InputError
from datasets.video.header import FASTEST_HZ, UNKNOWN_DEPTH, Header, Origin, Picture, Stated, check_size

os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
# Read when the first film is opened: what FFmpeg would print of a damaged one is said by the errors raised here.

SUFFIXES = (".avi", ".mp4", ".mov", ".mkv")
GREY = {"Y800": 8, "Y8  ": 8, "GREY": 8, "Y1\x00\x10": 16}
"""Pixel formats that OpenCV hands through unchanged, and their bits."""
DEEP = {"Y1\x00\x09": 9, "Y1\x00\x0a": 10, "Y1\x00\x0c": 12, "Y1\x00\x0e": 14}
"""Grey of other depths: OpenCV would cut them to 8 bit."""
LOSSLESS = ("ffv1", "hfyu", "ffvh", "png", "dib", "raw")
LOSSY = (
    "{codec}: compression and 8 bit changed the grey values. In a trial outlines were off by 0.04 px RMS (MJPEG) to 0.05 px (MPEG-4, alike "
    "in neighbouring frames), which no noise model knows; 8 bit alone cost 0.004 px. Use the camera's own file where there is one"
)
"""Measured by ``python -m scripts.trials.study_lossy_films`` on pictures of high contrast."""
COLOURED = "{codec}: colours or another kind of grey were turned to grey of 8 bit; nothing else was lost"


@dataclass(frozen=True)
class Film:
    """The pictures of a film. ``grey``: decoded unchanged."""

    path: Path
    header: Header
    grey: bool
    _state: "_Decoder" = field(repr=False, compare=False)

    def read(self, index: int) -> Picture:
        """Picture ``index``, (height, width) DN; see :class:`datasets.video.header.Video`."""
        picture = self._state.picture(index)
        if picture is None or picture.shape[:2] != (self.header.height_px, self.header.width_px):
            raise InputError(f"{self.path}: frame {index}: expected a picture, got none; the film is cut off or states too many.")
        return grey_of(picture)


class _Decoder:
    """A film being decoded: the one state is where it is."""

    def __init__(self, path: Path, convert: bool) -> None:
        self.path, self.convert = path, convert
        self.at = 0
        self.capture: cv2.VideoCapture | None = None

    def picture(self, index: int) -> np.ndarray | None:
        """Picture ``index`` as decoded, or ``None`` where there is none."""
        with _silent():
            capture = self.capture if self.capture is not None and index >= self.at else _open(self.path, convert=self.convert)
            self.at = self.at if capture is self.capture else 0
            self.capture = capture
            while self.at < index:
                if not capture.grab():
                    return None
                self.at += 1
            found, picture = capture.read()
            self.at += 1
        return picture if found else None

    def __getstate__(self) -> dict[str, object]:
        return {"path": self.path, "convert": self.convert, "at": 0, "capture": None}


def grey_of(picture: np.ndarray) -> Picture:
    """A picture (height, width) or (height, width, 3; blue, green, red) as grey of 16 bit values; grey stored as colours stays exact."""
    if picture.ndim == 3 and picture.shape[2] == 1:
        picture = picture[..., 0]
    if picture.ndim == 3:
        colours = picture[..., :3]
        same = bool((colours[..., 0] == colours[..., 1]).all() and (colours[..., 1] == colours[..., 2]).all())
        picture = colours[..., 0] if same else cv2.cvtColor(np.ascontiguousarray(colours), cv2.COLOR_BGR2GRAY)
    return picture.astype(np.uint16)


def read_film(path: Path) -> Film:
    """Open a film.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    if not path.is_file():
        raise InputError(f"{path}: there is no such file.")
    with _silent():
        capture = _open(path, convert=False)
        tell = capture.get
        width, height = int(tell(cv2.CAP_PROP_FRAME_WIDTH)), int(tell(cv2.CAP_PROP_FRAME_HEIGHT))
        count, rate = tell(cv2.CAP_PROP_FRAME_COUNT), tell(cv2.CAP_PROP_FPS)
        pixels, codec = (_four(tell(key)) for key in (cv2.CAP_PROP_CODEC_PIXEL_FORMAT, cv2.CAP_PROP_FOURCC))
        capture.release()
    if not 0 < count < 1e9:
        raise InputError(f"{path}: expected a film that says how many pictures it has, got {count:g}; it is cut off or damaged.")
    check_size(path, width, height, int(count))
    if pixels in DEEP:
        raise InputError(
            f"{path}: expected grey of 8 or 16 bit, got {DEEP[pixels]} bit, which would be cut to 8. "
            f"Convert it without loss first: ffmpeg -i {path.name} -pix_fmt gray16le -c:v ffv1 {path.stem}_16.avi"
        )
    bits = GREY.get(pixels)
    header = Header(
        kind=f"film, {codec.strip()}",
        width_px=width,
        height_px=height,
        count=int(count),
        bit_depth=_depth(bits),
        playback_hz=rate if 0 < rate <= FASTEST_HZ else None,
        lossy="" if bits else _lost(codec.strip("\0 ")),
    )
    return Film(path, header, bits is not None, _Decoder(path, bits is None))


def _lost(codec: str) -> str:
    kind = COLOURED if codec.lower() in LOSSLESS or not codec else LOSSY
    return kind.format(codec=codec or "raw film")


def _depth(bits: int | None) -> Stated[int]:
    if bits == 16:
        return Stated(16, Origin.ASSUMED, UNKNOWN_DEPTH)
    return Stated(8, Origin.READ, "pixel format" if bits else "colours or luma, turned to grey of 8 bit")


def _open(path: Path, *, convert: bool) -> cv2.VideoCapture:
    options = [cv2.CAP_PROP_CONVERT_RGB, int(convert), cv2.CAP_PROP_N_THREADS, 1]
    try:
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG, options)
    except cv2.error as error:
        raise InputError(f"{path}: expected a film that can be decoded, got one that cannot ({error.err}).") from None
    if not capture.isOpened():
        raise InputError(f"{path}: expected a film (AVI, MP4, MOV, MKV), got a file that is damaged or of another kind.")
    return capture


def _four(code: float) -> str:
    return int(code).to_bytes(8, "little", signed=True)[:4].decode("latin-1") if abs(code) < 2**62 else ""


@contextmanager
def _silent() -> Iterator[None]:
    """What OpenCV would print of a damaged film is said by the errors raised here."""
    before = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    finally:
        cv2.utils.logging.setLogLevel(before)
