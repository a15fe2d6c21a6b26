"""One page over all studies: whether stated uncertainties hold, and how near errors come to the true body's bound."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from datasets.scoring.metrics import COMPONENTS
from datasets.scoring.score import INTERVAL_95
from studies.frame.results import Result
from studies.reporting.medians import QUANTITIES, Quantity
from studies.reporting.words import number, paragraph, share, table

HEADS = ("flights", "v in 95%", "ω in 95%", *(f"pull, {q.title}" for q in QUANTITIES), *(f"over bound, {q.title}" for q in QUANTITIES))
FEWEST = 5
"""Flights of a row of the table."""


def page(results: Mapping[str, Result]) -> list[str]:
    """The page, of all results that have pulls."""
    measured = {name: result.rows[result.rows["converged"]] for name, result in results.items() if "pull_vx" in result.rows}
    rows = pd.concat([own.assign(study=name) for name, own in measured.items()], ignore_index=True)
    asked = sum(len(results[name].rows) for name in measured)
    return [
        "# Uncertainty over all studies",
        "",
        *paragraph(
            f"{asked} measurements of the studies below, of which {len(rows)} converged, taken together. Share of components whose 95%",
            "interval",
            "holds the truth; root mean square of errors over stated standard deviations (*pull*: 1 is right); and over those of the",
            "Cramér-Rao",
            "bound of the true body, where a flight has one (1: nobody who knew the body could do better). A row has at least",
            f"{FEWEST} flights. Points of a study share draws, so that counts are of measurements, not of independent ones.",
        ),
        "",
        *table(("", *HEADS), _rows(rows)),
        "",
        *paragraph(f"Whole 95% ellipsoids that hold: {_ellipsoids(rows)}."),
        "",
        *paragraph(
            "Written by `python -m studies --docs docs --together` from the rows in [results](../results). Each study is of the code that",
            "it was measured with, and `python -m studies --list` says which are older than this: what the surface adds to intervals has",
            "counted three times since 2026-11-27 ([trials](../notebook/0067-surface-trials.md#which-edges-are-noises)).",
        ),
    ]


def _rows(rows: pd.DataFrame) -> list[list[str]]:
    """All, by study, by last fit, by length and by views."""
    few, short = rows["n_views"] < 24, rows["n_frames"] <= 50
    parts = [("all", rows), *((name, rows[rows["study"] == name]) for name in rows["study"].unique())]
    parts += [("last fit to samples", rows[rows["by_samples"]]), ("last fit to tangents", rows[~rows["by_samples"]])]
    parts += [
        ("up to 50 frames", rows[short]),
        ("more frames", rows[~short]),
        ("fewer than 24 views", rows[few]),
        ("24 views and more", rows[~few]),
    ]
    return [_row(name, own) for name, own in parts if len(own) >= FEWEST]


def _row(name: str, own: pd.DataFrame) -> list[str]:
    held = [f"{100 * np.mean(np.abs(_of(own, 'pull', components)) <= INTERVAL_95):.1f}%" for components in (COMPONENTS[:3], COMPONENTS[3:])]
    pulls = [number(_rms(_of(own, "pull", q.components))) for q in QUANTITIES]
    return [name, str(len(own)), *held, *pulls, *(_over_bound(own, q) for q in QUANTITIES)]


def _over_bound(own: pd.DataFrame, quantity: Quantity) -> str:
    columns = [f"over_true_bound_{c}" for c in quantity.components]
    bounded = own.reindex(columns=columns).dropna()
    return number(_rms(bounded.to_numpy(dtype=np.float64))) if len(bounded) else "–"


def _of(own: pd.DataFrame, kind: str, components: Sequence[str]) -> np.ndarray:
    return own[[f"{kind}_{c}" for c in components]].to_numpy(dtype=np.float64)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _ellipsoids(rows: pd.DataFrame) -> str:
    return ", ".join(f"{title} {share(rows[f'ellipsoid95_{key}'] > 0)}" for key, title in (("v", "v"), ("omega", "ω")))
