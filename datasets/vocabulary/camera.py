"""The pinhole camera with Brown-Conrady distortion.

``x = X/Z, y = Y/Z``; ``r² = x² + y²``; ``x_d = x(1 + k1 r² + k2 r⁴ + k3 r⁶) + 2 p1 x y + p2 (r² + 2x²)`` (``y`` alike);
``u = fx x_d + cx``. [Brown 1971; the OpenCV calibration model]. Valid for moderate distortion, where the map is one to one.
"""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Array = NDArray[np.float64]

LARGEST_SIDE_PX = 65_536
LARGEST_PICTURE_PX = 10**8
"""Pixels of a picture at most, along a side and in all: four times what high-speed cameras have, and 600 MB while it is read."""


@dataclass(frozen=True)
class Intrinsics:
    """Image size, focal lengths and principal point in pixels, distortion (k1, k2, p1, p2, k3).

    The first pixel's centre is (0, 0). ``pixel_pitch_m`` (m) is ``None`` where the maker does not say.
    """

    width_px: int
    height_px: int
    fx_px: float
    fy_px: float
    cx_px: float
    cy_px: float
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)
    pixel_pitch_m: float | None = None

    @property
    def K(self) -> Float[NDArray[np.float64], "3 3"]:
        """The calibration matrix (px)."""
        return np.array([[self.fx_px, 0.0, self.cx_px], [0.0, self.fy_px, self.cy_px], [0.0, 0.0, 1.0]])

    @property
    def numbers(self) -> Float[NDArray[np.float64], "9"]:
        """fx, fy, cx, cy (px), k1, k2, p1, p2, k3."""
        return np.array([self.fx_px, self.fy_px, self.cx_px, self.cy_px, *self.distortion])

    def with_numbers(self, numbers: Float[NDArray[np.float64], "9"]) -> "Intrinsics":
        """The same picture through the lens of other :attr:`numbers`."""
        fx, fy, cx, cy, k1, k2, p1, p2, k3 = map(float, numbers)
        return replace(self, fx_px=fx, fy_px=fy, cx_px=cx, cy_px=cy, distortion=(k1, k2, p1, p2, k3))

    def project(self, points_cam: Float[NDArray[np.float64], "n 3"]) -> Float[NDArray[np.float64], "n 2"]:
        """Pixel coordinates (px) of points in camera coordinates (m), distortion included."""
        xy = points_cam[:, :2] / points_cam[:, 2:]
        return self.distort(xy)

    def distort(self, xy: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "n 2"]:
        """Pixel coordinates (px) of ideal normalised image coordinates."""
        x, y = xy[:, 0], xy[:, 1]
        if not any(self.distortion):
            return np.column_stack([self.fx_px * x + self.cx_px, self.fy_px * y + self.cy_px])
        k1, k2, p1, p2, k3 = self.distortion
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        x_d = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
        y_d = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
        return np.column_stack([self.fx_px * x_d + self.cx_px, self.fy_px * y_d + self.cy_px])

    def normalise(self, points_px: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], "n 2"]:
        """Ideal normalised image coordinates of pixels (px), distortion removed (OpenCV's iteration)."""
        if not any(self.distortion):
            return np.column_stack([(points_px[:, 0] - self.cx_px) / self.fx_px, (points_px[:, 1] - self.cy_px) / self.fy_px])
        criteria = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 50, 1e-12)
        distorted = np.ascontiguousarray(points_px, dtype=np.float64)[:, None, :]
        xy = cv2.undistortPoints(distorted, self.K, np.array(self.distortion), criteria=criteria)
        return np.asarray(xy, dtype=np.float64).reshape(-1, 2)


@dataclass(frozen=True)
class HsvCamera:
    """A high-speed video camera; ``R_cam_world`` (3, 3), ``t_cam_world`` (3,) m map world to camera coordinates.

    ``lens_covariance`` (9, 9): that of fx, fy, cx, cy (px), k1, k2, p1, p2, k3, where its calibration states one.
    """

    name: str
    intrinsics: Intrinsics
    R_cam_world: Array
    t_cam_world: Array
    lens_covariance: Array | None = None
