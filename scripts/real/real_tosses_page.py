"""The page on real tosses of a cube, written from its result file."""

import textwrap
from collections.abc import Mapping
from typing import Any

import numpy as np

Result = dict[str, Any]
GRAVITY_MS2, ODD_MS2 = 9.81, 0.25
TOLERANCE_MM = 0.1
"""Standard deviation that the half-width of the cube is stated with; its maker states none."""


def page(r: Result) -> list[str]:
    """Lines of the page."""
    return [*_opening(r), *_told(r), *_tests(r), *_outside(r), *_limits(r)]


def known_height(at_rest: Mapping[str, float]) -> str:
    """The height of the cube at rest as ``--known`` reads it: what it should be, and what was measured."""
    measured = f"{1e3 * at_rest['median']:.2f}mm±{1e3 * at_rest['sigma']:.2f}mm"
    return f"rest_height={1e3 * at_rest['half_width']:.1f}mm±{TOLERANCE_MM}mm measured {measured}"


def words(key: str) -> str:
    """An effect's key in words."""
    return key.replace("_", " ")


def _opening(r: Result) -> list[str]:
    return [
        "# Real tosses",
        "",
        f"{r['tosses']} tosses of an acrylic cube (half-width {1e3 * r['resting_height_m']['half_width']:.1f} mm) on to a board, poses by",
        "tag tracking at 148 Hz (Pfrommer, Halm and Posa 2020, BSD-3). Only poses are used, from the first row until the lowest corner is",
        f"3 mm above the board: {min(r['rows'])} to {max(r['rows'])} rows a toss, {sum(r['rows'])} in all, one campaign. Stated are",
        f"gravity, {GRAVITY_MS2} m/s², and three equal moments of inertia; no noise. Figures from",
        "[real_tosses.json](../results/real_tosses.json).",
        "",
        "![Acceleration of each toss, and held-out errors effect by effect](real_tosses.png)",
        "",
    ]


def _told(r: Result) -> list[str]:
    told = r["explained"]
    sigma = np.array(told["noise"])
    rungs = [f"| {_rung(each['added'])} | {each['rms']:.3f} σ | {_sure(told, each['added'])} |" for each in told["held_out"]]
    unknown = told["unknown"]
    last = [f"| + {words(unknown['family'])} | {unknown['rms']:.3f} σ | something unknown in the {unknown['stage']} |"] if unknown else []
    named = {each["added"] for each in told["names"]}
    stated = {step["added"] for step in told["steps"]}
    values = [
        f"| {words(v['effect'])} | {v['parameter']} {_value(v)} | {'' if v['effect'] in stated else 'not established'} |"
        for v in told["values"]
        if v["effect"] not in named
    ]
    for group in told["names"]:
        for name in group["names"]:
            many = ", ".join(f"{v['parameter']} {_value(v)}" for v in name["values"])
            values.append(f"| {words(name['effect'])} | {many} | one number; this name {_share(name['probability'])} |")
    each = [line for remark in told["scatter"] for line in (*_quoted(remark), "")]
    if each:
        each = ["Accelerations of every toss stand in the table where the unknown is not in the model:", "", *each]
    return [
        f"## What `tumble explain` says ({told['cpu_s']} s of CPU)",
        "",
        *_quoted(told["sentence"]),
        ">",
        *_quoted(told["limit"]),
        "",
        f"Noise is read off the rows: {1e6 * sigma[:3].min():.0f} to {1e6 * sigma[:3].max():.0f} µm a coordinate, "
        f"{1e3 * sigma[3:].min():.2f} to {1e3 * sigma[3:].max():.2f} mrad.",
        "",
        "| model | error on rows that were not fitted | effect or something in its place is there |",
        "| --- | --- | --- |",
        *rungs,
        *last,
        "",
        *each,
        "Values are those beside what is unknown:",
        "",
        "| | value | |",
        "| --- | --- | --- |",
        *values,
        "",
        "What the unknown in the tracking is, and why no drag is named, is in",
        "[real trajectories](real_trajectories.md#tosses-of-a-cube).",
        "",
    ]


def _tests(r: Result) -> list[str]:
    told = r["explained"]
    rows = [f"| {words(c['effect'])} | {c['share']:.0%} | {_p(c['p'])} | {c['log_odds']:+.1f} |" for c in told["first_tests"]]
    return [
        "## Each effect alone, beside free flight (`tumble diagnose`)",
        "",
        f"{len(rows)} effects apply; {len(told['not_applicable'])} do not. Share of what is to be explained; p, corrected for the number",
        "of candidates; log odds (nats) against free flight.",
        "",
        "| effect | share | p | log odds |",
        "| --- | --- | --- | --- |",
        *rows,
        "",
        "Every drag and lift has a share only because it, too, slows a fall down. None is in the model in the end.",
        "",
    ]


