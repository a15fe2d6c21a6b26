"""Pictures of a campaign's report: drawn with Matplotlib as SVG that stands in the page and takes its colours, day or night."""

import io
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
from markupsafe import escape
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tumble.reports.chart_tables import table_behind
from tumble.reports.words import rms_word, rung_name

INK, SOFT, MEASURED, NOISE, BAD = "#010203", "#010204", "#010205", "#010206", "#010207"
"""Stand-ins that become the page's colours."""
COLOURS = {INK: "currentColor", SOFT: "var(--soft)", MEASURED: "var(--observed)", NOISE: "var(--left-out)", BAD: "var(--estimated)"}
STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "tumble",
    "font.size": 9,
    "font.family": "sans-serif",
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "axes.spines.top": False,
    "axes.spines.right": False,
}


def map_chart(entry: Mapping[str, Any]) -> str:
    """One map of residuals: points with error bars, or circles where it has two coordinates."""
    flat = entry["second"] is not None
    draw, error = _plane if flat else _line, f"{_kind(entry)}, {entry.get('residual_unit', 'px')}"
    heads = [*(_plane_axes(entry) if flat else (_axis(entry),)), error, "standard deviation"]
    columns = [entry["centre"], *([entry["second"]] if flat else []), entry["mean_px"], entry["sigma_px"]]
    picture = svg(lambda axes: draw(axes, entry), width=3.7, height=2.5, says=f"{error}, over {' and '.join(heads[:-2])}")
    return picture + table_behind(heads, zip(*columns, strict=True))


def ladder_chart(rungs: Sequence[Mapping[str, Any]], floor_px: float, unit: str = "px") -> str:
    """Held-out and fitted RMS of every rung over the noise floor."""

    def draw(axes: Axes) -> None:
        places = range(len(rungs))
        held = [rung["held_out"]["rms_px"] for rung in rungs]
        axes.axhspan(0, floor_px, color=NOISE, alpha=0.25, linewidth=0)
        axes.annotate("noise floor", (0, floor_px), xytext=(2, -11), textcoords="offset points", color=SOFT)
        axes.plot(places, [rung["fitted_rms_px"] for rung in rungs], "o--", color=SOFT, label="fitted", markersize=4)
        axes.plot(places, held, "o-", color=MEASURED, label="not fitted", linewidth=2)
        for place, value in zip(places, held, strict=True):
            axes.annotate(f"{value:.4f}", (place, value), xytext=(0, 7), textcoords="offset points", ha="center")
        names = [rung_name(rung).replace("_", " ") for rung in rungs]
        axes.set_xticks(list(places), ["\n" * (place % 2) + name for place, name in enumerate(names)])
        axes.set_xlim(-0.4, len(rungs) - 0.6)
        axes.set_ylim(0, 1.2 * max(*held, floor_px))
        axes.set_ylabel(f"RMS {rms_word(unit)}, {unit}")
        axes.legend(frameon=False, loc="upper right")

    return svg(draw, width=7.4, height=2.9, says="RMS of every model, fitted and not fitted, over the noise floor: the table below")


def autocorrelation_chart(floor: Mapping[str, Any]) -> str:
    """Likeness of residuals some frames apart."""
    pairs = [(lag, r) for lag, r in zip(floor["lags"], floor["autocorrelation"], strict=True) if isinstance(r, float)]

    def draw(axes: Axes) -> None:
        axes.axhline(0.0, color=SOFT, linewidth=0.8)
        axes.plot([lag for lag, _ in pairs], [r for _, r in pairs], "o-", color=MEASURED)
        axes.set_ylim(min(-0.1, *(1.1 * r for _, r in pairs)), max(0.5, *(1.1 * r for _, r in pairs)))
        axes.set_xlabel("frames apart")
        axes.set_ylabel("correlation of residuals")

    heads = ("frames apart", "correlation of residuals")
    return svg(draw, width=3.7, height=2.3, says=f"{heads[1]}, over {heads[0]}") + table_behind(heads, pairs)


def _line(axes: Axes, entry: Mapping[str, Any]) -> None:
    strong = [abs(m) > 3.0 * s for m, s in zip(entry["mean_px"], entry["sigma_px"], strict=True)]
    axes.axhline(0.0, color=SOFT, linewidth=0.8)
    for colour, wanted in ((MEASURED, False), (BAD, True)):
        rows = [k for k, is_strong in enumerate(strong) if is_strong is wanted]
        centre, mean, sigma = ([entry[key][k] for k in rows] for key in ("centre", "mean_px", "sigma_px"))
        axes.errorbar(centre, mean, yerr=[1.96 * s for s in sigma], fmt="o", color=colour, markersize=4, linewidth=1.2)
    axes.set_xlabel(_axis(entry))
    axes.set_ylabel(f"{_kind(entry)}, {entry.get('residual_unit', 'px')}")


def _axis(entry: Mapping[str, Any]) -> str:
    name = AXIS.get(entry["name"], entry["name"])
    return name if entry["unit"] == "number" else f"{name}, {entry['unit']}"


def _plane_axes(entry: Mapping[str, Any]) -> tuple[str, str]:
    return ("x, px", "y, px") if entry["name"] == "place" else ("longitude (body axes), °", "latitude, °")


def _kind(entry: Mapping[str, Any]) -> str:
    return KIND.get(entry["kind"], entry["kind"].replace("_", " "))


def _plane(axes: Axes, entry: Mapping[str, Any]) -> None:
    largest = max(abs(m) for m in entry["mean_px"])
    for x, y, mean, sigma in zip(entry["centre"], entry["second"], entry["mean_px"], entry["sigma_px"], strict=True):
        colour = BAD if mean > 0 else MEASURED
        area = 320.0 * abs(mean) / max(largest, 1e-12)
        axes.scatter([x], [y], s=area, color=colour, alpha=1.0 if abs(mean) > 3.0 * sigma else 0.3, linewidths=0)
    if entry["name"] == "place":
        axes.invert_yaxis()
        axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.18)
    x, y = _plane_axes(entry)
    axes.set_xlabel(x)
    axes.set_ylabel(y)
    axes.set_title(f"{KIND[entry['kind']]}: largest circle {largest:.3f} px", fontsize=9, color=SOFT)


AXIS = {
    "time": "time",
    "radius": "distance from principal point",
    "outline_direction": "direction of the normal",
    "speed": "speed",
    "spin_phase": "angle turned",
    "view": "calibrated view",
}
KIND = {"offset": "outwards", "along_v": "along v", "along_x": "along x", "along_y": "along y"}


def svg(draw: Any, *, width: float, height: float, says: str) -> str:
    """The picture as an SVG element in the page's colours; ``says``: what it shows, for who cannot see it."""
    return figure_svg(lambda figure: draw(figure.add_subplot()), width=width, height=height, says=says)


def figure_svg(draw: Callable[[Figure], None], *, width: float, height: float, says: str) -> str:
    """A picture of several parts, alike."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(width, height), layout="constrained")
        draw(figure)
        text = io.StringIO()
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None, "Type": None, "Format": None})
    element = text.getvalue()
    element = element[element.index("<svg") :]
    element = re.sub(r"<metadata>.*?</metadata>", "", element, flags=re.DOTALL)
    for stand_in, colour in COLOURS.items():
        element = element.replace(stand_in, colour)
    return element.replace("<svg ", f'<svg role="img" aria-label="{escape(says)}" class="chart" ', 1)
