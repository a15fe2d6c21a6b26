"""The page on real tosses of a cube, written from its result file."""

from collections.abc import Sequence
from typing import Any

import numpy as np

Result = dict[str, Any]
GRAVITY_MS2, ODD_MS2 = 9.81, 0.25


def page(r: Result) -> list[str]:
    """Lines of the page."""
    return [*_opening(r), *_noise(r), *_candidates(r), *_explained(r), *_cause(r), *_limits(r)]


def _opening(r: Result) -> list[str]:
    return [
        "# Real tosses",
        "",
        f"{r['tosses']} tosses of an acrylic cube (half-width {1e3 * r['resting_height_m']['half_width']:.1f} mm) on to a board, "
        "poses by tag "
        "tracking at 148 Hz (Pfrommer, Halm and Posa 2020, BSD-3). Only poses are used, from the first row until the lowest corner "
        "is 3 mm above "
        f"the board: {min(r['rows'])} to {max(r['rows'])} rows a toss, {sum(r['rows'])} in all, one campaign. The model: free "
        "flight of a body with "
        f"isotropic inertia under {GRAVITY_MS2} m/s², the tracked point its centre of mass. Noise is not stated, so it is "
        "estimated. Figures from "
        "[real_tosses.json](../results/real_tosses.json), written by `python -m scripts.real.real_tosses --tosses FOLDER`; the same "
        "files go through "
        "`tumble compare`, `diagnose` and `explain`.",
        "",
        "![Acceleration of each toss, and held-out errors model by model](real_tosses.png)",
        "",
    ]


def _noise(r: Result) -> list[str]:
    noise, floor = r["noise"], r["floor"]
    sigma = np.array(noise["sigma"])
    repeats = np.array(noise["repeats"])
    return [
        "## Is there anything to explain?",
        "",
        f"Yes. Positions repeat to {1e6 * sigma[:3].min():.0f} to {1e6 * sigma[:3].max():.0f} µm a coordinate, orientations to "
        f"{1e3 * sigma[3:].min():.2f} to {1e3 * sigma[3:].max():.2f} mrad. The noise is not new in every row: it counts as alike over "
        f"{repeats.min():.1f} to {repeats.max():.1f} rows, which weights and p-values allow for. It has heavy tails, too: what "
        "changes from row "
        f"to row is {floor['noise']:.2f} times the estimate, from which far residuals are clipped. Residuals of free flight are "
        f"{floor['rms']:.2f} "
        f"times it, reduced chi-square {floor['reduced']:.2f} (95%: {floor['interval'][0]:.2f} to {floor['interval'][1]:.2f}).",
        "",
        "What the maps of residuals say, the strongest of each axis:",
        "",
        *(f"- {sentence}" for sentence in r["maps"][:3]),
        "",
        "Early and late rows lie above the model's path and those between below it: **the cube falls more slowly than it should**.",
        "",
    ]


def _candidates(r: Result) -> list[str]:
    rows = [
        f"| {c['effect'].replace('_', ' ')} | {c['columns'] or 1} | {c['share']:.0%} | {_p(c['p'])} | {_values(c['values'])} |"
        for c in r["diagnosis"]["candidates"]
    ]
    return [
        "## Which effect is missing? (`tumble diagnose`)",
        "",
        f"{len(rows)} effects apply; {len(r['not_applicable'])} act on pictures and are not on trial. p is corrected for the number "
        "of candidates.",
        "",
        "| effect | parameters | share of the excess | p | first look at its values |",
        "| --- | --- | --- | --- | --- |",
        *rows,
        "",
        "`drag`, `magnus lift` and the like share in the excess only because they, too, slow a fall down; their values would not be "
        "believed "
        "for a cube of 0.37 kg (quadratic drag of a cube this size in air: about 0.02 per metre).",
        "",
    ]


def _explained(r: Result) -> list[str]:
    told, shared = r["explained"], r["explained_with_shared_effects"]
    own = {axis: np.array([v["value"] for v in told["values"] if v["parameter"] == f"a_{axis}"]) for axis in "xyz"}
    scatter = ", ".join(f"{axis} {a.mean():+.3f} ± {a.std():.3f}" for axis, a in own.items() if len(a))
    return [
        "## What explaining it ends with (`tumble explain`)",
        "",
        *_steps(r["held_out_base"], told),
        "",
        f"One acceleration for each toss, beside gravity, brings the error on rows that were not fitted from {r['held_out_base']:.2f} to "
        f"{told['steps'][0]['after']:.2f} σ. "
        f"Mean and scatter of these accelerations over the tosses: {scatter} m/s². {_left(told['left'])}",
        "",
        "Without that effect among the candidates, so that only causes common to all tosses are left:",
        "",
        *_steps(r["held_out_base"], shared),
        "",
        f"Values then: {_fitted(shared['values'])}. {_left(shared['left'])}",
        "",
    ]


def _left(left: Result) -> str:
    """What is said of something unknown."""
    if not left["present"]:
        return "Then nothing more is missing."
    beside = (
        ", which is what differs from toss to toss: their accelerations go with their velocities" if left["stage"] == "tracking" else ""
    )
    return (
        f"Something unknown is missing at the stage of {left['stage']} (p {_p(left['p'])}){beside}. No fit of these has it in it; what "
        "it is, is in [real trajectories](real_trajectories.md#tosses-of-a-cube)."
    )


