"""The page of Figure 5: errors of v and ω against length and epipolar tangency error, the paper's selection, and why what is wrong is."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import INTERVAL_95
from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import figure_5
from studies.reporting.figures import COLOURS, RED, figure, finish, plain_logarithmic
from studies.reporting.words import judged, number, paragraph, percent, share, table

LONG_FRAMES, LARGE_ETE_PX = 100, 1.5
"""The paper's selection: more frames than the first, a smaller epipolar tangency error than the second."""
TOLERANCE_PERCENT = 1.0
"""Of the speed, and of the spin: what is asked here. The paper has 1% of v and 10% of ω in most cases of its selection."""
PUBLISHED_ANGULAR_PERCENT = 10.0
ASKED = {"in_plane": 0.99, "out_of_plane": 0.90, "angular": 0.97}
"""Shares of the selection within the tolerance."""
TITLES = {"in_plane": "in-plane v", "out_of_plane": "out-of-plane v", "angular": "ω"}
OF = {"in_plane": COMPONENTS[:2], "out_of_plane": COMPONENTS[2:3], "angular": COMPONENTS[3:]}
WRONG_POSE_DEG = 5.0
UNEXPLAINED_SIGMAS = 3.0
"""An error of more stated standard deviations than this is not what its error bar says."""
DRAWN = {"n_frames": "frames", "speed_ms": "m/s", "spin_rads": "rad/s", "noise_px": "px"}
"""What differs from flight to flight, and its unit."""
SHORT_FRAMES = 50
DRAWS = 4000
"""Of errors at the bound, for each flight."""
LEAST_PERCENT = 1e-4
"""Where drawing begins."""


def selected(rows: pd.DataFrame) -> pd.DataFrame:
    """The paper's selection; an estimate that is no measurement has no ETE and is selected by its length, as one that is wrong."""
    return rows[(rows["n_frames"] > LONG_FRAMES) & ~(rows["rms_ete_px"] >= LARGE_ETE_PX)]


def within(rows: pd.DataFrame, quantity: str) -> np.ndarray:
    """Which flights were measured within the tolerance; what was not measured was not."""
    return (rows["converged"] & (rows[f"{quantity}_percent"] <= TOLERANCE_PERCENT)).to_numpy()


def with_bounds(rows: pd.DataFrame) -> pd.DataFrame:
    """Columns of the true body's bound: standard deviations (roots of summed variances) in per cent of the speed or of the spin."""
    sizes = {q: np.sqrt((rows[[f"true_bound_{c}" for c in components]] ** 2).sum(axis=1)) for q, components in OF.items()}
    of = {q: rows["spin_rads" if q == "angular" else "speed_ms"] for q in OF}
    return rows.assign(**{f"true_{q}_percent": 100.0 * sizes[q] / of[q] for q in OF})


def cause(row: pd.Series, quantity: str) -> str:
    """Why a quantity of a flight is outside the tolerance."""
    if not row["converged"]:
        return f"not measured: {row['status']}"
    if row["orientation_max_deg"] > WRONG_POSE_DEG:
        return "wrong pose"
    error, bound = row[f"{quantity}_percent"], row[f"true_{quantity}_percent"]
    if bound * INTERVAL_95 > TOLERANCE_PERCENT and error <= UNEXPLAINED_SIGMAS * bound:
        return "physical limit: even the true body's 95% interval is wider than 1%"
    if error <= UNEXPLAINED_SIGMAS * row[f"sigma_{quantity}_percent"]:
        return "the instrument's precision, as its error bar says"
    return "not explained by its error bar"


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = with_bounds(result.rows)
    chosen, few = selected(rows), rows["rms_ete_px"]
    return [
        "# Figure 5: velocities of random flights",
        *paragraph(
            f"{len(rows)} flights at 4000 frames/s of {', '.join(sorted(rows['particle'].unique()))}, with 60 calibrated views each,",
            f"measured from nothing: {', '.join(_range(rows, key, unit) for key, unit in DRAWN.items())} of boundary noise.",
            "The paper has 1200. Errors are those at mid-sequence, in per cent of the true speed and spin.",
            f"The epipolar tangency error (RMS) of these flights is {number(few.min())} to {number(few.max())} px:",
            f"the paper's second condition (< {LARGE_ETE_PX} px) leaves out {int((few >= LARGE_ETE_PX).sum())}.",
        ),
        "",
        "![Errors of v against length, of ω against the epipolar tangency error](figure_5.png)",
        "",
        "## The paper's selection",
        "",
        *paragraph(
            f"Flights of more than {LONG_FRAMES} frames with an epipolar tangency error below {LARGE_ETE_PX} px.",
            "One that was not measured counts as wrong. Intervals (95%, exact) say how much so many flights can tell.",
        ),
        "",
        *table(
            ("", f"within {TOLERANCE_PERCENT:g}%", "at the bound", "asked", "", "median", "bound (median σ)"),
            [_selection(chosen, q) for q in TITLES],
        ),
        "",
        *paragraph(
            "*At the bound*: share expected of an instrument that knows the true body and whose errors are those of its Cramér-Rao bound,",
            f"in these very flights, whose spins begin at {number(chosen['spin_rads'].min())} rad/s.",
        ),
        "",
        f"Within the paper's {PUBLISHED_ANGULAR_PERCENT:g}% of ω: {share(_within_published(chosen))}.",
        "",
        "## All flights",
        "",
        *table(("frames", "flights", "measured", *(f"{t} within 1%" for t in TITLES.values())), _by_length(rows)),
        "",
        "## What is outside, and why",
        "",
        *_outside(rows),
        "",
        "## Error bars",
        "",
        *_uncertainty(rows),
    ]


