"""The page of the surface as an unknown: errors by class of body and by fit, over the true body's bound and over what is stated."""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from datasets.scoring.score import INTERVAL_95
from studies.frame.results import Result
from studies.frame.study import Study
from studies.plans import surface_fit
from studies.plans.surface_fit import FITS, KNOWN, SAMPLES, TANGENTS
from studies.reporting.figures import COLOURS, figure, finish, plain_logarithmic
from studies.reporting.medians import QUANTITIES, Line, Quantity, draw_medians, errors, lost_in_words, medians
from studies.reporting.words import number, paragraph, share, table

HEADS = ("body", "fit", "n", "RMSE", "bound", "over bound", "ratios", "pull", "in 95%")
ASIDE = 0.2
"""How far neighbouring fits are drawn apart, where one class of body is 1 from the next."""


def page(result: Result) -> list[str]:
    """The page, every number from the rows."""
    rows = result.rows
    return [
        "# The surface as an unknown",
        *paragraph(
            "What is the last fit of [decision 53](../decisions/0053-surface-as-an-unknown.md) worth, to every sample of every outline",
            "with the body's surface as an unknown, beside the fit of tangents alone (`surface_fit = 0`)?",
            f"{rows['repetition'].nunique()} flights of each class of body: {_bodies(rows)}. {rows['n_frames'].max()} pictures at 4000",
            f"frames/s, {rows['n_views'].max()} calibrated views, outlines with 0.2 px boundary noise. The same flights by every fit.",
            f"*{SAMPLES[0].upper()}{SAMPLES[1:]}*: as the estimator does where nothing is asked. *{KNOWN[0].upper()}{KNOWN[1:]}*: told",
            "that outlines lie within 0.001 px of the true ones (`offset_prior_px`), which they do here.",
        ),
        "",
        "![Errors over the true body's bound by class of body and fit](surface_fit.png)",
        "",
        *paragraph(
            "Dots: medians of errors over the median error that the true body's bound allows, with 95% bootstrap intervals where there",
            "are six flights and more; 1: nobody who knew the body could do better. Flights are those that every fit measured.",
        ),
        "",
        *paragraph(
            "*RMSE*: root mean square of one component's error, mid-sequence. *Bound*: the root mean square of the",
            "[true body's bound](true_body_bound.md). *Ratios*: root mean square of errors over the bound of their own flight. *Pull*:",
            "of errors over stated standard deviations (1 is right). *In 95%*: components whose interval holds the truth.",
        ),
        *(line for quantity in QUANTITIES for line in ("", f"## {quantity.title} ({quantity.unit})", "", *_table(rows, quantity))),
        "",
        "## Ellipsoids, CPU",
        "",
        *table(
            ("body", "fit", "ellipsoids of v", "of ω", "CPU of an estimate (s, median)", "fits to samples"),
            [_whole(body, fit, own) for body, fit, own in _parts(rows)],
        ),
        "",
        *paragraph(lost_in_words(rows), *_worth(rows)),
        "",
        *paragraph(
            "What to type next: nothing; samples are fitted. Who knows how far outlines lie outside of the true",
            "ones says so, `tumble estimate --set offset_prior_px=0.001`.",
        ),
    ]


def _bodies(rows: pd.DataFrame) -> str:
    told = [f"*{body}* ({', '.join(sorted(own['particle'].unique()))})" for body, own in rows.groupby("body", sort=False)]
    return ", ".join(told)


def _both(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of flights that every fit measured."""
    return rows[rows.groupby(["repetition", "body"])["converged"].transform("all")]


def _parts(rows: pd.DataFrame) -> list[tuple[str, str, pd.DataFrame]]:
    both = _both(rows)
    found = [(body, fit, both[(both["body"] == body) & (both["fit"] == fit)]) for body in rows["body"].unique() for fit in FITS]
    return [part for part in found if len(part[2])]


def _table(rows: pd.DataFrame, quantity: Quantity) -> list[str]:
    return table(HEADS, [[body, fit, str(len(own)), *_figures(own, quantity)] for body, fit, own in _parts(rows)])


def _figures(own: pd.DataFrame, quantity: Quantity) -> list[str]:
    rmse = _rms(errors(own, quantity)) / np.sqrt(len(quantity.components))
    bound, ratios, pulls = (_of(own, kind, quantity) for kind in ("true_bound", "over_true_bound", "pull"))
    bound_rms, inside = quantity.per_si * _rms(bound), np.mean(np.abs(pulls) <= INTERVAL_95)
    return [*map(number, (rmse, bound_rms, rmse / bound_rms, _rms(ratios), _rms(pulls))), f"{100 * inside:.0f}%"]


def _of(own: pd.DataFrame, kind: str, quantity: Quantity) -> np.ndarray:
    return own[[f"{kind}_{c}" for c in quantity.components]].to_numpy(dtype=np.float64)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _whole(body: str, fit: str, own: pd.DataFrame) -> list[str]:
    held = (share(own[f"ellipsoid95_{key}"] > 0) for key in ("v", "omega"))
    return [body, fit, *held, number(own["fit_cpu_s"].median()), f"{own['by_samples'].sum()} of {len(own)}"]


def _worth(rows: pd.DataFrame) -> list[str]:
    """By what factor median errors of all classes fall, as geometric means of flights' ratios."""
    both = _both(rows)
    by_fit = {fit: both[both["fit"] == fit].set_index(["repetition", "body"]) for fit in FITS}
    if both.empty:
        return []
    falls = []
    for quantity in QUANTITIES:
        before, *after = (errors(by_fit[fit], quantity) for fit in (TANGENTS, SAMPLES, KNOWN))
        factors = " and ".join(number(np.exp(np.mean(np.log(each / before)))) for each in after)
        falls.append(f"{quantity.title} {factors}")
    return [f"Errors over those of tangents, geometric means over all flights, samples and with the offset known: {', '.join(falls)}."]


def picture(result: Result) -> Figure:
    """The three quantities beside each other, a class of body at each mark, colours are fits."""
    both = _both(result.rows)
    classes = list(result.rows["body"].unique())
    placed = both.assign(number=both["body"].map({name: k for k, name in enumerate(classes)}))
    drawn, axes = figure(1, len(QUANTITIES), (9.5, 3.8))
    for here, quantity in zip(axes[0], QUANTITIES, strict=True):
        for k, (fit, colour) in enumerate(zip(FITS, COLOURS, strict=False)):
            _draw(here, placed[placed["fit"] == fit], quantity, (fit, colour, ASIDE * (k - 1)))
        here.axhline(1.0, color="0.5", ls=":", lw=1.4)
        here.set_xticks(range(len(classes)), classes)
        here.set_xlim(-0.5, len(classes) - 0.5)
        here.set_title(quantity.title)
        plain_logarithmic(here)
    axes[0, 0].set_ylabel("median error over that of the bound")
    finish(drawn)
    return drawn


def _draw(here: Axes, own: pd.DataFrame, quantity: Quantity, style: tuple[str, str, float]) -> None:
    fit, colour, aside = style
    points = medians(own, ("number",)) if len(own) else pd.DataFrame()
    if len(points):
        points = points[points["quantity"] == quantity.key]
        over = points[["median", "low", "high"]].div(points["bound"], axis=0)
        draw_medians(here, points.assign(**over, x=points["number"] + aside), Line("x", colour, fit, ""))


QUESTION = "What is a fit of all outline samples worth, by class of body, beside one of tangents?"
STUDY = Study("surface_fit", QUESTION, surface_fit.PLAN, page, picture, __name__)
