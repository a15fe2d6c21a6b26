"""One style for all figures, and how they are written."""

import io
from pathlib import Path
from typing import Any

import matplotlib as mpl

from datasets.atomic_files import written_whole

mpl.use("Agg")

from matplotlib import pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from PIL import Image

COLOURS = ("#0b5d8f", "#c2571a", "#3b7d3b", "#7a4b94")
RED = "#b00020"
DPI = 100
DRAWN_FROM = "Drawn from"
"""Key of the text in a picture's file that says what it was drawn from."""
STYLE: dict[Any, Any] = {
    "font.size": 9,
    "axes.titlesize": 10,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "0.9",
    "axes.axisbelow": True,
}
mpl.rcParams.update(STYLE)  # for good: titles and ticks take their size where they are set, not where axes are made


def figure(rows: int, columns: int, size: tuple[float, float], *, shared: bool = False) -> tuple[Figure, Any]:
    """A figure in the studies' style and its axes (rows, columns); ``shared``: with the same horizontal axis."""
    return plt.subplots(rows, columns, figsize=size, squeeze=False, sharex=shared)


def plain_logarithmic(axes: Axes) -> None:
    """A logarithmic vertical axis with plain numbers: at 1, 2, 5 of each decade where few are in view, else one per decade."""
    axes.set_yscale("log")
    low, high = axes.get_ylim()
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def finish(picture: Figure) -> None:
    """The legend of all axes above the whole picture, first axes first, measured lines before others, and tight margins below it."""
    found: dict[str, Any] = {}
    for axes in picture.axes:
        for handle, label in zip(*axes.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    order = sorted(found, key=lambda label: isinstance(found[label], Line2D))
    picture.legend([found[label] for label in order], order, ncols=len(order), fontsize=9, loc="upper center", frameon=False)
    picture.tight_layout(rect=(0, 0, 1, 1 - 0.3 / picture.get_figheight()))


def write_figure(drawn: Figure, path: Path, *, drawn_from: str = "") -> None:
    """Write a figure without dates or versions in it; ``drawn_from``: a digest of what it shows and of who drew it."""
    held = io.BytesIO()
    drawn.savefig(held, format="png", dpi=DPI, metadata={"Software": None} | ({DRAWN_FROM: drawn_from} if drawn_from else {}))
    plt.close(drawn)
    with written_whole(path) as temporary:
        temporary.write_bytes(held.getvalue())


def drawn_from(path: Path) -> str:
    """What a picture's file says that it was drawn from; empty where it says nothing."""
    with Image.open(path) as image:
        return str(image.info.get(DRAWN_FROM, ""))
