"""The page of the hidden-effect challenge, copied from the committed result of a full run.

``python -m scripts.acceptance.challenge_page [--result docs/results/challenge.json] [--page docs/studies/challenge.md] [--remark TEXT]``:
reads what ``tumble challenge score --result`` wrote (the summary and, beside it, ``..._cases.csv``) and the table of detection limits;
writes the page and its figure: how often effects were found against their size, and what was named where each was hidden; and what ``tumble
explain`` takes, where ``time_explain.json`` lies beside the result.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from scipy.stats import binomtest, norm

from datasets.vocabulary.effects import EFFECTS
from studies.reporting.figures import COLOURS, figure, write_figure
from studies.reporting.words import number, write_page
from tumble.challenge.detection import Z95
from tumble.challenge.limits import TABLE, axis_limits, read_table

Row = Mapping[str, Any]
TIMES = "time_explain.json"
INTERVAL = "with their exact 95% intervals"


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    """A Markdown table."""
    return ["| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *rows)]


def bounds(row: Row) -> str:
    """What was asked for."""
    parts = [f"≥ {number(row['least'])}" if _finite(row["least"]) else "", f"≤ {number(row['most'])}" if _finite(row["most"]) else ""]
    asked = " and ".join(part for part in parts if part)
    return f"{asked} {row['unit']}" if asked else "–"


def _finite(value: Any) -> bool:
    return isinstance(value, int | float) and bool(np.isfinite(value))


def acceptance_lines(result: Row) -> list[str]:
    """The lines of acceptance."""
    rows = []
    for row in result["acceptance"]:
        interval = f" ({number(row['low'])} to {number(row['high'])})" if _finite(row["low"]) else ""
        value = f"{number(row['value'])}{interval} {row['unit']}" if _finite(row["value"]) else "–"
        rows.append([row["line"], row["what"], value, str(row["n"]), bounds(row), row["verdict"]])
    return table_lines(["", "figure", "value", "n", "asked", ""], rows)


def effect_lines(result: Row, limits: Mapping[str, list[dict[str, Any]]]) -> list[str]:
    """Per effect: limits, how often it was named, the size found in half and in 95% of cases, and how good its values are."""
    detection = {row["effect"]: row for row in result["detection"]}
    rows = []
    for row in result["effects"]:
        found = detection.get(row["effect"], {})
        axes = "; ".join(
            f"{a['parameter']} {number(a['found_in_95_percent'])} {a['unit']}".removesuffix(" 1") for a in limits[row["effect"]]
        )
        sizes = (
            [f"{number(found[k])} ({number(found[k + '_low'])} to {number(found[k + '_high'])})" for k in ("half", "in_95_percent")]
            if found
            else ["–", "–"]
        )
        covered = f"{row['inside_95']} of {row['parameters']}" if row["parameters"] else "–"
        spread = number(row["pull_spread"]) if row["pull_spread"] is not None else "–"
        title = EFFECTS[row["effect"]].title
        rows.append([title, axes, str(row["cases"]), str(row["within_group"]), str(row["alone_first"]), *sizes, covered, spread])
    head = ["effect", "95% limit of the table", "cases above it", "named or in the group", "alone and first"]
    return table_lines([*head, "found in half (limits)", "found in 95% (limits)", "values inside 95%", "spread of pulls"], rows)


def confusion_lines(result: Row) -> list[str]:
    """What was named first where each thing was hidden."""
    rows = []
    for hidden, called in result["confusion"].items():
        other = ", ".join(f"{_words(name)} {n}" for name, n in sorted(called.items(), key=lambda item: -item[1]) if name != hidden)
        rows.append([_words(hidden), str(sum(called.values())), str(called.get(hidden, 0)), other or "–"])
    return table_lines(["hidden", "cases", "named so first", "otherwise named"], rows)


def fall_lines(result: Row) -> list[str]:
    """How far velocity errors fell, by what was hidden."""
    rows = [[_words(row["effect"]), str(row["n"]), number(row["fall"]), number(row["known"])] for row in result["falls"]]
    return [
        "## Velocity errors",
        "",
        "Velocities and angular velocities that the effect alone had biased by more than three standard deviations: how many times smaller "
        "the error of the last model is, and of a model that knows what is hidden, which shows how large the bias was beside the noise.",
        "",
        *table_lines(["hidden", "velocities", "errors fall (times, median)", "with what is hidden known"], rows),
        "",
    ]


def _words(key: str) -> str:
    return key.replace("_", " ")


def draw_detection(axes: Axes, cases: pd.DataFrame, everything: Row) -> None:
    """Share found in bins of size, and the fitted curve of all effects together."""
    singles = cases[(cases["kind"] == "single") & (cases["ratio"] > 0)]
    least, most = 0.3, max(12.0, 1.01 * float(singles["ratio"].max()))
    edges = np.geomspace(least, most, 9)
    for low, high in pairwise(edges):
        part = singles[(singles["ratio"] >= low) & (singles["ratio"] < high)]
        if len(part):
            share = float(part["all_found"].mean())
            exact = binomtest(int(part["all_found"].sum()), len(part)).proportion_ci(method="exact")
            axes.errorbar(
                np.sqrt(low * high), share, yerr=[[share - exact.low], [exact.high - share]], fmt="o", ms=4, capsize=2.5, color=COLOURS[0]
            )
    x = np.geomspace(least, most, 200)
    width = np.log(everything["in_95_percent"] / everything["half"]) / Z95
    axes.plot(x, norm.cdf(np.log(x / everything["half"]) / width), color=COLOURS[1], lw=1.4)
    axes.set(xscale="log", xlabel="size over the 95% detection limit", ylabel="share found", ylim=(-0.05, 1.05), title="Found against size")


def draw_confusion(axes: Axes, result: Row) -> None:
    """What was hidden against what was named first; shares of a row."""
    hidden = list(result["confusion"])
    named = [*hidden, *sorted({name for row in result["confusion"].values() for name in row} - set(hidden))]
    shares = np.array([[row.get(name, 0) / max(sum(row.values()), 1) for name in named] for row in result["confusion"].values()])
    axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    axes.set_xticks(range(len(named)), [_words(name) for name in named], rotation=90, fontsize=6)
    axes.set_yticks(range(len(hidden)), [_words(name) for name in hidden], fontsize=6)
    axes.grid(visible=False)
    axes.set(title="Hidden (rows) and named first (columns)")


def time_lines(times: Row) -> list[str]:
    """What the verb takes, as a user starts it."""
    runs = times["runs"]
    rows = []
    for run in runs:
        found = ", ".join(map(_words, run["found"])) or "nothing of the catalogue"
        again = "the same" if run["same"] else "**something else**"
        rows.append([run["campaign"], found, again, number(run["cpu_s"]), str(run["jobs"]), number(run["wall_s"])])
    most = max(run["jobs"] for run in runs)
    slowest = max(run["wall_s"] for run in runs if run["jobs"] == most)
    verdict = "HELD" if slowest <= times["asked_s"] else "MISSED"
    return [
        "## The verb on the slowest campaigns",
        "",
        f"`tumble explain` from the command to its report, on the clock, on {times['cores']} cores with nothing else to do, of those of "
        f"{times['of']} campaigns whose solution took most CPU time in one process; {number(times['asked_s'])} s are asked: "
        f"{number(slowest)} s, {verdict} (`python -m scripts.benchmarks.time_explain`, [result](../results/{TIMES})).",
        "",
        *table_lines(["campaign", "found", "by the verb", "CPU time in one process (s)", "processes", "time on the clock (s)"], rows),
        "",
    ]


def page_lines(  # noqa: PLR0917
    result: Row,
    cases: pd.DataFrame,
    limits: Mapping[str, list[dict[str, Any]]],
    picture: str,
    remark: str = "",
    times: Row | None = None,
) -> list[str]:
    """The page; ``remark``: what else is to be known of this run; ``times`` of the verb, where they were taken."""
    rendered = result["tiers"] == ["rendered"]
    whole = "; *whole* has registration and empirical terms, too" if _finite(result["cpu_s"].get("whole")) else ""
    cpu = ", ".join(f"{name} {number(value)} s" for name, value in result["cpu_s"].items() if _finite(value))
    return [
        "# The hidden-effect challenge" + (" on rendered pictures" if rendered else ""),
        "",
        *intro_lines(result, cases, rendered=rendered),
        *(["", remark] if remark else []),
        "",
        f"![Found against size, and what was named]({picture})",
        "",
        f"## Acceptance\n\nShares {INTERVAL} (parameters: a bootstrap over cases), medians and means with bootstrap intervals.\n",
        *acceptance_lines(result),
        "",
        *(["## Every case", "", *case_lines(cases), ""] if rendered else []),
        "## Effects",
        "",
        "The limits of the table are the sizes that the score test finds in 95% of campaigns like the controls, each parameter alone. "
        "*Found in half* and *in 95%* are fitted to the challenge itself, in units of those limits.",
        "",
        *effect_lines(result, limits),
        "",
        *(fall_lines(result) if result.get("falls") else []),
        "## What was named",
        "",
        *confusion_lines(result),
        "",
        f"CPU time per campaign, median: {cpu} (*diagnose* is the part of *explain* up to the tests of all effects{whole}).",
        "",
        *(time_lines(times) if times is not None else []),
        *again_lines("challenge_rendered" if rendered else "challenge", rendered=rendered),
    ]


def intro_lines(result: Row, cases: pd.DataFrame, *, rendered: bool) -> list[str]:
    """What the campaigns are."""
    counts, shape = result["counts"], result["campaign"]
    campaign = f"{shape['sequences']} sequences × {shape['frames']} frames × {shape['views']} calibrated views"
    kinds = ", ".join(f"{counts[kind]} {words}" for kind, words in KINDS if kind in counts)
    ratios = cases.loc[cases["kind"] == "single", "ratio"].astype(float)
    if not rendered:
        return [
            f"Campaigns of one particle, {campaign}, silhouette tier, 0.2 px boundary noise; {kinds}. What is hidden, and how large it is, "
            "was drawn from a seed that the solver never sees; sizes of single effects run from "
            f"{number(ratios.min())} to {number(ratios.max())} times the 95% detection limit of the table, those of pairs from once. The "
            "solver reads observations alone."
        ]
    return [
        f"Campaigns of one particle, {campaign} (shown in whole drops of six); {kinds}. Every frame and every view is rendered: a matte "
        "particle before a back light, a thin lens, the exposure cut into sub-frames, sensor noise, 12 bit; the effect acts on light and "
        "pictures. The solver finds outlines in the pictures, and knows nothing else. What is hidden was drawn from a seed that "
        f"it never sees, one effect of every stage before a second of any; sizes run from {number(ratios.min())} to {number(ratios.max())} "
        "times the 95% detection limit of the table."
    ]


def case_lines(cases: pd.DataFrame) -> list[str]:
    """What was hidden and what was named, case by case; *limit of its own*: by the solver's information about that very campaign."""
    rows = []
    for case in cases.sort_values(["kind", "hidden"]).fillna({"hidden": "", "group": ""}).itertuples():
        right = (case.within_group or case.named_first) if case.kind == "single" else not case.false_alarm
        group = ", ".join(_words(key) for key in str(case.group).split("+") if key)
        sizes = [number(value) if _finite(value) else "–" for value in (case.ratio, case.own_ratio)]
        errors = f"{number(case.base_px)} → {number(case.final_px)}" if _finite(case.base_px) else "–"
        rows.append([_words(case.hidden or "nothing"), case.particle.replace("_", " "), *sizes, _words(case.first), group or "–", errors])
        rows[-1].append("yes" if right else "**no**")
    head = ["hidden", "particle", "size over the limit", "over the limit of its own", "named first", "alias group"]
    return table_lines([*head, "held-out RMS (px)", "right"], rows)