def _outside(r: Result) -> list[str]:
    height, beside = r["resting_height_m"], r["explained_beside_height"]
    fall, inner = -r["plain_fall_median_ms2"][2], -r["plain_fall_median_without_ends_ms2"][2]
    lines = [f"- {_names(group)}." for group in beside["names"]]
    for v in beside["values"]:
        if v["effect"] not in {group["added"] for group in beside["names"]}:
            lines.append(f"- {words(v['effect'])} {v['parameter']} {_value(v)}.")
    return [
        "## One number, three names",
        "",
        "In free flight lengths, clock and gravity change only the apparent gravity, `g (1 + r)^-2 / (1 + s)`: flights alone",
        "cannot distinguish them. Three measurements that are independent of the fit:",
        "",
        f"- A parabola through each toss falls with {fall:.3f} m/s² in the median, and with {inner:.3f} without the two rows at both",
        "  ends: neither hand nor board is the reason.",
        "- Gravity itself is hardly 2% weaker anywhere on Earth.",
        f"- The cube at rest has its middle {1e3 * height['median']:.2f} mm above the board (median; spread "
        f"{1e3 * height['spread']:.1f} mm), where its half-width is {1e3 * height['half_width']:.1f} mm:",
        f"  a ratio of {height['median'] / height['half_width']:.4f}, while the fall has {fall / GRAVITY_MS2:.4f}.",
        "",
        "**Positions that are 2% too short explain both**, a wrong clock only the fall (the board might also lie 1 mm beside z = 0, which",
        "nobody measured). The tool takes that height as a fact. What it says with",
        "",
        f"    --known '{known_height(height)}'",
        "",
        *_quoted(beside["sentence"]),
        ">",
        *_quoted(beside["limit"]),
        "",
        *lines,
        "",
    ]


def _limits(r: Result) -> list[str]:
    sigma = np.array(r["explained"]["noise"])
    return [
        "## What not to believe",
        "",
        f"- P-values near zero come from noise of {1e6 * sigma[:3].mean():.0f} µm: at this precision every tracker has systematic errors",
        "  of its own (tags move with the view, positions may have been smoothed upstream).",
        "- Some tosses do not fall like the others:",
        f"  {_odd(r)}.",
        "  Whether a hand, the board or the tracker is the reason the poses do not say. They are in all figures above; far residuals have",
        "  a bounded say in fits.",
        "- Noise is taken to be the same in all tosses; it is not quite.",
        "- Impacts of the same tosses put the centre of mass on the same axis: [real impacts](real_impacts.md).",
        "",
        "## Again",
        "",
        "```sh",
        "python -m scripts.real.real_tosses --tosses FOLDER",
        "```",
        "",
    ]


def _odd(r: Result) -> str:
    falls = -np.array(r["plain_falls_ms2"])[:, 2]
    odd = np.flatnonzero(np.abs(falls - np.median(falls)) > ODD_MS2)
    return ", ".join(f"number {i} with {falls[i]:.2f} m/s² ({r['rows'][i]} rows)" for i in odd) or "none is odd"


def _quoted(text: str) -> list[str]:
    return [f"> {line}" for line in textwrap.wrap(text, 136)]


def _rung(added: str | None) -> str:
    return "free flight" if added is None else f"+ {words(added)}"


def _sure(told: Result, added: str | None) -> str:
    return next((f"{100.0 * step['sure']:.1f} %" for step in told["steps"] if step["added"] == added), "")


def _share(probability: float) -> str:
    return "< 1 %" if probability < 0.01 else f"{100.0 * probability:.0f} %"


def _names(group: Result) -> str:
    return " or ".join(
        f"{words(name['effect'])} {', '.join(_value(v) for v in name['values'])} ({_share(name['probability'])})" for name in group["names"]
    )


def _p(value: float) -> str:
    return "< 1e-16" if value < 1e-16 else f"{value:.1g}"


def _value(v: Result) -> str:
    value, sigma, unit = v["value"], v["sigma"], v["unit"]
    if unit == "m":
        value, sigma, unit = 1e3 * value, 1e3 * sigma, "mm"
    elif unit == "1":
        value, sigma, unit = 100.0 * value, 100.0 * sigma, "%"
    else:
        unit = unit.replace("m/s2", "m/s²")
    return f"{value:+.3f} ± {sigma:.3f} {unit}"
