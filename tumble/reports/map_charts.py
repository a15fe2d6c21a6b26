"""Maps of residuals as pictures: a point with its interval for every bin, or a circle where a bin has a place in a plane."""

import math
from collections.abc import Mapping
from typing import Any

from tumble.reports.chart_tables import table_behind
from tumble.reports.drawing import BAD, MEASURED, SOFT, dot, frame_about, line, range_of

STRONG, INTERVAL = 3.0, 1.96
"""Standard deviations from which a bin is told, and half of the interval that is drawn."""
DOT, LARGEST_AREA, FAINT, IN_PLANE = 2.0, 320.0, 0.3, 0.18
"""Radius of a point, area of the largest circle, opacity of what is not told, and the share left free around circles."""
AXIS = {
    "time": "time",
    "radius": "distance from principal point",
    "outline_direction": "direction of the normal",
    "speed": "speed",
    "spin_phase": "angle turned",
    "view": "calibrated view",
}
KIND = {"offset": "outwards", "along_v": "along v", "along_x": "along x", "along_y": "along y"}


def map_chart(entry: Mapping[str, Any]) -> str:
    """One map of residuals: points with error bars, or circles where it has two coordinates."""
    flat = entry["second"] is not None
    error = f"{_kind(entry)}, {entry.get('residual_unit', 'px')}"
    heads = [*(_plane_axes(entry) if flat else (_axis(entry),)), error, "standard deviation"]
    columns = [entry["centre"], *([entry["second"]] if flat else []), entry["mean_px"], entry["sigma_px"]]
    picture = (_plane if flat else _line)(entry, f"{error}, over {' and '.join(heads[:-2])}")
    return picture + table_behind(heads, zip(*columns, strict=True))


def _line(entry: Mapping[str, Any], says: str) -> str:
    rows = zip(entry["centre"], entry["mean_px"], entry["sigma_px"], strict=True)
    bins = [(x, mean, INTERVAL * sigma) for x, mean, sigma in rows if all(map(math.isfinite, (x, mean, sigma)))]
    ends = [0.0, *(mean + sign * half for _, mean, half in bins for sign in (-1.0, 1.0))]
    labels = (_axis(entry), f"{_kind(entry)}, {entry.get('residual_unit', 'px')}")
    frame = frame_about(range_of([x for x, _, _ in bins]), range_of(ends), labels)
    x, y = frame.x.at, frame.y.at
    inside = [line((frame.x.first, y(0.0)), (frame.x.last, y(0.0)), SOFT, 0.8)]
    for place, mean, half in bins:
        colour = BAD if abs(mean) > STRONG / INTERVAL * half else MEASURED
        inside += [line((x(place), y(mean - half)), (x(place), y(mean + half)), colour, 1.2), dot(x(place), y(mean), DOT, colour)]
    return frame.drawn(inside, says)


def _plane(entry: Mapping[str, Any], says: str) -> str:
    largest, picture = max(abs(m) for m in entry["mean_px"]), entry["name"] == "place"
    title = f"{KIND[entry['kind']]}: largest circle {largest:.3f} px"
    x, y = range_of(entry["centre"], IN_PLANE), range_of(entry["second"], IN_PLANE)
    frame = frame_about(x, y, _plane_axes(entry), title=title, alike=picture)
    circles = [
        dot(
            frame.x.at(across),
            frame.y.at(down),
            math.sqrt(LARGEST_AREA * abs(mean) / max(largest, 1e-12) / math.pi),
            BAD if mean > 0 else MEASURED,
            1.0 if abs(mean) > STRONG * sigma else FAINT,
        )
        for across, down, mean, sigma in zip(entry["centre"], entry["second"], entry["mean_px"], entry["sigma_px"], strict=True)
    ]
    return frame.drawn(circles, says)


def _axis(entry: Mapping[str, Any]) -> str:
    name = AXIS.get(entry["name"], entry["name"])
    return name if entry["unit"] == "number" else f"{name}, {entry['unit']}"


def _plane_axes(entry: Mapping[str, Any]) -> tuple[str, str]:
    return ("x, px", "y, px") if entry["name"] == "place" else ("longitude (body axes), °", "latitude, °")


def _kind(entry: Mapping[str, Any]) -> str:
    return KIND.get(entry["kind"], entry["kind"].replace("_", " "))
