"""Figures of the field challenge, each with its number of cases and its 95% interval, and the reliability curve."""

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from tumble.challenge.acceptance import INSIDE
from tumble.challenge.field_scoring import FieldScored
from tumble.challenge.figures import HELD, MISSED, RESAMPLES, Figure, figure_to_dict, of_rows, share, share_of_rows

Array = NDArray[np.float64]
LINE = "F"
BINS = 10
WORTH_STATING = 0.05
"""Most effects of the catalogue are rightly given next to no probability: those above this are shown apart."""
LEAST_PARAMETERS, MOST_PARAMETERS = 92.0, 98.0
VELOCITIES = ("v", "omega")
SIZES = (1.0, 1.5, 2.5, 5.0, 10.0)
"""Limits between which names are told apart: no size decides anything."""
NEEDED = 300
"""Campaigns that acceptance asks for."""


def field_figures(scored: FieldScored) -> list[Figure]:
    """Every figure; with fewer campaigns than acceptance asks for, none is said to hold or to be missed."""
    figures = [*_names(scored), *_probabilities(scored.probabilities), *_parameters(scored.parameters), *_velocities(scored.velocities)]
    figures += [*_by_size(scored.hidden), *_by_statement(scored), *_by_kind(scored)]
    few = len(scored.cases) < NEEDED
    return [replace(figure, needed=figure.n + 1) if few and figure.verdict in (HELD, MISSED) else figure for figure in figures]


def _names(scored: FieldScored) -> list[Figure]:
    cases, hidden = scored.cases, scored.hidden
    inside, outside = cases[cases["outside"] == ""], cases[cases["outside"] != ""]
    told = {name: _of(hidden, name, bool) for name in ("named", "found")}
    names = _of(hidden, "case", str)
    figures = [
        share_of_rows(LINE, "hidden effects named or in a group", told["named"], names, least=90.0),
        share_of_rows(LINE, "hidden effects in the last model themselves", told["found"], names),
        share(LINE, "campaigns with a false name", cases["false_names"] != "", most=5.0),
        share(LINE, "the same without those with a force outside of the catalogue", inside["false_names"] != ""),
        share(LINE, "forces outside of the catalogue called unknown", outside["unknown"].astype(bool), least=90.0),
        share(LINE, "the same, or unknown among the names of a group", outside["unknown_in_group"].astype(bool)),
        share(LINE, "campaigns called unknown in which the catalogue has everything", inside["unknown"].astype(bool)),
        share(LINE, "the same of the names of a group", inside["unknown_in_group"].astype(bool)),
        share(LINE, "campaigns with an effect that is suspected, not established", cases["suspected"] != ""),
        share(LINE, "campaigns with a false name, suspected ones counted", cases["false_names_or_suspected"] != ""),
    ]
    return figures


def _by_statement(scored: FieldScored) -> list[Figure]:
    """Where the files state their noise, and where they do not: false names, probabilities, intervals of v and omega."""
    figures = []
    for stated, words in ((True, "where noise is stated"), (False, "where noise is not stated")):
        part = [_where(table, "stated", stated) for table in (scored.cases, scored.probabilities, scored.velocities)]
        cases, probabilities, velocities = part
        figures.append(share(LINE, f"campaigns with a false name {words}", _of(cases, "false_names", str) != ""))
        if len(probabilities):
            figures.append(_calibration(f"expected calibration error {words}", probabilities))
        figures += [_inside_of(velocities, of, "final", f"{of} inside its 95% ellipsoid {words}") for of in VELOCITIES]
    return figures


def _by_size(hidden: pd.DataFrame) -> list[Figure]:
    """By how far an effect is above its limit: names."""
    figures = []
    for low, high in pairwise(SIZES):
        rows = hidden[(hidden["over_limit"] > low) & (hidden["over_limit"] <= high)] if len(hidden) else hidden
        what = f"{low:g} to {high:g} limits: hidden effects named or in a group"
        figures.append(share_of_rows(LINE, what, _of(rows, "named", bool), _of(rows, "case", str)))
    return figures


def _by_kind(scored: FieldScored) -> list[Figure]:
    """By what is measured: names, false names, intervals of v and omega."""
    figures = []
    for kind in sorted(scored.cases["measured"].unique()):
        cases, hidden, velocities = (_where(table, "measured", kind) for table in (scored.cases, scored.hidden, scored.velocities))
        named = share_of_rows(LINE, f"{kind}: hidden effects named or in a group", _of(hidden, "named", bool), _of(hidden, "case", str))
        figures += [named, share(LINE, f"{kind}: campaigns with a false name", cases["false_names"] != "")]
        there = [of for of in VELOCITIES if len(_where(velocities, "of", of))]
        figures += [_inside_of(velocities, of, "final", f"{kind}: {of} inside its 95% ellipsoid") for of in there]
    return figures


def _where(table: pd.DataFrame, column: str, value: object) -> pd.DataFrame:
    return table[table[column] == value] if len(table) else table


def _probabilities(stated: pd.DataFrame) -> list[Figure]:
    if stated.empty:
        return []
    worth = stated[stated["probability"] >= WORTH_STATING]
    log_scores = np.asarray(stated["log_score"], dtype=np.float64)
    return [
        _calibration("expected calibration error of stated probabilities", stated, most=5.0),
        _calibration(f"the same of those above {100 * WORTH_STATING:g}%", worth),
        of_rows(LINE, "mean logarithmic score", log_scores, stated["case"].tolist(), np.mean, unit="nats"),
        Figure(
            LINE,
            "the same, had every effect been given the share of those that are there",
            _base_rate(stated),
            np.nan,
            np.nan,
            len(stated),
            unit="nats",
        ),
    ]


