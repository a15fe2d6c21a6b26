"""Numbers of a page in little room: 16-bit integers, little-endian, as base64. The page's script unpacks them when they are shown."""

import base64
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tumble.reports.pictures import Window

FINE = 8192
"""Steps per side of the window: 0.01 px of a window of 80 px. Three windows to either side still fit 16 bits."""
DISTANCE_STEPS = 500
"""Steps per pixel of a signed distance, which reaches to 65 px."""
LARGEST = 32767


def packed(values: NDArray[Any]) -> str:
    """Integers as 16-bit ones; what is larger is cut off at the largest."""
    whole = np.clip(np.round(np.ravel(values)), -LARGEST, LARGEST).astype("<i2")
    return base64.b64encode(whole.tobytes()).decode("ascii")


def packed_points(points_px: NDArray[np.float64], window: Window) -> str:
    """Points (n, 2) px as shares of a window, from its first pixel's centre, in steps of 1 / ``FINE``."""
    return packed((points_px - [window.x_px, window.y_px]) * (FINE / window.side_px))
