"""The page on real impacts of a cube, written from its result file."""

from collections.abc import Sequence
from typing import Any

import numpy as np

Result = dict[str, Any]
AXES = {
    "approach_ms": "normal speed of the contact point",
    "sliding_ms": "its sliding speed",
    "next_corner_m": "height of the next corner",
    "number": "number of the impact in its toss",
    "angle_deg": "angle of arrival from the normal",
}
QUANTITIES = {"restitution": "e", "impulse_ratio": "impulse ratio"}
TELLING_P = 1e-3
MEDIAN_DISTANCE2 = 5.348
"""Median of chi-squared with six degrees of freedom."""


def page(r: Result) -> list[str]:
    """Lines of the page."""
    return [*_opening(r), *_usable(r), *_cube(r), *_contacts(r), *_models(r), *_failures(r), *_several(r), *_limits(r), *_table(r)]


def _opening(r: Result) -> list[str]:
    return [
        "# Real impacts",
        "",
        f"{r['tosses']} tosses of an acrylic cube ({1e3 * r['half_width_m']:.1f} mm half-width, {r['mass_kg']} kg) on to a "
        f"board, from hand "
        "to rest, poses by tag tracking at 148 Hz (Pfrommer, Halm and Posa 2020, BSD-3). `tumble estimate` on such trajectories finds the "
        "free flights, fits them, and joins two of them at one pose and a continuous time wherever at most three rows lie between them; "
        "nothing is told to it of the board. Contact models are then fitted and judged as `tumble validate-contact` does it, five parts of "
        "the tosses held out in turn. Lengths are multiplied by "
        f"{r['scale']:.4f}, so that the cube at rest has its half-width ([real tosses](real_tosses.md) tells why). Figures from "
        "[real_impacts.json](../results/real_impacts.json), written by `python -m scripts.real.real_impacts --tosses FOLDER` "
        "(some five minutes of CPU).",
        "",
        "![Restitution and impulse ratio of every clear impact, and held-out errors of the models](real_impacts.png)",
        "",
    ]


def _usable(r: Result) -> list[str]:
    statuses = ", ".join(f"{count} {status}" for status, count in r["statuses"].items())
    numbers = ", ".join(str(each["toss"]) for each in r["refused"])
    return [
        "## How many tosses have an impact that can be used?",
        "",
        f"**{r['tosses_with_impact']} of {r['tosses']}** tosses have at least one impact with the board between two free flights "
        f"({r['impacts']} impacts in all), **{r['tosses_with_clear_impact']}** at least one *clear* one ({r['clear_impacts']} "
        f"in all): no row "
        "in contact, and all parts of the impulse at one time, to a tenth of a frame (0.7 ms). In "
        f"{r['first_impact_clear']} tosses it is the first one. Statuses: {statuses}. "
        f"{r['not_at_the_board']} more were found in the air: a hand that lets go late.",
        "",
        f"Refused: tosses {numbers}. In each the instrument says which rows are no free flight: the cube tumbles on over edges and faces, "
        "keeps contact, or slides to rest after its first hit. Clear impacts come early: after two or three of them every toss ends in "
        "tens of rows of rolling and rest, which are told and not measured.",
        "",
        f"The other {r['impacts'] - r['clear_impacts']} impacts have rows in contact, or parts of the impulse apart in time by "
        f"{1e3 * min(e['spread_s'] for e in r['unclear']):.1f} to {1e3 * max(e['spread_s'] for e in r['unclear']):.0f} ms: two corners one "
        "after the other. Their uncertainties are widened by that; they are judged apart, below.",
        "",
    ]