def _cause(r: Result) -> list[str]:
    scale = next(a for a in r["alone"] if a["effect"] == "length_scale")["values"][0]
    rate = next(a for a in r["alone"] if a["effect"] == "frame_rate")["values"][0]
    gravity = next(v for v in next(a for a in r["alone"] if a["effect"] == "gravity")["values"] if v["parameter"] == "dg_z")
    height = r["resting_height_m"]
    fall, inner = -r["plain_fall_median_ms2"][2], -r["plain_fall_median_without_ends_ms2"][2]
    rows = [f"| {a['effect'].replace('_', ' ')} | {_fitted(a['values'])} | {a['held_out']:.2f} σ |" for a in r["alone"]]
    return [
        "## The common part: three names for one number",
        "",
        "Each effect alone, fitted, and the error on what was not fitted:",
        "",
        "| effect | values | held-out RMS |",
        "| --- | --- | --- |",
        f"| none | | {r['held_out_base']:.2f} σ |",
        *rows,
        "",
        f"Gravity {gravity['value']:+.3f} m/s² along z, lengths wrong by {scale['value']:+.2%} or a frame rate {rate['value']:+.2%} "
        "off predict equally "
        "well, and in free flight they are confounded: all three only change how large gravity looks, `g (1 + r)^-2 / (1 + s)`. The "
        "tool says so "
        "of frame rate and lengths; gravity, which may also turn, pays for two parameters more.",
        "",
        f"Three looks from outside. A parabola through each toss, without any of this machinery, falls with {fall:.3f} m/s² in the "
        "median, and with "
        f"{inner:.3f} without the two rows at both ends, so neither hand nor board is the reason. Gravity itself is hardly 2% "
        "weaker anywhere on "
        f"Earth. And the cube at rest has its middle {1e3 * height['median']:.2f} mm above the board (median; spread "
        f"{1e3 * height['spread']:.1f} mm), where its "
        f"half-width is {1e3 * height['half_width']:.1f} mm: a ratio of {height['median'] / height['half_width']:.4f}, while the "
        f"fall has {fall / GRAVITY_MS2:.4f}. "
        "**Positions that are 2% too short explain both**, a wrong frame rate only the fall (the board might also lie 1 mm beside z = 0, "
        "which nobody measured). The tool cannot decide this from flight alone; a known length in the scene speaks for the lengths.",
        "",
    ]


def _limits(r: Result) -> list[str]:
    sigma = np.array(r["noise"]["sigma"])
    return [
        "## What not to believe",
        "",
        f"- P-values near zero come from noise of {1e6 * sigma[:3].mean():.0f} µm: at this precision every tracker has systematic "
        "errors of its own "
        "(tags move with the view, positions may have been smoothed upstream), and an acceleration for each toss takes up whatever "
        "is smooth.",
        f"- Some tosses do not fall like the others: {_odd(r)}. Whether a hand, the board or the tracker is the "
        "reason the poses do not say. They are in all figures above; far residuals have a bounded say in fits, and the medians hardly any.",
        "- Noise is taken to be the same in all tosses; it is not quite. Its tails make p-values of weak effects too small, so the "
        "small steps "
        "(centre of mass, inertia ratios) are not findings here. The impacts of the same tosses, however, put the centre of mass on the "
        "same axis: see [real impacts](real_impacts.md).",
        "- Drag of such a cube in air (about 0.03 m/s² at 1.3 m/s) hides below the scatter from toss to toss, and beside a "
        "warped volume: it is not measured.",
        "- A controlled trial of the same machinery on made trajectories with hidden drag, gravity or centre of mass is in the "
        "tests, with its "
        "false alarms counted.",
        "",
    ]


def _odd(r: Result) -> str:
    falls = -np.array(r["plain_falls_ms2"])[:, 2]
    odd = np.flatnonzero(np.abs(falls - np.median(falls)) > ODD_MS2)
    return ", ".join(f"number {i} with {falls[i]:.2f} m/s² ({r['rows'][i]} rows)" for i in odd) or "none is odd"


def _outcome(step: Result) -> str:
    """What became of a step, in results of this judge and of the one before."""
    return f"probability {step['probability']:.3f}" if "probability" in step else "accepted" if step["accepted"] else "refused"


def _steps(base: float, told: Result) -> list[str]:
    lines = ["| model | held-out RMS | |", "| --- | --- | --- |", f"| free flight | {base:.3f} σ | |"]
    for step in told["steps"]:
        others = [key.replace("_", " ") for key in step["group"] if key != step["added"]]
        alike = f"; cannot be told from {', '.join(others)}" if others else ""
        lines.append(f"| + {step['added'].replace('_', ' ')} | {step['after']:.3f} σ | {_outcome(step)}{alike} |")
    return lines


def _p(value: float) -> str:
    return "< 1e-16" if value < 1e-16 else f"{value:.1g}"


def _values(values: Sequence[Result]) -> str:
    return ", ".join(f"{v['parameter']} {v['value']:.3g} ± {v['sigma']:.1g}" for v in values) or "one set for each toss"


def _fitted(values: Sequence[Result]) -> str:
    return ", ".join(f"{v['effect'].replace('_', ' ')} {v['parameter']} {v['value']:.4g} ± {v['sigma']:.1g}" for v in values)
