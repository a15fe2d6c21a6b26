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