def _cube(r: Result) -> list[str]:
    first, last = r["passes"][0], r["passes"][-1]
    side2 = (2.0 * r["half_width_m"]) ** 2
    centre = 1e3 * (np.array(last["centre_m"]) + np.array(last["shift_m"]))
    before, after = r["falls"][0], r["falls"][-1]
    below = "below" if last["board_m"] < 0 else "above"
    return [
        "## What the impacts say of the cube itself",
        "",
        "- **Its edges are round.** Where flights meet, the lowest corner of a sharp cube would be up to 4 mm inside the board, that of "
        f"an edge half as deep. A radius of {1e3 * last['rounding_m']:.1f} mm on all edges explains it to "
        f"{1e3 * last['height_rms_m']:.2f} mm (RMS), with a board {1e3 * abs(last['board_m']):.1f} mm {below} where resting cubes have it. "
        "Such a cube touches a plane with one of eight spheres, whatever its orientation: contact points below are theirs.",
        "- **Its centre of mass is not in its middle.** Spin changes by lever × impulse only if it lies at "
        f"({centre[0]:.1f}, {centre[1]:.1f}, {centre[2]:.1f}) ± {1e3 * last['shift_sigma_m'][2]:.1f} mm in the tags' frame. Free flight "
        f"agrees, which knows nothing of impacts: that point falls with {after['median_ms2']:.3f} m/s², with a scatter of "
        f"{after['scatter_ms2']:.3f} from toss to toss; the cube's middle with {before['median_ms2']:.3f} and a scatter of "
        f"{before['scatter_ms2']:.3f}. By flights alone [`tumble explain`](real_tosses.md) names a centre of mass at "
        f"{1e3 * r['centre_of_free_flight_m']:.1f} mm along the same axis.",
        f"- **It is neither solid nor a shell.** Inertia over mass is {1e6 * last['kappa_m2']:.0f} ± "
        f"{1e6 * last['kappa_sigma_m2']:.0f} mm² "
        f"(± {1e6 * first['kappa_sigma_m2']:.0f} before the centre of mass was known); a solid cube would have "
        f"{1e6 * side2 / 6:.0f}, a thin "
        f"shell {1e6 * side2 * 5 / 18:.0f}. Angular impulse and lever × impulse then correlate by {last['agreement']:.3f} over all clear "
        "impacts.",
        "",
    ]


def _without(r: Result) -> str:
    """The clear impacts that no model is judged by."""
    left = r["clear_impacts"] - r["judged_impacts"]
    return f" (all but {left}, in which another corner strikes within half a millisecond)" if left else ""


def _median(rows: Sequence[Result], key: str) -> str:
    values = np.array([e[key][0] if isinstance(e[key], list) else e[key] for e in rows])
    low, high = np.quantile(values, [0.16, 0.84])
    return f"{np.median(values):.3f} ({low:.3f} to {high:.3f})"


def _contacts(r: Result) -> list[str]:
    rows = r["clear"]
    groups = [("first impacts", [e for e in rows if e["number"] == 0]), ("later ones", [e for e in rows if e["number"] > 0])]
    table = [
        f"| {name} | {len(each)} | {np.median([e['approach_ms'] for e in each]):.2f} | {_median(each, 'restitution')} | "
        f"{_median(each, 'impulse_ratio')} | {_median(each, 'energy_lost')} |"
        for name, each in groups
    ]
    told = [t for t in r["trends"] if t["p"] < TELLING_P]
    said = [f"- {QUANTITIES[t['quantity']]} and {AXES[t['axis']]}: rank correlation {t['rank']:+.2f} (p {_p(t['p'])})." for t in told]
    sigma = np.median([e["restitution"][1] for e in rows]), np.median([e["impulse_ratio"][1] for e in rows])
    timing = np.median([e["time_sigma_s"] for e in rows]) * 148.0
    speed = np.median([e["sigma_v_after_ms"] for e in rows]), np.median([e["sigma_omega_after_rads"] for e in rows])
    return [
        "## The contacts measured",
        "",
        "Medians, and where two thirds of the impacts lie. e is Stronge's, the impulse ratio tangential over normal.",
        "",
        "| | impacts | normal speed, m/s | e | impulse ratio | energy lost |",
        "| --- | --- | --- | --- | --- | --- |",
        *table,
        "",
        f"Of one impact the time is known to {timing:.3f} frames, v after it to {1e3 * speed[0]:.0f} mm/s and ω to {speed[1]:.2f} rad/s a "
        f"component, hence e to {sigma[0]:.3f} and the ratio to {sigma[1]:.3f} (medians of the standard deviations). What e and "
        f"ratio follow:",
        "",
        *(said or ["- nothing, beyond chance."]),
        "",
    ]


