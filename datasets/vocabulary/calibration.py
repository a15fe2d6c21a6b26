"""Calibrated cameras with the covariance of all their parameters, and how it was checked."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import HsvCamera

Array = NDArray[np.float64]

LENS = ("fx_px", "fy_px", "cx_px", "cy_px", "k1", "k2", "p1", "p2", "k3")
POSE = ("rx_rad", "ry_rad", "rz_rad", "tx_m", "ty_m", "tz_m")
"""Of a camera: its lens; its pose, turned by a small vector in its own frame after ``R_cam_world``, then ``t_cam_world``."""


def parameter_names(cameras: int) -> tuple[str, ...]:
    """Names of all parameters of so many cameras; the first one has no pose, since its frame is the world."""
    return tuple(f"{c}.{name}" for c in range(cameras) for name in (*LENS, *(POSE if c else ())))


@dataclass(frozen=True)
class CrossValidation:
    """Two halves of the pictures fitted apart.

    ``chi_square``: of the difference of the two, by both their covariances; ``degrees_of_freedom``: expected of it. ``p_value``: of one as
    large or larger by chance. ``honest``: whether the stated uncertainty stands. ``factor``: by which standard deviations were widened.
    """

    chi_square: float
    degrees_of_freedom: int
    p_value: float
    honest: bool
    factor: float


@dataclass(frozen=True)
class CalibrationFit:
    """How the pictures were fitted: RMS residual (px, of one coordinate), corners, pictures, corners left out, and the check by halves."""

    rms_px: float
    corners: int
    pictures: int
    left_out: int
    cross_validation: CrossValidation | None = None


@dataclass(frozen=True)
class Calibration:
    """Cameras in the first one's frame, the covariance of what is known of them, and gravity where it was measured.

    ``covariance`` (p, p) is that of :func:`parameter_names`; ``None`` where nobody stated one (a rig read from others' files).
    ``gravity_world`` (3,) m/s2 with ``gravity_covariance`` (3, 3). ``notes``: what is assumed, in sentences.
    """

    cameras: tuple[HsvCamera, ...] = ()
    covariance: Array | None = None
    fit: CalibrationFit | None = None
    board: str | None = None
    gravity_world: Float[NDArray[np.float64], "3"] | None = None
    gravity_covariance: Float[NDArray[np.float64], "3 3"] | None = None
    notes: tuple[str, ...] = ()

    def camera(self, number: int) -> HsvCamera:
        """One of the cameras, with the covariance of its lens."""
        if self.covariance is None:
            return self.cameras[number]
        names = parameter_names(len(self.cameras))
        rows = [names.index(f"{number}.{name}") for name in LENS]
        return replace(self.cameras[number], lens_covariance=self.covariance[np.ix_(rows, rows)])
