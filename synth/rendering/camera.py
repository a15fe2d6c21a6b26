"""A calibrated camera as a thin lens in front of an ideal film.

The pinhole model gives the principal distance ``p = fx * pitch``; focused at ``d`` the lens has the focal length
``f = p d / (p + d)`` and at f-number ``N`` an aperture of radius ``f / (2 N)`` [Hecht, Optics, ch. 5]. Perspective is that of
the aperture's centre. The ideal film has square pixels and no distortion; where the real camera differs (distortion, unequal
focal lengths), pictures are warped (:mod:`synth.rendering.distortion`).

Not modelled: other aberrations, and diffraction. The Airy disk's radius is ``1.22 lambda N (1 + m) / pitch`` with magnification ``m``
[Hecht, ch. 10]: 0.6 px for the default high-speed camera (f/16, 20 µm, green light), but 12 px for the default rig camera (f/64, 4.65 µm).
A real lens cannot be stopped down so far and stay sharp; the rig's views stand for ones without blur of either kind.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.camera import Intrinsics

Array = NDArray[np.float64]

USUAL_PITCH_M = 4.65e-6
"""Taken where the calibration does not state a pixel pitch (a common 1024x768 industrial sensor)."""
OPENCV_TO_MITSUBA = np.diag([-1.0, -1.0, 1.0])
"""OpenCV's camera axes are x right, y down; Mitsuba's x left, y up; z forward in both."""


@dataclass(frozen=True)
class ThinLens:
    """Aperture radius and distance of the focal plane, both in m."""

    aperture_radius_m: float
    focus_m: float


@dataclass(frozen=True)
class IdealFilm:
    """Square pixels: focal length and principal point in px, pixel centres on integers."""

    focal_px: float
    cx_px: float
    cy_px: float
    lens: ThinLens


def thin_lens(intrinsics: Intrinsics, f_number: float, focus_m: float) -> ThinLens:
    """The lens of a calibrated camera, focused at ``focus_m``."""
    principal_m = intrinsics.fx_px * (intrinsics.pixel_pitch_m or USUAL_PITCH_M)
    focal_m = principal_m * focus_m / (principal_m + focus_m)
    return ThinLens(focal_m / (2 * f_number), focus_m)


def is_ideal(intrinsics: Intrinsics) -> bool:
    """Whether an ideal film shows the same picture."""
    return not any(intrinsics.distortion) and intrinsics.fx_px == intrinsics.fy_px


def blur_radius_px(lens: ThinLens, focal_px: float, depth_m: float) -> float:
    """Radius (px) of the circle of confusion of a point at ``depth_m``."""
    return lens.aperture_radius_m * abs(1 / depth_m - 1 / lens.focus_m) * focal_px


def camera_to_particle(
    R_cam_particle: Float[NDArray[np.float64], "3 3"], t_cam_particle: Float[NDArray[np.float64], "3"], *, shear: tuple[float, float]
) -> Float[NDArray[np.float64], "4 4"]:
    """Mitsuba's camera-to-world matrix where the particle stands still and its frame is the world.

    ``shear`` moves the image by a fraction of a pixel: ``x/z`` of what the camera sees grows by ``-shear[0]``, ``y/z`` alike.
    It is exact, and it is how a principal point comes to lie between Mitsuba's half pixels.
    """
    sheared = np.eye(3)
    sheared[:2, 2] = shear
    to_world = np.eye(4)
    to_world[:3, :3] = R_cam_particle.T @ sheared @ OPENCV_TO_MITSUBA
    to_world[:3, 3] = -R_cam_particle.T @ t_cam_particle
    return to_world