def _base_rate(stated: pd.DataFrame) -> float:
    """Mean logarithmic score of one probability for everything."""
    p = float(stated["true"].astype(float).mean())
    return float(sum(q * np.log(q) for q in (p, 1.0 - p) if q > 0.0))


def reliability(stated: pd.DataFrame) -> pd.DataFrame:
    """Stated probabilities in bins: how many, their mean, and the share that is true with its exact interval."""
    rows = []
    bins = np.minimum((stated["probability"].to_numpy() * BINS).astype(int), BINS - 1) if len(stated) else np.zeros(0, dtype=int)
    for number in range(BINS):
        there = stated[bins == number]
        if len(there):
            found = share(LINE, "", there["true"].astype(bool))
            mean = 100.0 * float(there["probability"].mean())
            rows.append({"bin": number, "n": len(there), "stated": mean, "true": found.value, "low": found.low, "high": found.high})
    return pd.DataFrame(rows)


def calibration_error(p: Array, true: NDArray[np.bool_]) -> float:
    """Expected calibration error (%): distance of stated from true shares, averaged over bins by their counts [Naeini et al. 2015]."""
    bins = np.minimum((p * BINS).astype(int), BINS - 1)
    gaps = [abs(float((p[bins == b] - true[bins == b]).sum())) for b in range(BINS)]
    return 100.0 * sum(gaps) / max(len(p), 1)


def _calibration(what: str, stated: pd.DataFrame, **bounds: Any) -> Figure:
    """The error with its bootstrap interval over campaigns."""
    p, true = stated["probability"].to_numpy(dtype=np.float64), stated["true"].to_numpy(dtype=np.bool_)
    _, number = np.unique(stated["case"].to_numpy(dtype=str), return_inverse=True)
    rows = [np.flatnonzero(number == n) for n in range(int(number.max(initial=-1)) + 1)]
    low = high = float("nan")
    if len(rows) > 2:
        rng = np.random.default_rng(0)
        drawn = [np.concatenate([rows[i] for i in rng.integers(len(rows), size=len(rows))]) for _ in range(RESAMPLES)]
        low, high = np.quantile([calibration_error(p[each], true[each]) for each in drawn], [0.025, 0.975]).tolist()
    cases = len(rows)
    return Figure(LINE, what, calibration_error(p, true) if len(p) else float("nan"), low, high, cases, **bounds)


def _parameters(table: pd.DataFrame) -> list[Figure]:
    hidden = table[table["hidden"]] if len(table) else table
    pushes = table[~table["hidden"].astype(bool)] if len(table) else table
    return [
        _inside("parameters of hidden effects inside their 95% interval", hidden, "pull", lambda pull: np.abs(pull) <= 1.96),
        _inside("accelerations of flights that are only pushed, inside theirs", pushes, "pull", lambda pull: np.abs(pull) <= 1.96),
    ]


def _velocities(table: pd.DataFrame) -> list[Figure]:
    figures = []
    for model, words in (("final", "after explain"), ("base", "before")):
        bounds = {"least": LEAST_PARAMETERS, "most": MOST_PARAMETERS} if model == "final" else {}
        figures += [_inside_of(table, of, model, f"{of} of flights inside its 95% ellipsoid {words}", **bounds) for of in VELOCITIES]
    return figures


def _inside_of(table: pd.DataFrame, of: str, model: str, what: str, **bounds: Any) -> Figure:
    """How often one velocity of flights is inside its ellipsoid."""
    rows = _where(_where(table, "model", model), "of", of)
    return _inside(what, rows, "chi2", lambda chi2: chi2 <= INSIDE, **bounds)


def _inside(what: str, table: pd.DataFrame, column: str, hit: Callable[[Array], NDArray[np.bool_]], **bounds: Any) -> Figure:
    values = table[column].to_numpy(dtype=np.float64) if len(table) else np.zeros(0)
    known = np.isfinite(values)
    cases = table["case"][known].reset_index(drop=True) if len(table) else pd.Series(dtype=str)
    return share_of_rows(LINE, what, pd.Series(hit(values[known])), cases, **bounds)


def _of(table: pd.DataFrame, column: str, kind: type) -> "pd.Series[Any]":
    return table[column].astype(kind) if len(table) else pd.Series(dtype=kind)


def field_summary(scored: FieldScored) -> dict[str, Any]:
    """Everything that is told, as plain values."""
    cases = scored.cases
    return {
        "campaigns": len(cases),
        "measured": {str(k): int(v) for k, v in cases["measured"].value_counts().items()},
        "figures": [figure_to_dict(figure) for figure in field_figures(scored)],
        "reliability": reliability(scored.probabilities).to_dict("records"),
        "effects": effects_table(scored).to_dict("records"),
        "cpu_s": {"median": float(cases["cpu_s"].median()), "slowest": float(cases["cpu_s"].max())},
    }


def effects_table(scored: FieldScored) -> pd.DataFrame:
    """Per effect: how often it was hidden, named, and named falsely."""
    false = pd.Series([name for names in scored.cases["false_names"] for name in names.split("+") if name], dtype=str).value_counts()
    hidden = scored.hidden.groupby("effect")["named"].agg(["size", "sum"]) if len(scored.hidden) else pd.DataFrame({"size": [], "sum": []})
    keys = sorted({*hidden.index, *false.index})
    return pd.DataFrame(
        {
            "effect": keys,
            "hidden": [int(hidden["size"].get(key, 0)) for key in keys],
            "named": [int(hidden["sum"].get(key, 0)) for key in keys],
            "false": [int(false.get(key, 0)) for key in keys],
        }
    )
