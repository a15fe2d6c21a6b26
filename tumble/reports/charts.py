"""Pictures of a campaign's report: drawn with Matplotlib as SVG that stands in the page and takes its colours, day or night."""

import io
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

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
    draw = _plane if entry["second"] is not None else _line
    return svg(lambda axes: draw(axes, entry), width=3.7, height=2.5)


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

    return svg(draw, width=7.4, height=2.9)


def autocorrelation_chart(floor: Mapping[str, Any]) -> str:
    """Likeness of residuals some frames apart."""

    def draw(axes: Axes) -> None:
        pairs = [(lag, r) for lag, r in zip(floor["lags"], floor["autocorrelation"], strict=True) if isinstance(r, float)]
        axes.axhline(0.0, color=SOFT, linewidth=0.8)
        axes.plot([lag for lag, _ in pairs], [r for _, r in pairs], "o-", color=MEASURED)
        axes.set_ylim(min(-0.1, *(1.1 * r for _, r in pairs)), max(0.5, *(1.1 * r for _, r in pairs)))
        axes.set_xlabel("frames apart")
        axes.set_ylabel("correlation of residuals")

    return svg(draw, width=3.7, height=2.3)


def _line(axes: Axes, entry: Mapping[str, Any]) -> None:
    strong = [abs(m) > 3.0 * s for m, s in zip(entry["mean_px"], entry["sigma_px"], strict=True)]
    axes.axhline(0.0, color=SOFT, linewidth=0.8)
    for colour, wanted in ((MEASURED, False), (BAD, True)):
        rows = [k for k, is_strong in enumerate(strong) if is_strong is wanted]
        centre, mean, sigma = ([entry[key][k] for k in rows] for key in ("centre", "mean_px", "sigma_px"))
        axes.errorbar(centre, mean, yerr=[1.96 * s for s in sigma], fmt="o", color=colour, markersize=4, linewidth=1.2)
    axes.set_xlabel(f"{AXIS.get(entry['name'], entry['name'])}, {entry['unit']}" if entry["unit"] != "number" else AXIS[entry["name"]])
    axes.set_ylabel(f"{KIND.get(entry['kind'], entry['kind'].replace('_', ' '))}, {entry.get('residual_unit', 'px')}")


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
    axes.set_xlabel("x, px" if entry["name"] == "place" else "longitude (body axes), °")
    axes.set_ylabel("y, px" if entry["name"] == "place" else "latitude, °")
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


def svg(draw: Any, *, width: float, height: float) -> str:
    """The picture as an SVG element in the page's colours."""
    return figure_svg(lambda figure: draw(figure.add_subplot()), width=width, height=height)


def figure_svg(draw: Callable[[Figure], None], *, width: float, height: float) -> str:
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
    return element.replace("<svg ", '<svg aria-hidden="true" class="chart" ', 1)