def _range(rows: pd.DataFrame, key: str, unit: str) -> str:
    return f"{number(rows[key].min())} to {number(rows[key].max())} {unit}"


def _selection(chosen: pd.DataFrame, quantity: str) -> list[str]:
    held = within(chosen, quantity)
    verdict = judged(held, ASKED[quantity])
    median, bound = chosen[f"{quantity}_percent"].median(), chosen[f"true_{quantity}_percent"].median()
    reached = f"{100 * at_the_bound(chosen, quantity):.1f}%"
    return [TITLES[quantity], share(held), reached, f"{ASKED[quantity]:.0%}", verdict, percent(median), percent(bound)]


def at_the_bound(rows: pd.DataFrame, quantity: str) -> float:
    """Share of flights expected within the tolerance where errors are normal with the true body's bound, axes as if uncorrelated."""
    size = rows["spin_rads" if quantity == "angular" else "speed_ms"].to_numpy(dtype=np.float64)
    sigma = rows[[f"true_bound_{c}" for c in OF[quantity]]].to_numpy(dtype=np.float64) / size[:, None]
    drawn = np.random.default_rng(0).normal(size=(DRAWS, *sigma.shape)) * sigma
    return float(np.mean(100.0 * np.linalg.norm(drawn, axis=2) <= TOLERANCE_PERCENT))


def _within_published(chosen: pd.DataFrame) -> np.ndarray:
    return (chosen["converged"] & (chosen["angular_percent"] <= PUBLISHED_ANGULAR_PERCENT)).to_numpy()


def _by_length(rows: pd.DataFrame) -> list[list[str]]:
    cells = []
    for low, high in ((10, 25), (26, 50), (51, 100), (101, 200)):
        own = rows[rows["n_frames"].between(low, high)]
        if len(own):
            shares = [f"{100 * within(own, quantity).mean():.0f}%" for quantity in TITLES]
            cells.append([f"{low}–{high}", str(len(own)), str(int(own["converged"].sum())), *shares])
    return cells


def _outside(rows: pd.DataFrame) -> list[str]:
    """Counts of causes, and a line for each flight of the selection that is outside."""
    chosen = set(selected(rows).index)
    causes: dict[str, dict[str, int]] = {}
    lines = []
    for quantity in TITLES:
        for index, row in rows[~within(rows, quantity)].iterrows():
            why = cause(row, quantity)
            counts = causes.setdefault(why, dict.fromkeys(TITLES, 0))
            counts[quantity] += 1
            if index in chosen:
                lines.append(_named(row, quantity, why))
    counted = [[why, *counts.values()] for why, counts in sorted(causes.items(), key=lambda each: -sum(each[1].values()))]
    told = table(("cause", *TITLES.values()), counted) if counted else ["Nothing is outside."]
    if not lines:
        return [*told, "", "Of the selection nothing is outside."]
    heads = ("flight", "particle", "frames", "m/s", "rad/s", "noise (px)", "what", "error", "stated σ", "bound σ", "cause")
    return [*told, "", "Of the selection:", "", *table(heads, lines)]


