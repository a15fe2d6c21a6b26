"""Charts of a whole campaign: the error of every model, and how alike residuals are some frames apart."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from datasets.vocabulary.effects import in_words
from tumble.reports.chart_tables import table_behind
from tumble.reports.drawing import FONT, GAP, MEASURED, NOISE, SOFT, TICK, dot, frame_about, line, path, range_of, text
from tumble.reports.words import rms_word, rung_name

WIDE = (532.8, 208.8)
ABOVE = 1.2
"""Height of the ladder's axis over what is drawn in it."""
LEAST_LIKENESS, MOST_LIKENESS, ROOM = -0.1, 0.5, 1.1
"""Correlations between which an axis reaches at least, and how far beyond what is drawn."""


def ladder_chart(rungs: Sequence[Mapping[str, Any]], floor_px: float, unit: str = "px") -> str:
    """Held-out and fitted RMS of every rung over the noise floor."""
    held, fitted = [rung["held_out"]["rms_px"] for rung in rungs], [rung["fitted_rms_px"] for rung in rungs]
    top = ABOVE * max(filter(math.isfinite, (*held, floor_px)), default=0.0) or 1.0
    frame = frame_about((-0.4, len(rungs) - 0.6), (0.0, top), ("", f"RMS {rms_word(unit)}, {unit}"), size=WIDE, named=True)
    x, y, (left, right) = frame.x.at, frame.y.at, (frame.x.first, frame.x.last)
    points, others = ([(x(place), y(min(value, top))) for place, value in enumerate(values)] for values in (held, fitted))
    under = frame.y.first + TICK + GAP + 0.75 * FONT
    inside = [
        f'<rect x="{left:.2f}" y="{y(floor_px):.2f}" width="{right - left:.2f}" height="{frame.y.first - y(floor_px):.2f}" '
        f'fill="{NOISE}" fill-opacity="0.25"/>',
        text(left + GAP, y(floor_px) + FONT + 2.0, "noise floor", SOFT, anchor="start"),
        path(others, SOFT, 1.5, dashed=True),
        path(points, MEASURED, 2.0),
        *(dot(*point, 2.0, SOFT) for point in others),
        *(dot(*point, 3.0, MEASURED) for point in points),
        *(text(a, b - 7.0, f"{value:.4f}") for (a, b), value in zip(points, held, strict=True)),
    ]
    for place, rung in enumerate(rungs):
        at = x(place)
        inside.append(line((at, frame.y.first), (at, frame.y.first + TICK), SOFT, 0.8))
        inside.append(text(at, under + place % 2 * (FONT + 1.0), in_words(rung_name(rung)), SOFT))
    for row, (name, colour, width, dashed) in enumerate((("fitted", SOFT, 1.5, True), ("not fitted", MEASURED, 2.0, False))):
        level = frame.y.last + FONT * (1.0 + 1.4 * row)
        inside.append(path([(right - 80.0, level - 3.0), (right - 60.0, level - 3.0)], colour, width, dashed=dashed))
        inside.append(text(right - 54.0, level, name, anchor="start"))
    return frame.drawn(inside, "RMS of every model, fitted and not fitted, over the noise floor: the table below")


def autocorrelation_chart(floor: Mapping[str, Any]) -> str:
    """Likeness of residuals some frames apart."""
    pairs = [(lag, r) for lag, r in zip(floor["lags"], floor["autocorrelation"], strict=True) if isinstance(r, float)]
    reached = [ROOM * r for _, r in pairs]
    heads = ("frames apart", "correlation of residuals")
    frame = frame_about(range_of([lag for lag, _ in pairs]), (min(LEAST_LIKENESS, *reached), max(MOST_LIKENESS, *reached)), heads)
    points = [(frame.x.at(lag), frame.y.at(r)) for lag, r in pairs]
    zero = line((frame.x.first, frame.y.at(0.0)), (frame.x.last, frame.y.at(0.0)), SOFT, 0.8)
    inside = [zero, path(points, MEASURED, 1.5), *(dot(*point, 3.0, MEASURED) for point in points)]
    return frame.drawn(inside, f"{heads[1]}, over {heads[0]}") + table_behind(heads, pairs)
