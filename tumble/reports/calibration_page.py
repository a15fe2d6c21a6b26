"""The page of ``tumble calibrate``: parameters with uncertainty, residuals over the picture. One file that loads nothing."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure
from numpy.typing import NDArray

from datasets.atomic_files import written_whole
from datasets.vocabulary.calibration import Calibration
from estimator.calibration.fitting import RigFit
from tumble.calibrating.words import camera_rows, gravity_rows, verdict_of
from tumble.reports.chart_tables import table_behind
from tumble.reports.charts import BAD, MEASURED, SOFT, figure_svg
from tumble.versions import versions

CELLS = 12
"""Of the map of residuals, along the picture's longer side."""
STRONG = 3.0
"""A cell's mean residual of more standard deviations is drawn as systematic."""


def write_calibration_page(calibration: Calibration, fit: RigFit | None, path: Path, *, extra: Mapping[str, Any] | None = None) -> None:
    """Write the page of a calibration; ``fit`` where it was made from pictures, ``extra``: a table of further figures."""
    environment = Environment(loader=PackageLoader("tumble.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    text = environment.get_template("calibration.html.j2").render(
        verdict=verdict_of(calibration),
        good=calibration.fit is None or calibration.fit.cross_validation is None or calibration.fit.cross_validation.honest,
        notes=calibration.notes,
        cameras=[
            {"name": camera.name, "rows": camera_rows(calibration, c), "chart": None if fit is None else _chart(fit, c)}
            for c, camera in enumerate(calibration.cameras)
        ],
        gravity=gravity_rows(calibration),
        extra=list((extra or {}).items()),
        made_by=versions()["tumble"],
    )
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _chart(fit: RigFit, camera: int) -> Markup:
    """Mean residuals over the picture as arrows, and the RMS of every picture."""
    chosen = [(s, r) for s, r in zip(fit.bundle.sightings, fit.bundle.residuals_px(fit.rig), strict=True) if s.camera == camera]
    points = np.concatenate([s.points_px for s, _ in chosen])
    residuals = np.concatenate([r for _, r in chosen])
    rms = [float(np.sqrt((r**2).mean())) for _, r in chosen]
    lens = fit.rig.lenses[camera]

    def draw(figure: Figure) -> None:
        left, right = figure.subplots(1, 2, width_ratios=(1.4, 1))
        centres, means, strong = _cells(points, residuals, (lens.width_px, lens.height_px))
        scale = lens.width_px / CELLS / max(float(np.hypot(*means.T).max(initial=0.0)), 1e-9)
        left.plot(*points.T, ".", color=SOFT, markersize=1)
        for (x, y), (u, v), bad in zip(centres, means, strong, strict=True):
            left.plot([x, x + scale * u], [y, y + scale * v], color=BAD if bad else MEASURED, linewidth=1.4)
        left.set(xlim=(0, lens.width_px), ylim=(lens.height_px, 0), aspect="equal", xlabel="x, px", ylabel="y, px")
        left.set_title(f"mean residuals; a cell's width is {lens.width_px / CELLS / scale:.3f} px", fontsize=9, color=SOFT)
        right.bar([s.picture for s, _ in chosen], rms, color=MEASURED)
        right.set(xlabel="picture", ylabel="RMS residual, px")

    says = "Mean residuals of corners over the picture, and RMS residual of every picture"
    heads, rows = ("picture", "corners", "RMS residual, px"), [(s.picture, len(r), e) for (s, r), e in zip(chosen, rms, strict=True)]
    return Markup(figure_svg(draw, width=7.4, height=3.3, says=says) + table_behind(heads, rows))


def _cells(points: NDArray[np.float64], residuals: NDArray[np.float64], size: tuple[int, int]) -> tuple[Any, Any, Sequence[bool]]:
    """Centres, mean residuals and whether these are more than noise, of cells with three corners and more."""
    side = max(size) / CELLS
    keys = (points // side).astype(int)
    centres, means, strong = [], [], []
    sigma = float(np.sqrt((residuals**2).mean()))
    for key in sorted({tuple(k) for k in keys.tolist()}):
        inside = (keys == key).all(axis=1)
        count = int(np.count_nonzero(inside))
        if count >= 3:
            mean = residuals[inside].mean(axis=0)
            centres.append(points[inside].mean(axis=0))
            means.append(mean)
            strong.append(bool(np.abs(mean).max() > STRONG * sigma / np.sqrt(count)))
    return np.array(centres).reshape(-1, 2), np.array(means).reshape(-1, 2), strong
