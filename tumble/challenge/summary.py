"""The result of scored challenges as one document and tidy tables; several challenges, each with its own seed, may be pooled."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from tumble.challenge.acceptance import acceptance, velocity_falls
from tumble.challenge.detection import detection_table
from tumble.challenge.figures import figure_to_dict
from tumble.challenge.limits import LimitTable
from tumble.challenge.scoring import CPU, NOTHING, Scored

TABLES = ("cases", "parameters", "velocities")
CHALLENGE = "challenge"
"""Column of every table: the seed of the challenge that a row comes from."""
WORDS = ("hidden", "particle", "first", "found", "group", "stage", "law", "true_stage", "reasons")


def summary(scored: Scored, table: LimitTable) -> dict[str, Any]:
    """Everything that the page shows."""
    cases = scored.cases
    return {
        "challenges": {str(k): int(v) for k, v in cases[CHALLENGE].value_counts(sort=False).items()} if CHALLENGE in cases else {},
        "campaign": dict(table.campaign),
        "tiers": sorted(str(tier) for tier in cases["tier"].unique()),
        "counts": {str(k): int(v) for k, v in cases["kind"].value_counts().items()},
        "acceptance": [figure_to_dict(figure) for figure in acceptance(scored)],
        "confusion": confusion(cases),
        "falls": falls(scored),
        "effects": per_effect(scored),
        "detection": detection_table(cases).to_dict("records"),
        "cpu_s": {name: float(cases[f"cpu_{name}_s"].astype(float).median()) for name in CPU},
    }


def confusion(cases: pd.DataFrame) -> dict[str, dict[str, int]]:
    """How often each thing that was hidden alone (or nothing) was given each name first."""
    alone = cases[cases["kind"] != "pair"]
    found: dict[str, dict[str, int]] = {}
    for hidden, first in zip(alone["hidden"], alone["first"], strict=True):
        row = found.setdefault(str(hidden) or NOTHING, {})
        row[str(first)] = row.get(str(first), 0) + 1
    return {key: dict(sorted(found[key].items())) for key in sorted(found)}


def per_effect(scored: Scored) -> list[dict[str, Any]]:
    """Per effect hidden alone: how often it was named where it was above its limit, and how good its parameters are."""
    singles = scored.cases[scored.cases["kind"] == "single"]
    rows = []
    for key, every in singles.groupby("hidden"):
        group = every[every["ratio"] >= 1.0]
        pulls = _pulls(scored.parameters, str(key))
        rows.append(
            {
                "effect": str(key),
                "cases": len(group),
                "within_group": int((group["within_group"] | group["named_first"]).sum()),
                "alone_first": int(group["alone_first"].sum()),
                "mean_group": float(group.loc[group["group_size"] > 0, "group_size"].mean()) if (group["group_size"] > 0).any() else None,
                "parameters": len(pulls),
                "inside_95": int((np.abs(pulls) <= 1.96).sum()),
                "pull_mean": float(pulls.mean()) if len(pulls) else None,
                "pull_spread": float(pulls.std(ddof=1)) if len(pulls) > 1 else None,
            }
        )
    return rows


def falls(scored: Scored) -> list[dict[str, Any]]:
    """Per effect hidden alone: how many times smaller velocity errors became that it had biased, and with a model that knows of it."""
    singles = scored.cases[scored.cases["kind"] == "single"]
    rows = []
    for key, every in singles.groupby("hidden"):
        velocities = scored.velocities[scored.velocities["case"].isin(every["case"])] if len(scored.velocities) else scored.velocities
        fell, known = (velocity_falls(velocities, model) for model in ("final", "oracle"))
        if len(fell):
            rows.append({"effect": str(key), "n": len(fell), "fall": float(fell.median()), "known": float(known.median())})
    return rows


def _pulls(parameters: pd.DataFrame, key: str) -> Any:
    if parameters.empty:
        return np.zeros(0)
    pulls = parameters.loc[parameters["effect"] == key, "pull"].to_numpy(dtype=np.float64)
    return pulls[np.isfinite(pulls)]


def of_challenge(scored: Scored, seed: int) -> Scored:
    """The same tables, told apart from those of other challenges by the seed; it tells nothing any more once answers are scored."""
    cases, parameters, velocities, impacts = (_tagged(getattr(scored, name), seed) for name in (*TABLES, "impacts"))
    return Scored(cases, parameters, velocities, impacts)


def _tagged(table: pd.DataFrame, seed: int) -> pd.DataFrame:
    return table.assign(case=[f"{seed}/{name}" for name in table["case"]], **{CHALLENGE: seed}) if len(table) else table


def pooled(scores: Sequence[Scored]) -> Scored:
    """All rows of several scored challenges."""
    every = [[table for scored in scores if len(table := getattr(scored, name))] for name in (*TABLES, "impacts")]
    cases, parameters, velocities, impacts = (pd.concat(tables, ignore_index=True) if tables else pd.DataFrame() for tables in every)
    return Scored(cases, parameters, velocities, impacts)


def table_path(result: Path, name: str) -> Path:
    """Where a table of the result file ``result`` lies."""
    return result.with_name(f"{result.stem}_{name}.csv")


def read_tables(result: Path, *, without: int) -> Scored:
    """The tables beside a result file.

    Raises
    ------
    InputError
        Where one is missing, is none of these, or holds cases of the challenge of the seed ``without``.
    """
    tables = []
    for name in TABLES:
        path = table_path(result, name)
        try:
            tables.append(pd.read_csv(path, dtype=dict.fromkeys(WORDS, str)))
        except FileNotFoundError:
            raise InputError(f"{path}: expected a table that `tumble challenge score --result {result}` writes, found none.") from None
        except (pd.errors.EmptyDataError, pd.errors.ParserError):
            tables.append(pd.DataFrame())
    cases = tables[0]
    if not {"case", CHALLENGE, "answered"} <= set(cases):
        came = ", ".join(cases.columns) or "none"
        raise InputError(f"{table_path(result, 'cases')}: expected columns case, {CHALLENGE} and answered, got {came}.")
    if (cases[CHALLENGE] == without).any():
        raise InputError(f"{result}: expected other challenges than the one to be scored, got cases of its own seed ({without}).")
    return Scored(cases.fillna(dict.fromkeys(WORDS, "")), tables[1], tables[2])


def write_tables(scored: Scored, paths: Mapping[str, Path]) -> None:
    """Every table of ``paths``."""
    for name, path in paths.items():
        path.parent.mkdir(parents=True, exist_ok=True)
        with written_whole(path) as temporary:
            getattr(scored, name).to_csv(temporary, index=False, float_format="%.6g")
