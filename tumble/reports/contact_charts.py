"""Pictures of a validation of contact models: measured against predicted per experiment, the ladder, residuals over what an impact is."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tumble.reports.chart_tables import table_behind
from tumble.reports.charts import BAD, INK, MEASURED, NOISE, SOFT, figure_svg, svg

Z95 = 1.96
MARKS = (("D", BAD, True), ("s", INK, False), ("^", SOFT, False), ("v", INK, False), ("x", SOFT, False), ("+", INK, False))
"""Marker, colour and whether it is filled, of the models from the best on."""
SHOWN = 4


def experiments_of(impacts: Sequence[Mapping[str, Any]]) -> list[tuple[str, list[int]]]:
    """Experiments and the rows of their impacts; all together where every run is an experiment of its own."""
    names = sorted({i["experiment"] for i in impacts})
    if len(names) == len({i["run"] for i in impacts}):
        return [("all runs", list(range(len(impacts))))]
    return [(name, [k for k, i in enumerate(impacts) if i["experiment"] == name]) for name in names]


def experiment_chart(document: Mapping[str, Any], rows: Sequence[int]) -> str:
    """Linear and angular speed after each impact of one experiment: high-speed video with 95% bars, and what models predict."""
    figure_size = (7.4, 3.6)

    def draw(figure: Figure) -> None:
        top, bottom = figure.subplots(2, 1, sharex=True)
        draw_experiment(top, bottom, document, rows)
        bottom.set_xticks(
            range(len(rows)), run_labels([document["impacts"][k]["name"] for k in rows]), rotation=0 if len(rows) < 12 else 60
        )
        top.legend(frameon=False, ncols=3, loc="lower center", bbox_to_anchor=(0.5, 1.0))

    says = "Linear and angular speed after every impact, measured and predicted"
    picture = figure_svg(draw, width=figure_size[0], height=figure_size[1], says=says)
    return picture + table_behind(*_speed_table(document, rows))


def _speed_table(document: Mapping[str, Any], rows: Sequence[int]) -> tuple[list[str], list[list[Any]]]:
    """Of each impact of ``rows`` the linear (m/s) and angular (rad/s) speed after it, measured and by every model shown."""
    models = document["models"][:SHOWN]
    heads = ["impact", *(f"{part} {of}" for of in ("measured", *(m["title"] for m in models)) for part in ("|v|, m/s,", "|ω|, rad/s,"))]
    sources = [[i["after"] for i in document["impacts"]], *(m["predicted"] for m in models)]
    parts = (slice(0, 3), slice(3, 6))
    table = [[document["impacts"][k]["name"], *(float(np.linalg.norm(s[k][p])) for s in sources for p in parts)] for k in rows]
    return heads, table


def draw_experiment(linear: Axes, angular: Axes, document: Mapping[str, Any], rows: Sequence[int]) -> None:
    """Linear and angular speeds after the impacts ``rows`` of one experiment."""
    _speeds(linear, document, rows, slice(0, 3))
    _speeds(angular, document, rows, slice(3, 6))
    linear.set_ylabel("|v| after, m/s")
    angular.set_ylabel("|ω| after, rad/s")


def _speeds(axes: Axes, document: Mapping[str, Any], rows: Sequence[int], part: slice) -> None:
    impacts = [document["impacts"][k] for k in rows]
    measured = np.array([i["after"][part] for i in impacts])
    size = np.linalg.norm(measured, axis=1)
    places = np.arange(len(rows), dtype=float)
    bars = Z95 * _along(measured, np.array([i["after_sigma"][part] for i in impacts]))
    axes.errorbar(places, size, yerr=bars, fmt="o", color=MEASURED, markersize=5, capsize=3, label="high-speed video, 95%")
    for number, model in enumerate(document["models"][:SHOWN]):
        predicted = np.array([model["predicted"][k][part] for k in rows])
        marker, colour, filled = MARKS[number]
        at = places + 0.12 * (number + 1)
        values = np.linalg.norm(predicted, axis=1)
        spread = Z95 * _along(predicted, np.array([i["predicted_sigma"][part] for i in impacts])) if number == 0 else None
        face = colour if filled else "none"
        axes.errorbar(at, values, yerr=spread, fmt=marker, color=colour, markerfacecolor=face, markersize=4, label=model["title"])
    axes.set_ylim(0.0, _top(size, bars, document["models"], rows, part))
    axes.margins(x=0.03)


def _top(size: Any, bars: Any, models: Sequence[Mapping[str, Any]], rows: Sequence[int], part: slice) -> float:
    """Upper end of an axis: above all that is predicted or known to better than half of itself; bars of the rest leave the frame."""
    known = np.where(bars < 0.5 * size, size + bars, 0.0)
    predicted = [np.linalg.norm(np.array([model["predicted"][k][part] for k in rows]), axis=1).max() for model in models[:SHOWN]]
    return 1.08 * float(max(known.max(initial=0.0), *predicted, 1e-9))


def _along(vectors: Any, sigmas: Any) -> Any:
    """Standard deviation of the length of vectors (n, 3) whose components have ``sigmas`` (n, 3)."""
    unit = vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    return np.linalg.norm(unit * sigmas, axis=1)


def run_labels(names: Sequence[str]) -> list[str]:
    """Labels of impacts that stand side by side: of runs, with their experiments where those number runs alike."""
    labels = [run_label(name) for name in names]
    if len(set(labels)) == len(labels):
        return labels
    return [f"{name.rpartition('-r')[0].rpartition('-')[2]} {label}" for name, label in zip(names, labels, strict=True)]


def run_label(name: str) -> str:
    """The run of an impact alone, and its number in that run from the second on: particle and experiment stand in the title."""
    run, _, number = name.partition(", impact ")
    run = run.rsplit("-r")[-1] if "-r" in run else run
    return f"{run}·{number}" if number else run


def contact_ladder_chart(rungs: Sequence[Mapping[str, Any]], impacts: int) -> str:
    """Negative log score per held-out impact, rung by rung, over what errors as stated would leave."""

    def draw(axes: Axes) -> None:
        values = [-rung["held_out_log_score"] / impacts for rung in rungs]
        places = list(range(len(rungs)))
        last = [rung for rung in rungs if rung["accepted"]][-1]
        alone = -last["errors_alone_log_score"] / impacts
        axes.axhspan(0.1, alone, color=NOISE, alpha=0.25, linewidth=0)
        axes.annotate("errors and scatter alone", (-0.35, alone), xytext=(0, -11), textcoords="offset points", color=SOFT)
        standing = [k for k in places if rungs[k]["accepted"]]
        axes.plot(standing, [values[k] for k in standing], "o-", color=MEASURED, linewidth=2, label="accepted")
        refused = [k for k in places if not rungs[k]["accepted"]]
        axes.plot(refused, [values[k] for k in refused], "o", color=SOFT, markerfacecolor="none", label="tried and refused")
        for place, value in zip(places, values, strict=True):
            axes.annotate(f"{value:.2f}", (place, value), xytext=(0, 7), textcoords="offset points", ha="center")
        axes.set_yscale("log")
        axes.set_ylim(alone / 2, 2.0 * max(values))
        axes.set_xticks(places, [_wrapped(("" if k == 0 else "+ ") + rung["added"]) for k, rung in enumerate(rungs)])
        axes.set_xlim(-0.4, len(rungs) - 0.6)
        axes.set_ylabel("−log score per held-out impact")
        ticks = [t for t in (2, 3, 5, 10, 20, 50, 100, 200) if t < 2.0 * max(values)]
        axes.set_yticks(ticks, [str(t) for t in ticks])
        axes.minorticks_off()
        axes.legend(frameon=False, loc="upper right")

    return svg(draw, width=7.4, height=3.1, says="Negative log score per held-out impact of every model: the table below")


def _wrapped(words: str) -> str:
    """At most about 24 letters in a line."""
    lines = [""]
    for word in words.split():
        lines = [*lines[:-1], f"{lines[-1]} {word}".strip()] if len(lines[-1]) + len(word) < 24 else [*lines, word]
    return "\n".join(lines)


def contact_map_chart(entry: Mapping[str, Any]) -> str:
    """Residuals over one axis, in standard deviations."""

    def draw(axes: Axes) -> None:
        place, residual = np.array(entry["place"]), np.array(entry["residual"])
        axes.axhspan(-Z95, Z95, color=NOISE, alpha=0.2, linewidth=0)
        axes.axhline(0.0, color=SOFT, linewidth=0.8)
        strong = np.abs(residual) > 3.0
        axes.plot(place[~strong], residual[~strong], "o", color=MEASURED, markersize=4)
        axes.plot(place[strong], residual[strong], "o", color=BAD, markersize=4)
        reach = max(4.0, 1.15 * float(np.abs(residual).max(initial=0.0)))
        axes.set_ylim(-reach, reach)
        axes.set_xlabel(f"{entry['axis']}, {entry['unit']}")
        axes.set_ylabel(f"{KINDS[entry['kind']]}, σ")

    heads = (f"{entry['axis']}, {entry['unit']}", f"{KINDS[entry['kind']]}, σ")
    picture = svg(draw, width=3.7, height=2.5, says=f"{heads[1]}, over {heads[0]}")
    return picture + table_behind(heads, zip(entry["place"], entry["residual"], strict=True))


KINDS = {"normal": "v along the normal", "sliding": "v along the sliding", "spin": "spin made"}


def map_sentence(entry: Mapping[str, Any]) -> str:
    """What a map shows."""
    if not math.isfinite(entry["rank_correlation"]) or not entry["telling"]:
        return "Within chance."
    way = "rises" if entry["rank_correlation"] > 0 else "falls"
    rank = f"rank correlation {entry['rank_correlation']:+.2f}"
    return f"{KINDS[entry['kind']].capitalize()}: measured less predicted {way} with {entry['axis']} ({rank})."
