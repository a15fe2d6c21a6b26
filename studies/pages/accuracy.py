"""The page of accuracy: relative errors of whole measurements and whether error bars hold, of outlines, matte bodies and diamond."""

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from datasets.scoring.metrics import COMPONENTS
from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import accuracy
from studies.plans.accuracy import DIAMOND, MATTE, OUTLINES
from studies.reporting.figures import COLOURS, RED, figure, plain_logarithmic
from studies.reporting.medians import QUANTITIES, Quantity, lost_in_words
from studies.reporting.words import number, paragraph, percent, share, table

ASKED = {
    OUTLINES: {"in_plane": 0.02, "out_of_plane": 0.08, "angular": 0.07},
    MATTE: {"in_plane": 0.04, "out_of_plane": 0.15, "angular": 0.10},
    DIAMOND: {"out_of_plane": 0.5, "angular": 0.3},
}
"""Medians that are asked for, in per cent of the true speed and spin."""
HELD = {OUTLINES: (92.0, 98.0), MATTE: (90.0, 100.0), DIAMOND: (85.0, 100.0)}
"""Shares of 95% ellipsoids that are to hold the truth, per cent."""
TITLES = {OUTLINES: "outlines, 0.2 px", MATTE: "rendered, matte", DIAMOND: "rendered, diamond"}
FAR_OFF = 4.0
"""Stated standard deviations beyond which a component of an error is listed."""
DRAWN = {"n_frames": "frames", "speed_ms": "m/s", "spin_rads": "rad/s"}


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    kinds = [kind for kind in TITLES if (rows["kind"] == kind).any()]
    counts = (f"{int((rows['kind'] == kind).sum())} flights of {TITLES[kind]}" for kind in kinds)
    return [
        "# Accuracy of whole measurements",
        *paragraph(
            f"{'; '.join(counts)}:",
            f"{', '.join(sorted(rows['particle'].unique()))}, {rows['n_frames'].max()} pictures at 4000 frames/s,",
            f"{rows['n_views'].max()} calibrated views (rendered ones where the flights are), every flight measured from nothing.",
            f"{', '.join(f'{number(rows[k].min())} to {number(rows[k].max())} {unit}' for k, unit in list(DRAWN.items())[1:])}.",
        ),
        "",
        "![Errors of v and ω in per cent of speed and spin](accuracy.png)",
        "",
        "Dots: flights; bars: medians; dashes: what is asked of the median. Crosses at the foot: not measured.",
        "",
        "## Medians, per cent of the true speed and spin",
        "",
        *table(("", "flights", *(f"{q.title}{tail}" for q in QUANTITIES for tail in ("", ", asked"))), [_medians(rows, k) for k in kinds]),
        "",
        "A flight that was not measured counts as one with a larger error than all others.",
        "",
        "## Error bars",
        "",
        *table(
            (
                "",
                "ellipsoids of v",
                "of ω",
                "asked",
                *(f"pull, {q.title}" for q in QUANTITIES),
                *(f"over bound, {q.title}" for q in QUANTITIES),
            ),
            [_bars(rows, k) for k in kinds],
        ),
        "",
        *paragraph(
            "*Ellipsoids*: 95% ones that hold the truth, of flights that were measured. *Pull*: root mean square of errors over stated",
            "standard deviations, 1 is right. *Over bound*: of errors over those of the [true body's bound](true_body_bound.md), where",
            "outlines have a noise that is known.",
        ),
        "",
        "## What is not as it says",
        "",
        *_outside(rows),
    ]


def sizes(own: pd.DataFrame, quantity: str) -> np.ndarray:
    """Relative errors (n,) in per cent; infinite where nothing was measured."""
    return np.where(own["converged"], own[f"{quantity}_percent"], np.inf)


def _medians(rows: pd.DataFrame, kind: str) -> list[str]:
    own, cells = rows[rows["kind"] == kind], []
    for quantity in QUANTITIES:
        median, asked = float(np.median(sizes(own, quantity.key))), ASKED[kind].get(quantity.key)
        verdict = "–" if asked is None else f"{asked:g}%: {'held' if median <= asked else 'missed'}"
        cells += [percent(median) if np.isfinite(median) else "not measured", verdict]
    return [TITLES[kind], str(len(own)), *cells]


