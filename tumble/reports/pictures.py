"""Pictures of a report: square crops that follow the particle, small enough to embed."""

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from datasets.observation import Frames
from datasets.vocabulary.camera import Intrinsics

Array = NDArray[np.float64]
LARGEST_PX = 256
MARGIN = 1.35
EXACT_UP_TO_PX = 128
"""Side of a crop that is kept without loss: its pixels are so large on the screen that losses would show as steps between blocks."""
QUALITY = 98
"""Of larger ones, as WebP, which every browser since 2020 shows: 15 kB of a noisy picture of 256 × 256 pixels, within a grey level."""


@dataclass(frozen=True)
class Window:
    """A square of the picture: its first pixel's corner (px) and its side (px)."""

    x_px: int
    y_px: int
    side_px: int


def follow(outlines: Sequence[Array | None], intrinsics: Intrinsics) -> list[Window]:
    """One window per frame, all of one size, centred on the outline; the whole picture where there is none."""
    whole = Window(0, 0, max(intrinsics.width_px, intrinsics.height_px))
    extents = [np.ptp(points, axis=0).max() for points in outlines if points is not None and len(points)]
    if not extents:
        return [whole] * len(outlines)
    side = min(int(np.ceil(MARGIN * max(extents))) + 8, whole.side_px)
    return [whole if points is None or not len(points) else _centred(points, side) for points in outlines]


def _centred(points: Array, side: int) -> Window:
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    x, y = (round(float(value - 0.5 * side)) for value in middle)
    return Window(x, y, side)


def crop_uri(frames: Frames, index: int, window: Window) -> str:
    """The crop of a frame as an embedded WebP, 8 bit, at most ``LARGEST_PX`` a side; grey outside the picture."""
    picture = frames.read(index)
    full_scale = float(2**frames.bit_depth - 1)
    canvas = np.full((window.side_px, window.side_px), 128, dtype=np.uint8)
    height, width = picture.shape
    x0, y0 = max(window.x_px, 0), max(window.y_px, 0)
    x1, y1 = min(window.x_px + window.side_px, width), min(window.y_px + window.side_px, height)
    if x1 > x0 and y1 > y0:
        part = np.clip(picture[y0:y1, x0:x1] * (255.0 / full_scale), 0, 255).astype(np.uint8)
        canvas[y0 - window.y_px : y1 - window.y_px, x0 - window.x_px : x1 - window.x_px] = part
    return _webp(canvas)


def _webp(grey: NDArray[np.uint8]) -> str:
    image = Image.fromarray(grey)
    if max(image.size) > LARGEST_PX:
        image = image.resize((LARGEST_PX, LARGEST_PX), Image.Resampling.BOX)
    stream = io.BytesIO()
    image.save(stream, format="WEBP", lossless=max(image.size) <= EXACT_UP_TO_PX, quality=QUALITY)
    return "data:image/webp;base64," + base64.b64encode(stream.getvalue()).decode("ascii")
