"""Pictures of recovered curves and fields: over time with bands, over the picture as arrows, over directions as circles."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from tumble.reports.chart_tables import table_behind
from tumble.reports.charts import BAD, INK, MEASURED, NOISE, SOFT, svg

LINES = (MEASURED, BAD, INK)
Z95 = 1.96


def shape_chart(shape: Mapping[str, Any]) -> str:
    """One recovered curve or field."""
    over = tuple(shape["over"])
    draw = _in_time if over == ("time_s",) else (_arrows if over == ("x_px", "y_px") else _directions)
    picture = svg(lambda axes: draw(axes, shape), width=3.7, height=2.5, says=f"{shape['of']}, {shape['unit']}".replace("_", " "))
    value, sigma = np.array(shape["value"]), np.array(shape["sigma"])
    names = shape["axes"] if len(shape["axes"]) == value.shape[1] else [""] * value.shape[1]
    parts = [f"{name}, {shape['unit']}".removeprefix(", ") for name in names]
    heads = [*over, *(f"{part}{more}" for part in parts for more in ("", ", standard deviation"))]
    places = np.array(shape["place"])[:, : len(over)]
    return picture + table_behind(heads, np.column_stack([places, np.stack([value, sigma], axis=2).reshape(len(value), -1)]).tolist())


def _in_time(axes: Axes, shape: Mapping[str, Any]) -> None:
    time = 1e3 * np.array(shape["place"])[:, 0]
    value, sigma = np.array(shape["value"]), np.array(shape["sigma"])
    axes.axhline(0.0, color=SOFT, linewidth=0.8)
    for k, (name, colour) in enumerate(zip(shape["axes"], LINES, strict=False)):
        axes.fill_between(time, value[:, k] - Z95 * sigma[:, k], value[:, k] + Z95 * sigma[:, k], color=colour, alpha=0.15, linewidth=0)
        axes.plot(time, value[:, k], color=colour, label=name)
    axes.set_ylim(*_inner(value, sigma))
    axes.set_xlabel("time, ms")
    axes.set_ylabel(shape["unit"])
    axes.legend(frameon=False, ncols=len(shape["axes"]), loc="upper right")


def _inner(value: "np.ndarray[Any, Any]", sigma: "np.ndarray[Any, Any]") -> tuple[float, float]:
    """Limits that show the well-known part: at the ends of a flight the bands open wide."""
    spread = np.median(sigma, axis=0)
    low, high = float((value - 3.0 * spread).min()), float((value + 3.0 * spread).max())
    room = 0.15 * (high - low) + 1e-12
    return min(low, 0.0) - room, max(high, 0.0) + room


def _arrows(axes: Axes, shape: Mapping[str, Any]) -> None:
    place, value = np.array(shape["place"]), np.array(shape["value"])
    largest = float(np.linalg.norm(value, axis=1).max())
    axes.quiver(place[:, 0], place[:, 1], value[:, 0], value[:, 1], color=MEASURED, angles="xy")
    axes.invert_yaxis()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_xlabel("x, px")
    axes.set_ylabel("y, px")
    axes.set_title(f"longest arrow {largest:.3f} px", fontsize=9, color=SOFT)


def _directions(axes: Axes, shape: Mapping[str, Any]) -> None:
    n, value = np.array(shape["place"]), np.array(shape["value"])[:, 0]
    longitude, latitude = np.degrees(np.arctan2(n[:, 1], n[:, 0])), np.degrees(np.arcsin(np.clip(n[:, 2], -1.0, 1.0)))
    largest = float(np.abs(value).max())
    for colour, rows in ((BAD, value > 0), (MEASURED, value <= 0)):
        axes.scatter(longitude[rows], latitude[rows], s=120.0 * np.abs(value[rows]) / max(largest, 1e-12), color=colour, linewidths=0)
    axes.axhline(0.0, color=NOISE, linewidth=0.8)
    axes.set_xlabel("longitude (body axes), °")
    axes.set_ylabel("latitude, °")
    axes.set_title(f"largest circle {largest:.3f} px", fontsize=9, color=SOFT)
