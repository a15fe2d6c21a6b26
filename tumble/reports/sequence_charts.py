"""What each sequence asks for, against the sequence: the values of effects of which every one has its own."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from estimator.geometry.robust_scale import robust_sigma
from tumble.reports.charts import MEASURED, NOISE, SOFT, figure_svg

Z95 = 1.96
LEAST = 3
"""Sequences from which on a picture says more than a table."""
MOST_NAMED = 30
"""Sequences whose names find room under the picture."""
WIDTH, HEIGHT, ROOM = 7.4, 1.25, 0.9
"""Of the picture, of each of its parts, and for the names below (inches)."""


def sequence_charts(values: Sequence[Mapping[str, Any]], sequences: Sequence[str], recordings: Sequence[str] = ()) -> dict[str, str]:
    """A picture for each effect with values of at least ``LEAST`` sequences, or recordings; ``values`` as a diagnosis has them."""
    found: dict[str, str] = {}
    for effect in dict.fromkeys(v["effect"] for v in values if v["sequence"] is not None):
        every = [v for v in values if v["effect"] == effect]
        names = recordings if any(v["sequence"] in recordings for v in every) else sequences
        own = [v for v in every if v["sequence"] in names]
        if len({v["sequence"] for v in own}) >= LEAST:
            found[effect] = _chart(own, names)
    return found


def _chart(values: Sequence[Mapping[str, Any]], names: Sequence[str]) -> str:
    """One part for each parameter: values with 95% intervals, and a band of their scatter."""
    parameters = list(dict.fromkeys(v["parameter"] for v in values))

    def draw(figure: Figure) -> None:
        parts = np.atleast_1d(figure.subplots(len(parameters), 1, sharex=True))
        for axes, parameter in zip(parts, parameters, strict=True):
            own = [v for v in values if v["parameter"] == parameter]
            place = [names.index(v["sequence"]) for v in own]
            value, sigma = (np.array([v[key] for v in own], dtype=np.float64) for key in ("value", "sigma"))
            scatter = float(robust_sigma(value))
            axes.axhspan(-scatter, scatter, color=NOISE, alpha=0.25, linewidth=0)
            axes.axhline(0.0, color=SOFT, linewidth=0.8)
            bars = Z95 * np.where(np.isfinite(sigma), sigma, 0.0)
            axes.errorbar(place, value, yerr=bars, fmt="o", color=MEASURED, markersize=4, linewidth=1)
            unit = own[0]["unit"]
            axes.set_ylabel(parameter.replace("_", " ") + ("" if unit == "1" else f", {unit}"))
        if len(names) <= MOST_NAMED:
            parts[-1].set_xticks(range(len(names)), names, rotation=90)
        else:
            parts[-1].set_xlabel("number of the sequence")

    says = f"{', '.join(parameters)} of every sequence, with 95 % intervals: the table below".replace("_", " ")
    return figure_svg(draw, width=WIDTH, height=HEIGHT * len(parameters) + ROOM, says=says)
