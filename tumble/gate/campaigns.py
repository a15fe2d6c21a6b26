"""The campaigns of a gate: made, solved, and a row of scores for each."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from datasets.scoring.gate_measures import Row
from tumble.challenge.answers import no_answer
from tumble.challenge.cases import CASE_FILE, case_folder
from tumble.challenge.field_case import FieldCase, read_field_cases
from tumble.challenge.field_making import write_campaign
from tumble.challenge.field_scoring import case_row, hidden_rows, parameter_rows, probability_rows, velocity_rows
from tumble.challenge.scoring import NO_ANSWER, read_answer
from tumble.engine import Executor, Item, Outcome, run
from tumble.gate.sets import CampaignPlan, case_of
from tumble.progress import progress


def make_campaigns(plans: Sequence[CampaignPlan], out: Path, *, executor: Executor, quiet: bool) -> tuple[Outcome, ...]:
    """Make every campaign that ``out`` lacks."""
    items = [Item(plan.name, {"plan": asdict(plan), "out": out}, case_folder(out, plan.name) / CASE_FILE) for plan in plans]
    with progress("make", len(items), quiet=quiet) as advance:
        return run(make_item, items, executor=executor, advance=advance)


def make_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Make one campaign."""
    write_campaign(case_of(CampaignPlan(**payload["plan"])), Path(payload["out"]))
    return {}


def campaign_rows(root: Path, answers: Path) -> list[Row]:
    """A row for every campaign under ``root``; where there is no answer nothing is measured."""
    return [campaign_row(case, root, read_answer(answers, case.name) or no_answer([NO_ANSWER])) for case in read_field_cases(root)]


def campaign_row(case: FieldCase, root: Path, answer: Mapping[str, Any]) -> Row:
    """One campaign; it is measured where what is hidden is named, and nothing else."""
    told, hidden = case_row(case, answer), hidden_rows(case, answer)
    missed, false = [row["effect"] for row in hidden if not row["named"]], str(told["false_names"])
    said = [*([f"{' and '.join(missed)} not named"] if missed else []), *([f"{false} named falsely"] if false else [])]
    answered = bool(told["answered"])
    found = pd.DataFrame(velocity_rows(case, root, answer), columns=["sequence", "model", "of", "error", "chi2"])
    final = found[found["model"] == "final"]
    sizes = pd.DataFrame(parameter_rows(case, answer), columns=["value", "true", "pull", "hidden"])
    sizes = sizes[sizes["hidden"].astype(bool)]
    return {
        "sequence": case.name,
        "status": ("; ".join(said) or "names right") if answered else NO_ANSWER,
        "measured": answered and not said,
        "names_nats": -float(sum(row["log_score"] for row in probability_rows(case, answer))) if answered else np.nan,
        "velocity_ms": _rms(final["error"][final["of"] == "v"]),
        "angular_rads": _rms(final["error"][final["of"] == "omega"]),
        "velocity_chi2": float(final["chi2"].mean()),
        "parameter_percent": 100 * _rms((sizes["value"] - sizes["true"]) / sizes["true"]),
        "parameter_chi2": float((sizes["pull"] ** 2).mean()),
        "held_out": float(answer.get("held_out", {}).get("final", {}).get("rms_px", np.nan)),
    }


def _rms(values: "pd.Series[float]") -> float:
    return float(np.sqrt(np.mean(np.square(values.to_numpy(dtype=np.float64))))) if len(values) else float("nan")