def again_lines(stem: str, *, rendered: bool) -> list[str]:
    """How to do it again."""
    tier = " --tier rendered" if rendered else ""
    page = f" --result docs/results/{stem}.json --page docs/studies/{stem}.md" if rendered else ""
    return [
        "## Again",
        "",
        "```sh",
        f"tumble challenge make{tier} --out out/{stem}",
        f"tumble challenge solve out/{stem} --out out/{stem}_answers",
        f"tumble challenge score out/{stem} out/{stem}_answers --out out/{stem}_score --result docs/results/{stem}.json",
        f"python -m scripts.acceptance.challenge_page{page}",
        "```",
        "",
        "`tumble challenge limits` makes the [table of limits](../results/detection_limits.json) anew. Results: [summary]"
        f"(../results/{stem}.json), [every case](../results/{stem}_cases.csv).",
    ]


KINDS = (
    ("single", "with one effect"),
    ("control", "with nothing hidden"),
    ("pair", "with two effects"),
    ("outside", "with something outside of the catalogue"),
)


def inputs(result: Path, limits: Path = TABLE) -> tuple[dict[str, Any], pd.DataFrame, dict[str, list[dict[str, Any]]]]:
    """A summary, the cases beside it, and the limits of every effect."""
    table, cases = read_table(limits), pd.read_csv(result.with_name(f"{result.stem}_cases.csv"))
    axes = {key: axis_limits(table, key, sequences=int(table.campaign["sequences"])) for key in table.effects}
    return json.loads(result.read_text(encoding="utf-8")), cases, axes


def times_beside(path: Path, result: Row) -> dict[str, Any] | None:
    """What the verb took on the slowest campaigns, where that was measured; not on rendered pictures."""
    timed = path.with_name(TIMES)
    if not timed.exists() or "rendered" in result["tiers"]:
        return None
    return dict(json.loads(timed.read_text(encoding="utf-8")))


def main() -> int:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--result", type=Path, default=Path("docs/results/challenge.json"))
    parser.add_argument("--page", type=Path, default=Path("docs/studies/challenge.md"))
    parser.add_argument("--limits", type=Path, default=TABLE)
    parser.add_argument("--remark", default="", help="what else is to be known of this run, as a paragraph of the page")
    arguments = parser.parse_args()
    result, cases, limits = inputs(arguments.result, arguments.limits)
    drawn, axes = figure(1, 2, (13.0, 6.5))
    if result["detection"]:
        draw_detection(axes[0, 0], cases, result["detection"][0])
    draw_confusion(axes[0, 1], result)
    drawn.tight_layout()
    picture = arguments.page.with_suffix(".png")
    write_figure(drawn, picture)
    times = times_beside(arguments.result, result)
    write_page(page_lines(result, cases, limits, picture.name, arguments.remark, times), arguments.page)
    print(arguments.page)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
