"""The result of a scored challenge as one document and tidy tables."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.atomic_files import written_whole
from tumble.challenge.acceptance import acceptance, figure_to_dict, velocity_gain
from tumble.challenge.detection import detection_table
from tumble.challenge.limits import LimitTable
from tumble.challenge.scoring import NOTHING, Scored


def summary(scored: Scored, table: LimitTable) -> dict[str, Any]:
    """Everything that the page shows."""
    cases = scored.cases
    return {
        "campaign": dict(table.campaign),
        "tiers": sorted(str(tier) for tier in cases["tier"].unique()),
        "counts": {str(k): int(v) for k, v in cases["kind"].value_counts().items()},
        "acceptance": [figure_to_dict(figure) for figure in acceptance(scored)],
        "oracle_velocity_gain": figure_to_dict(velocity_gain(scored.velocities, "oracle")),
        "confusion": confusion(cases),
        "effects": per_effect(scored),
        "detection": detection_table(cases).to_dict("records"),
        "cpu_s": {name: float(cases[f"cpu_{name}_s"].astype(float).median()) for name in ("register", "diagnose", "explain")},
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


def _pulls(parameters: pd.DataFrame, key: str) -> Any:
    if parameters.empty:
        return np.zeros(0)
    pulls = parameters.loc[parameters["effect"] == key, "pull"].to_numpy(dtype=np.float64)
    return pulls[np.isfinite(pulls)]


def write_tables(scored: Scored, out: Path) -> None:
    """``cases.csv``, ``parameters.csv`` and ``velocities.csv``."""
    tables: Mapping[str, pd.DataFrame] = {"cases": scored.cases, "parameters": scored.parameters, "velocities": scored.velocities}
    for name, table in tables.items():
        with written_whole(out / f"{name}.csv") as temporary:
            table.to_csv(temporary, index=False, float_format="%.6g")