def _models(r: Result) -> list[str]:
    whole = r["changes"]["judged"]
    rows = [f"| {m['model']} | {_values(m)} | {_of(m['held_out'], whole)} | {_misfit(m):.1f} | {_behind(m)} |" for m in r["models"]]
    kinds = [
        f"| {m['model']} | {_of(m['by_kind']['corner'], whole)} | {_of(m['by_kind']['edge'], whole)} |"
        for m in r["models"]
        if {"corner", "edge"} <= set(m["by_kind"])
    ]
    rungs = [
        f"| {rung['added']} | {_gain(rung['gain'])} | {'yes' if rung['accepted'] else 'no'} | "
        f"{', '.join(f'{_name(n)} {v:.3f}' for n, v, _ in rung['values'])} |"
        for rung in r["ladder"]
    ]
    return [
        "## Contact models on held-out tosses",
        "",
        f"Errors of v and ω after {r['judged_impacts']} clear impacts{_without(r)} of tosses that the values were not fitted to, RMS, and "
        f"over the RMS change "
        f"at an impact ({whole['v_rms']:.2f} m/s, {whole['omega_rms']:.1f} rad/s). *Misfit* is in standard deviations of what both "
        "measurements, before and after, leave open (median; 1: as good as can be measured). *Behind* is the loss of the log score against "
        "the best, with its 95% interval over tosses.",
        "",
        "| model | values | v, m/s | ω, rad/s | misfit | behind |",
        "| --- | --- | --- | --- | --- | --- |",
        *rows,
        "",
        "The same for corners that strike and for the few clear impacts of an edge that lies flatter than 1.6°:",
        "",
        "| model | corners: v, m/s | ω, rad/s | edges: v, m/s | ω, rad/s |",
        "| --- | --- | --- | --- | --- |",
        *kinds,
        "",
        "The ladder (`tumble validate-contact`): what physics has to be added to a frictionless impulse?",
        "",
        "| added | gain of the log score (95%; chance) | accepted | values |",
        "| --- | --- | --- | --- |",
        *rungs,
        "",
        f"**{r['verdict']['sentence']}**",
        "",
    ]


def _values(model: Result) -> str:
    return ", ".join(f"{_name(n)} {v:.3f} ± {s:.3f}" for n, v, s in model["values"])


def _of(errors: Result, whole: Result) -> str:
    """Two cells: RMS errors and what they are of the changes."""
    v, omega = errors["v_rms"], errors["omega_rms"]
    return f"{v:.3f} ({v / whole['v_rms']:.0%}) | {omega:.2f} ({omega / whole['omega_rms']:.0%})"


def _misfit(model: Result) -> float:
    return float(np.sqrt(model["median_distance2"] / MEDIAN_DISTANCE2))


def _name(parameter: str) -> str:
    return {"restitution": "e", "friction": "μ"}.get(parameter, parameter.replace("_", " "))


def _behind(model: Result) -> str:
    if model["behind"] is None:
        return "best"
    total, low, high = (0.5 * v for v in model["behind"])
    return f"{total:.1f} ({low:.1f} to {high:.1f})"


def _gain(gain: Sequence[float] | None) -> str:
    if gain is None:
        return ""
    total, low, high, chance = (0.5 * v for v in gain)
    return f"{total:+.1f} ({low:+.1f} to {high:+.1f}; {chance:.1f})"


def _model(r: Result, title: str) -> Result:
    return next(m for m in r["models"] if m["model"] == title)


RIGID, SOFT, SPHERE, SMOOTH = (
    "Mirtich–Stronge impulse",
    "Hertz–Mindlin at the corner",
    "sphere of the same volume",
    "frictionless impulse",
)


