"""The page of ``tumble check``: outlines over frames, figures, what speaks against the recording. One file that loads nothing."""

from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure
from numpy.typing import NDArray

from datasets.atomic_files import written_whole
from datasets.observation import Frames
from datasets.vocabulary.camera import Intrinsics
from tumble.checking.checked import CameraCheck, Check
from tumble.checking.findings import left_out, numbers_text
from tumble.checking.geometry import Geometry
from tumble.reports.chart_tables import table_behind
from tumble.reports.charts import BAD, MEASURED, SOFT, figure_svg
from tumble.reports.pictures import Window, crop_uri, follow
from tumble.versions import versions

MOST_PICTURES = 24
"""Spread over the recording, of each camera; a page stays below about 1 MB."""
MOST_LEFT_OUT = 12
"""Of the frames that are left out, besides."""
MOST_VIEWS, MOST_WORST = 18, 6
"""Calibrated views: spread over all, and those that fit worst."""


def write_check_page(check: Check, path: Path) -> None:
    """Write the page of a check to ``path``."""
    text = render_check(check)
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def render_check(check: Check) -> str:
    """The page's text."""
    environment = Environment(loader=PackageLoader("tumble.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    return environment.get_template("check.html.j2").render(
        check=check,
        verdict=_verdict(check),
        cameras=[_camera(camera) for camera in check.cameras],
        views=[] if check.geometry is None or check.geometry.views is None else _views(check.geometry),
        made_by=versions()["tumble"],
    )


def _verdict(check: Check) -> str:
    if check.missing:
        names = ", ".join(missing.name.replace("_", " ") for missing in check.missing)
        return f"Not an observation yet: {names} {'is' if len(check.missing) == 1 else 'are'} missing."
    return "Nothing speaks against a measurement." if check.good else "Something speaks against a measurement."


def _camera(camera: CameraCheck) -> dict[str, Any]:
    inspection = camera.inspection
    chosen = _chosen(camera)
    outlines = [frame.outline.points_px for frame in inspection.track.frames]
    windows = follow([points if len(points) else None for points in outlines], _size(camera))
    return {
        "name": camera.name,
        "rows": camera.rows,
        "left_out": [(reason, numbers_text(numbers)) for reason, numbers in left_out(inspection).items()],
        "pictures": [_picture(camera, k, windows[k]) for k in chosen],
        "shown": f"{len(chosen)} of {len(inspection.track)} frames",
        "whole": _whole(camera),
        "chart": Markup(_chart(camera)) if len(inspection.path.frame) > 1 else None,
    }


def _views(geometry: Geometry) -> list[dict[str, Any]]:
    """Outlines of calibrated views, each in a square of its own, with the error of its pairs."""
    assert geometry.views is not None
    frames = geometry.views.frames
    chosen = np.linspace(0, len(frames) - 1, min(MOST_VIEWS, len(frames))).round().astype(int)
    worst = [number for number, _ in sorted(geometry.errors_px.items(), key=lambda item: -item[1])[:MOST_WORST]]
    shown = []
    for number in sorted({*chosen.tolist(), *worst}):
        points, error = frames[number].outline.points_px, geometry.errors_px.get(number)
        side = 1.1 * float(np.ptp(points, axis=0).max()) if len(points) else 1.0
        middle = 0.5 * (points.min(axis=0) + points.max(axis=0)) if len(points) else np.zeros(2)
        said = "" if error is None else f", {error:.2f} px"
        shown.append(
            {"number": number, "side": side, "points": _points(points - middle + 0.5 * side), "said": f"{frames[number].status}{said}"}
        )
    return shown


def _whole(camera: CameraCheck) -> dict[str, Any] | None:
    """The first picture as a whole with the way that the outline's centre takes."""
    if not isinstance(camera.recording, Frames):
        return None
    lens = _size(camera)
    side = max(lens.width_px, lens.height_px)
    uri = crop_uri(camera.recording, 0, Window(0, 0, side))
    return {"uri": uri, "side": side, "height": lens.height_px, "width": lens.width_px, "points": _points(camera.inspection.path.c + 0.5)}


def _size(camera: CameraCheck) -> Intrinsics:
    """The picture's size as a lens, of which nothing else is used."""
    if isinstance(camera.recording, Frames):
        height, width = camera.recording.read(0).shape
    else:
        points = [outline.points_px for outline in camera.recording if len(outline.points_px)]
        width, height = (int(n) + 1 for n in np.concatenate(points).max(axis=0)) if points else (1, 1)
    return Intrinsics(max(width, 1), max(height, 1), 1.0, 1.0, 0.0, 0.0)


def _chosen(camera: CameraCheck) -> list[int]:
    """Frames spread over the recording, some of those that are left out, and those around odd steps."""
    inspection = camera.inspection
    spread = np.linspace(0, len(inspection.track) - 1, min(MOST_PICTURES, len(inspection.track))).round().astype(int)
    out = np.flatnonzero(~inspection.track.used)
    some = out[np.linspace(0, len(out) - 1, min(MOST_LEFT_OUT, len(out))).round().astype(int)] if len(out) else out
    odd = [frame for step in inspection.odd_steps[:MOST_LEFT_OUT] for frame in (step.first, step.second)]
    return sorted({*spread.tolist(), *some.tolist(), *odd})


def _picture(camera: CameraCheck, index: int, window: Window) -> dict[str, Any]:
    frame = camera.inspection.track.frames[index]
    points = frame.outline.points_px - [window.x_px, window.y_px] + 0.5  # a pixel's centre lies half a pixel into its picture
    return {
        "number": index,
        "status": str(frame.status),
        "used": frame.used,
        "side": window.side_px,
        "uri": crop_uri(camera.recording, index, window) if isinstance(camera.recording, Frames) else None,
        "points": _points(points),
    }


def _points(points: NDArray[np.float64]) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def _chart(camera: CameraCheck) -> str:
    """Motion and size over the frames, and the same in numbers."""
    path, extent = camera.inspection.path, camera.inspection.extent_px
    steps = dict(zip(path.frame[1:].tolist(), _steps_px(camera).tolist(), strict=True))
    rows = [(k, steps.get(k), float(extent[k]), str(frame.status)) for k, frame in enumerate(camera.inspection.track.frames)]
    picture = figure_svg(lambda figure: _draw(figure, camera), width=7.4, height=3.4, says="Motion and size of the outline over the frames")
    return picture + table_behind(("frame", "motion since the last one, px per frame", "size, px", "used"), rows)


def _steps_px(camera: CameraCheck) -> NDArray[np.float64]:
    """How far the outline's centre moves from one usable frame to the next, px per frame."""
    path = camera.inspection.path
    return np.asarray(np.hypot(*np.diff(path.c, axis=0).T) / np.diff(path.frame))


def _draw(figure: Figure, camera: CameraCheck) -> None:
    """Over the frames: how far the centre moved, and the contrast or the size."""
    inspection = camera.inspection
    top, bottom = figure.subplots(2, 1, sharex=True)
    steps = _steps_px(camera)
    top.plot(0.5 * (inspection.path.frame[1:] + inspection.path.frame[:-1]), steps, ".-", color=MEASURED, linewidth=0.8, markersize=3)
    for step in inspection.odd_steps:
        top.axvline(0.5 * (step.first + step.second), color=BAD, linewidth=1.0)
    top.set_ylim(0.0, 1.15 * float(steps.max()) + 0.01)
    top.set_ylabel("motion, px per frame")
    bottom.plot(np.arange(len(inspection.extent_px)), inspection.extent_px, ".", color=MEASURED, markersize=3)
    out = ~inspection.track.used
    bottom.plot(np.flatnonzero(out), inspection.extent_px[out], "x", color=SOFT, markersize=4)
    bottom.set_ylabel("size, px")
    bottom.set_xlabel("frame (crosses: left out)")