def _named(row: pd.Series, quantity: str, why: str) -> list[str]:
    about = [
        str(row["repetition"]),
        row["particle"],
        str(row["n_frames"]),
        *(number(row[key]) for key in ("speed_ms", "spin_rads", "noise_px")),
    ]
    figures = [percent(row[f"{kind}{quantity}_percent"]) for kind in ("", "sigma_", "true_")]
    return [*about, TITLES[quantity], *figures, why]


def _uncertainty(rows: pd.DataFrame) -> list[str]:
    """Coverage of intervals and efficiency against the true body's bound, by length."""
    measured = rows[rows["converged"]]
    short = measured["n_frames"] <= SHORT_FRAMES
    parts = (("all", measured), (f"up to {SHORT_FRAMES}", measured[short]), ("more", measured[~short]))
    cells = [_errors_over(name, own, quantity) for name, own in parts if len(own) for quantity in OF]
    whole = ", ".join(f"{title} {share(measured[f'ellipsoid95_{key}'] > 0)}" for key, title in (("v", "v"), ("omega", "ω")))
    return [
        *paragraph(
            "Over flights that were measured: share of components whose 95% interval holds the truth; root mean square of errors over",
            "stated standard deviations, and over those of the Cramér-Rao bound of the true body",
            "(1: nobody who knew the body could do better).",
        ),
        "",
        *table(("frames", "flights", "", "in 95%", "pull", "over the bound"), cells),
        "",
        f"Whole 95% ellipsoids that hold: {whole}.",
    ]


def _errors_over(name: str, own: pd.DataFrame, quantity: str) -> list[str]:
    """How often intervals hold, and errors over stated standard deviations and over the bound."""
    pulls, over = (own[[f"{kind}_{c}" for c in OF[quantity]]].to_numpy(dtype=np.float64) for kind in ("pull", "over_true_bound"))
    held, sizes = np.mean(np.abs(pulls) <= INTERVAL_95), [number(np.sqrt(np.mean(each**2))) for each in (pulls, over)]
    return [name, str(len(own)), TITLES[quantity], percent(100 * held), *sizes]


def picture(result: Result) -> Figure:
    """Errors of each axis of v against the length, of ω against the epipolar tangency error; crosses at the top: not measured."""
    rows = result.rows
    drawn, axes = figure(2, 2, (9.5, 6.6))
    for here, component in zip(axes.flat, (*COMPONENTS[:3], "angular"), strict=True):
        angular = component == "angular"
        x = "rms_ete_px" if angular else "n_frames"
        error = (
            rows["angular_percent"]
            if angular
            else 100 * rows[f"over_true_bound_{component}"] * rows[f"true_bound_{component}"] / rows["speed_ms"]
        )
        for regular, colour in zip((True, False), COLOURS, strict=False):
            own = (rows["regular"] == regular) & rows["converged"]
            here.plot(
                rows.loc[own, x],
                np.maximum(error[own], LEAST_PERCENT),
                "o",
                ms=3.5,
                mew=0,
                color=colour,
                alpha=0.75,
                label="regular" if regular else "irregular",
            )
        here.axhline(TOLERANCE_PERCENT, color=RED, lw=0.9, label="1%")
        if angular:
            here.axhline(PUBLISHED_ANGULAR_PERCENT, color="0.4", lw=0.9, ls="--", label="10% (paper)")
        else:
            here.axvline(LONG_FRAMES, color="0.6", lw=0.9)
        lost = rows.loc[~rows["converged"], x].fillna(rows["rms_ete_px"].max())
        if len(lost):
            here.plot(lost, np.full(len(lost), 0.97), "x", transform=here.get_xaxis_transform(), color=RED, ms=6, label="not measured")
        plain_logarithmic(here)
        here.set_xlabel("epipolar tangency error (px, RMS)" if angular else "frames")
        here.set_ylabel("error of ω (% of the spin)" if angular else f"error of {component[0]}$_{component[1]}$ (% of the speed)")
    finish(drawn)
    return drawn


STUDY = Study(
    "figure_5", "How well are velocities of random flights measured, by length and tangency error?", figure_5.PLAN, page, picture, __name__
)