def _ladder_words(r: Result) -> str:
    """What the ladder added to Coulomb friction, and how much that is in errors."""
    first, later = (np.median([e["restitution"][0] for e in r["clear"] if (e["number"] == 0) == at]) for at in (True, False))
    seen = f"e is {first:.2f} in the first, fast impacts of a toss and {later:.2f} in later, slower ones (medians)"
    added = [rung["added"] for rung in r["ladder"][2:] if rung["accepted"]]
    if not added:
        return f"- {seen[0].upper()}{seen[1:]}; no addition of the ladder predicts held-out tosses better for it."
    rigid, best = _model(r, RIGID)["held_out"]["v_rms"], r["models"][0]["held_out"]["v_rms"]
    return (
        f"- The ladder adds {' and '.join(added)} to the rigid impulse. What it has seen is that {seen}: a board that recoils, "
        f"an e that falls "
        f"with speed, and edges that touch at a second corner would each do that. It is a small matter: the RMS error of v goes from "
        f"{rigid:.3f} to {best:.3f} m/s, while the misfit stays."
    )


def _failures(r: Result) -> list[str]:
    rigid, soft, ball, smooth = (_model(r, title) for title in (RIGID, SOFT, SPHERE, SMOOTH))
    whole = r["changes"]["judged"]
    odd = sum(e["one_contact_p"] < 1e-4 for e in r["clear"])
    missed = [f"{smooth['held_out'][k] / whole[k]:.0%}" for k in ("v_rms", "omega_rms")]
    corners = [f"{m['by_kind']['corner']['v_rms']:.3f} m/s and {m['by_kind']['corner']['omega_rms']:.2f} rad/s" for m in (rigid, soft)]
    return [
        "## Where each fails",
        "",
        f"- **Frictionless**: misses {missed[0]} of the change of v and {missed[1]} of that of ω, and its e goes to the lower "
        f"bound to make "
        "up for it. The cube slides through most impacts, and friction turns it.",
        f"- **Sphere of the same volume**: in ω {ball['held_out']['omega_rms'] / whole['omega_rms']:.0%} of the change itself "
        f"({ball['held_out']['omega_rms']:.2f} rad/s; a frictionless cube {smooth['held_out']['omega_rms']:.2f}): a sphere has "
        f"no lever for "
        "the normal impulse, which is what spins a cube up.",
        f"- **Mirtich–Stronge impulse** and **Hertz–Mindlin** at the rounded corner leave {corners[0]}, and {corners[1]}, where corners "
        "strike: one e and one μ carry over from toss to toss, and the two laws hardly differ where contacts slide to their "
        "end. Neither is "
        "right to the precision of the measurement: they miss by "
        f"{_misfit(rigid):.1f} and {_misfit(soft):.1f} times what it leaves open.",
        "- **Where an edge lands nearly flat** one point is the wrong picture: an edge gets its impulse at both ends, the "
        "models give it all to one of them. Most such impacts are not clear: they are [below](#several-contacts-in-one-impact).",
        f"- In {odd} of {r['clear_impacts']} clear impacts the jumps of v and ω do not belong to one impulse at the point of contact "
        "(p < 1e-4): no choice of e and μ, nor any law of one contact, can mend that. Either the point is elsewhere, by a "
        "millimetre or so, "
        f"or an impulse has a moment of its own. Cubes at rest have tracked axes that are {r['rest']['tilt_deg']:.1f}° off the "
        f"board (RMS), "
        f"and heights that scatter by {1e3 * r['rest']['height_sigma_m']:.1f} mm: shape, board and tags are not known better.",
        _ladder_words(r),
        "",
    ]


