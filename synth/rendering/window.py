"""Windows of a picture: the crop around the particle that is rendered, the rest being the static background."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Window:
    """Pixels ``x0 <= u < x0 + width`` and ``y0 <= v < y0 + height``."""

    x0: int
    y0: int
    width: int
    height: int

    @property
    def slices(self) -> tuple[slice, slice]:
        """Rows and columns of the window in a picture."""
        return slice(self.y0, self.y0 + self.height), slice(self.x0, self.x0 + self.width)

    @property
    def empty(self) -> bool:
        """Whether there is no pixel in it."""
        return self.width <= 0 or self.height <= 0


def whole_picture(intrinsics: Intrinsics) -> Window:
    """The window that is the whole picture."""
    return Window(0, 0, intrinsics.width_px, intrinsics.height_px)


def window_around(points_px: Float[NDArray[np.float64], "n 2"], margin_px: float, intrinsics: Intrinsics) -> Window:
    """The smallest window with all ``points_px`` and ``margin_px`` (px) around them, cut off at the picture's edges."""
    size = np.array([intrinsics.width_px, intrinsics.height_px])
    low = np.clip(np.floor(points_px.min(axis=0) - margin_px), 0, size).astype(int)
    high = np.clip(np.ceil(points_px.max(axis=0) + margin_px) + 1, low, size).astype(int)
    return Window(int(low[0]), int(low[1]), int(high[0] - low[0]), int(high[1] - low[1]))


def pixel_grid(window: Window) -> Float[NDArray[np.float64], "n 2"]:
    """Coordinates (px) of the window's pixel centres, row by row."""
    v, u = np.mgrid[window.slices]
    return np.column_stack([u.ravel(), v.ravel()]).astype(np.float64)
