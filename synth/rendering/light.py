"""Lights: an LED panel behind the particle, or two soft boxes beside the camera and a dark board behind.

The panel stands square to the optical axis and is brightest in its middle: ``L = (1 - a x²/h²)(1 - a y²/h²)`` with half width
``h`` and fall-off ``a``. Its image is computed exactly; the light that the particle catches comes from an environment map, the
panel as the particle sees it from where it is (one place per recording: an error of direction only, and of no consequence but for
the caustics of clear particles). Radiance is relative: 1 fills the sensor to its recipe's ``saturation``.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

Array = NDArray[np.float64]

AMBIENT = 0.02
"""Radiance of everything else in the room."""
PANEL_BEHIND = 0.5
"""Distance of the panel behind the focal plane, as a share of the camera's distance."""
PANEL_OVERFILL = 1.3
PANEL_SLOPE = 0.3
"""The panel's half width is at least this share of its distance from the particle."""
BOX_ASIDE, BOX_HALF = 0.6, 0.3
"""Place and half width of the soft boxes, as shares of the camera's distance."""
MAP_SHAPE = (256, 512)


@dataclass(frozen=True)
class Lighting:
    """The light of one camera; lengths in m, camera frame."""

    kind: Literal["back", "front"]
    panel_z_m: float
    panel_half_m: float
    falloff: float
    focus_m: float


def lighting(kind: Literal["back", "front"], *, focus_m: float, widest_slope: float, falloff: float) -> Lighting:
    """The light of a camera focused at ``focus_m`` (m) whose picture reaches ``widest_slope`` = max(x/z, y/z) from the axis."""
    z = focus_m * (1 + PANEL_BEHIND)
    return Lighting(kind, z, max(PANEL_OVERFILL * widest_slope * z, PANEL_SLOPE * PANEL_BEHIND * focus_m), falloff, focus_m)


def background_radiance(light: Lighting, xy: Float[NDArray[np.float64], "n 2"]) -> Float[NDArray[np.float64], " n"]:
    """Radiance (n,) that the camera sees without a particle along ideal normalised image coordinates ``xy``."""
    if light.kind == "front":
        return np.full(len(xy), AMBIENT)
    return _panel(light, xy * light.panel_z_m)


def incident_radiance(
    light: Lighting, at_cam: Float[NDArray[np.float64], "3"], directions_cam: Float[NDArray[np.float64], "n 3"]
) -> Float[NDArray[np.float64], " n"]:
    """Radiance (n,) that arrives at ``at_cam`` (m) from where unit ``directions_cam`` point, camera frame."""
    if light.kind == "front":
        return _soft_boxes(light, at_cam, directions_cam)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = (light.panel_z_m - at_cam[2]) / directions_cam[:, 2]
        hit = at_cam[:2] + reach[:, None] * directions_cam[:, :2]
    return np.where(directions_cam[:, 2] > 0, _panel(light, np.nan_to_num(hit, posinf=1e9, neginf=-1e9)), AMBIENT)


def environment_map(light: Lighting, at_cam: Float[NDArray[np.float64], "3"]) -> Float[NDArray[np.float64], "row column"]:
    """Incident radiance over latitude and longitude in Mitsuba's layout; see :func:`map_directions`."""
    return incident_radiance(light, at_cam, map_directions().reshape(-1, 3)).reshape(MAP_SHAPE)


def map_directions() -> Float[NDArray[np.float64], "row column 3"]:
    """Where the cells of an environment map lie, in the camera frame; the map's own axes are the camera's after half a turn about z."""
    rows, columns = MAP_SHAPE
    theta = ((np.arange(rows) + 0.5) / rows * np.pi)[:, None]
    phi = ((np.arange(columns) + 0.5) / columns * 2 * np.pi)[None, :]
    local = np.stack(np.broadcast_arrays(np.sin(phi) * np.sin(theta), np.cos(theta), -np.cos(phi) * np.sin(theta)), axis=-1)
    return np.asarray(local * [-1.0, -1.0, 1.0])


def _panel(light: Lighting, on_panel: Array) -> Array:
    scaled = on_panel / light.panel_half_m
    radiance = np.prod(1 - light.falloff * scaled**2, axis=1)
    return np.where(np.abs(scaled).max(axis=1) <= 1, radiance, AMBIENT)


def _soft_boxes(light: Lighting, at_cam: Array, directions_cam: Array) -> Array:
    """Two square boxes in the plane of the lens, so bright that a white matte surface facing the camera has radiance 1."""
    d = light.focus_m
    with np.errstate(divide="ignore", invalid="ignore"):
        hit = at_cam[:2] - (at_cam[2] / directions_cam[:, 2])[:, None] * directions_cam[:, :2]
    hit = np.nan_to_num(hit, posinf=1e9, neginf=-1e9)
    inside = (np.abs(np.abs(hit[:, 0]) - BOX_ASIDE * d) < BOX_HALF * d) & (np.abs(hit[:, 1]) < BOX_HALF * d) & (directions_cam[:, 2] < 0)
    return np.where(inside, _box_radiance(), AMBIENT)


def _box_radiance() -> float:
    """From the irradiance of both boxes on a facing surface in the focal plane: ``E = L ∫ cos² θ / r² dA``."""
    x = BOX_ASIDE + BOX_HALF * np.linspace(-0.975, 0.975, 40)
    y = BOX_HALF * np.linspace(-0.975, 0.975, 40)
    r2 = 1 + x[:, None] ** 2 + y[None, :] ** 2
    share = 2 * np.sum(1 / r2**2) * (2 * BOX_HALF / 40) ** 2
    return float(np.pi / share)