def _several(r: Result) -> list[str]:
    clear, rest = r["changes"]["clear"], r["changes"]["several_contacts"]
    kinds = {kind: sum(e["kind"] == kind for e in r["unclear"]) for kind in ("corner", "edge", "face")}
    next_mm = 1e3 * np.median([e["next_corner_m"] for e in r["unclear"] if e["kind"] == "corner"])
    rows = [f"| {m['model']} | {_values(m)} | {_of(m['clear'], clear)} | {_of(m['several_contacts'], rest)} |" for m in r["all"]]
    return [
        "## Several contacts in one impact",
        "",
        f"{len(r['unclear'])} impacts are not clear: {kinds['edge']} of an edge nearly flat on the board, {kinds['face']} of a face, "
        f"{kinds['corner']} of a corner with the next one {next_mm:.0f} mm higher in the median. All {r['impacts']} impacts together, held "
        "out by toss as before, RMS and over the RMS change of each kind. The last model is Hertz–Mindlin on the eight spheres that the "
        "rounded cube touches with, followed until none has touched for 30 ms:",
        "",
        "| model | values | clear: v, m/s | ω, rad/s | several contacts: v, m/s | ω, rad/s |",
        "| --- | --- | --- | --- | --- | --- |",
        *rows,
        "",
        _verdict_on_several(r),
        "",
    ]


def _verdict_on_several(r: Result) -> str:
    one, eight = r["all"][1], r["all"][-1]
    ratio = one["several_contacts"]["omega_rms"] / eight["several_contacts"]["omega_rms"]
    medians = [one["several_contacts"][k] for k in ("v_median", "omega_median")]
    better = [eight["several_contacts"][k] for k in ("v_median", "omega_median")]
    return (
        f"**This is where shape matters most.** A law of one contact stops when the first corner leaves, while the spin that it "
        f"made brings "
        f"the next one down within a frame or two: half of these impacts are missed by more than {medians[0]:.2f} m/s and "
        f"{medians[1]:.1f} rad/s. The same law on all corners, with one e and one μ for everything, has medians of {better[0]:.3f} m/s and "
        f"{better[1]:.2f} rad/s, and an RMS {ratio:.1f} times smaller in ω. What it misses still are impacts that last two or "
        f"three frames, "
        "in which gravity acts as well, and whose pose at the impact is not one pose."
    )


def _limits(r: Result) -> list[str]:
    return [
        "## What not to believe",
        "",
        "- Impacts are judged by impulses, not by forces: at 148 Hz a contact of half a millisecond has no inside. Stiffnesses "
        "are those of "
        "acrylic on wood, and hardly matter.",
        "- Radius of the edges, centre of mass and inertia come from the same impacts that the models are judged by: six numbers "
        f"from {6 * r['judged_impacts']}, common to all models.",
        "- Clear impacts are a choice: those with one contact. Of all contacts of a tumbling cube they are the first ones and the few.",
        "- e of slow or grazing impacts is poorly known; where an edge lies flat on the board the one point that stands for it "
        "is arbitrary.",
        f"- Residuals of heights ({1e3 * r['passes'][-1]['height_rms_m']:.2f} mm) say how well the shape is known; no better "
        f"shape was sought.",
        "",
    ]


def _table(r: Result) -> list[str]:
    rows = [
        f"| {e['toss']} | {e['number'] + 1} | {e['time_s']:.4f} ± {e['time_sigma_s']:.4f} | {e['kind']} | {_place(e['point_body_m'])} | "
        f"{e['approach_ms']:.2f} | {e['sliding_ms']:.2f} | {_with(e['restitution'])} | {_with(e['impulse_ratio'])} | "
        f"{e['energy_lost']:.2f} | "
        f"{_p(e['one_contact_p'])} |"
        for e in r["clear"]
    ]
    return [
        "## Every clear impact",
        "",
        "Point of contact from the centre of mass in the tags' frame; p that v and ω jump by one impulse there.",
        "",
        "| toss | impact | time, s | touches with | point, mm | normal speed, m/s | sliding, m/s | e | impulse ratio | energy lost | p |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
        *rows,
    ]


def _place(point: Sequence[float]) -> str:
    return ", ".join(f"{1e3 * v:+.0f}" for v in point)


def _with(pair: Sequence[float]) -> str:
    return f"{pair[0]:.3f} ± {pair[1]:.3f}"


def _p(p: float) -> str:
    return "< 1e-16" if p < 1e-16 else f"{p:.1g}"
