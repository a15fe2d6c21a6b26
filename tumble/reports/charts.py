"""Pictures of a campaign's report: drawn with Matplotlib as SVG that stands in the page and takes its colours, day or night."""

import io
import re
from collections.abc import Callable
from typing import Any

import matplotlib as mpl
from markupsafe import escape
from matplotlib.figure import Figure

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