def _bars(rows: pd.DataFrame, kind: str) -> list[str]:
    good = rows[(rows["kind"] == kind) & rows["converged"]]
    low, high = HELD[kind]
    held = [good[f"ellipsoid95_{key}"] > 0 for key in ("v", "omega")]
    inside = all(low <= 100.0 * np.mean(each) <= high for each in held if len(each))
    asked = f"{low:g} to {high:g}%: {'held' if inside and len(good) else 'missed'}"
    roots = [number(_root(good, of, quantity)) for of in ("pull", "over_true_bound") for quantity in QUANTITIES]
    return [TITLES[kind], *(share(each) for each in held), asked, *roots]


def _root(own: pd.DataFrame, of: str, quantity: Quantity) -> float:
    values = own[[f"{of}_{c}" for c in quantity.components if f"{of}_{c}" in own]].to_numpy(dtype=np.float64)
    return float(np.sqrt(np.mean(values**2))) if values.size and np.isfinite(values).all() else float("nan")


def _outside(rows: pd.DataFrame) -> list[str]:
    """What was not measured, and errors that no error bar explains."""
    pulls = rows[[f"pull_{c}" for c in COMPONENTS]].abs()
    worst = np.asarray(COMPONENTS)[np.argmax(pulls.fillna(0.0).to_numpy(), axis=1)]
    far = rows.assign(worst=pulls.max(axis=1), of=worst)
    far = far[far["converged"] & (far["worst"] > FAR_OFF)].sort_values("worst", ascending=False)
    told = [
        lost_in_words(rows),
        f"Beyond {FAR_OFF:g} stated standard deviations in a component: {len(far)} of {int(rows['converged'].sum())}.",
    ]
    if far.empty:
        return paragraph(*told)
    heads = ("flight", "particle", *list(DRAWN.values())[1:], "in-plane", "out-of-plane", "ω", "worst component", "off by σ")
    cells = [
        [
            f"{row['kind']} {row['number']}",
            row["particle"],
            *(number(row[k]) for k in list(DRAWN)[1:]),
            *(percent(row[f"{q.key}_percent"]) for q in QUANTITIES),
            row["of"],
            number(row["worst"]),
        ]
        for _, row in far.iterrows()
    ]
    return [*paragraph(*told), "", *table(heads, cells)]


def picture(result: Result) -> Figure:
    """Relative errors of the three quantities beside each other, a kind at each mark."""
    rows = result.rows
    kinds = [kind for kind in TITLES if (rows["kind"] == kind).any()]
    drawn, axes = figure(1, len(QUANTITIES), (9.5, 3.8))
    for here, quantity in zip(axes[0], QUANTITIES, strict=True):
        for k, kind in enumerate(kinds):
            found = sizes(rows[rows["kind"] == kind], quantity.key)
            aside = k + 0.3 * (np.arange(len(found)) / max(len(found) - 1, 1) - 0.5)
            seen = np.isfinite(found)
            here.plot(aside[seen], found[seen], "o", ms=3, alpha=0.5, color=COLOURS[k])
            here.plot(aside[~seen], np.full(int((~seen).sum()), 0.03), "x", color=RED, transform=here.get_xaxis_transform())
            here.plot([k - 0.3, k + 0.3], [np.median(found)] * 2, "-", lw=2.5, color=COLOURS[k])
            if quantity.key in ASKED[kind]:
                here.plot([k - 0.35, k + 0.35], [ASKED[kind][quantity.key]] * 2, "--", lw=1.2, color="0.3")
        here.set_xticks(range(len(kinds)), kinds)
        here.set_xlim(-0.5, len(kinds) - 0.5)
        here.set_title(quantity.title)
        plain_logarithmic(here)
    axes[0, 0].set_ylabel("error, per cent")
    drawn.tight_layout()
    return drawn


STUDY = Study(
    "accuracy", "How accurate are whole measurements, of outlines, matte bodies and diamond?", accuracy.PLAN, page, picture, __name__
)
