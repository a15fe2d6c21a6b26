"""Compares answers to field campaigns with what was hidden: a row per campaign, hidden effect, stated probability, parameter and flight.

Pushes of every flight are truly there, and so is the jitter or scatter of time stamps that are rounded: naming them is no false name, and
their probabilities are not judged; the values given to pushes are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from datasets.errors import InputError
from tumble.challenge.answers import UNKNOWN, no_answer
from tumble.challenge.cases import case_folder
from tumble.challenge.field_case import FieldCase
from tumble.challenge.field_files import true_state
from tumble.challenge.scoring import NO_ANSWER, model_keys, named_steps, read_answer
from tumble.output_directory import UNFINISHED
from tumble.written_files import read_run

Array = NDArray[np.float64]
Answer = Mapping[str, Any]
Rows = list[dict[str, Any]]
PUSHES, STAMPS = "uniform_acceleration", {"trigger_jitter", "stamp_scatter"}
LEAST_PROBABILITY = 1e-6
"""A probability counts as at least this, and as at most one minus it, in the logarithmic score."""


@dataclass(frozen=True)
class FieldScored:
    """Tidy tables: ``cases``, ``hidden`` effects, stated ``probabilities``, ``parameters`` of effects that are there, ``velocities``."""

    cases: pd.DataFrame
    hidden: pd.DataFrame
    probabilities: pd.DataFrame
    parameters: pd.DataFrame
    velocities: pd.DataFrame


def score_field_cases(cases: Sequence[FieldCase], root: Path, answers: Path) -> FieldScored:
    """Score every case; where a finished run left no answer, nothing is right.

    Raises
    ------
    InputError
        Where there is no answer at all.
    """
    tables: tuple[Rows, ...] = ([], [], [], [], [])
    run = read_run(answers)
    finished = run is not None and run["state"] != UNFINISHED and any(answers.glob("*.answer.json"))
    for case in cases:
        answer = read_answer(answers, case.name)
        if not answer and not finished:
            continue
        answer = answer or no_answer([NO_ANSWER])
        rows = (
            [case_row(case, answer)],
            hidden_rows(case, answer),
            probability_rows(case, answer),
            parameter_rows(case, answer),
            velocity_rows(case, root, answer),
        )
        for table, more in zip(tables, rows, strict=True):
            table += [{"case": case.name, "measured": case.measured, **row} for row in more]
    if not tables[0]:
        raise InputError(f"{answers}: expected answers (*.answer.json) to the campaigns of {root}, found none.")
    return FieldScored(*(pd.DataFrame(table) for table in tables))


def there_anyway(case: FieldCase) -> frozenset[str]:
    """Effects of the mess that may be larger than their limit: naming them is right."""
    pushed = {PUSHES} if PUSHES in case.mess else set()
    return frozenset(pushed | (STAMPS if case.noise.rounded else set()))


def false_names(case: FieldCase, answer: Answer) -> list[str]:
    """Names in whose group nothing is that was hidden."""
    return false_among(case, named_steps(answer))


def false_among(case: FieldCase, steps: Sequence[Answer]) -> list[str]:
    """Effects of steps of whose names none is right; a name of two effects is right where both were hidden."""
    right = set(case.hidden) | ({UNKNOWN} if case.outside else set())
    return [s["added"] for s in steps if s["added"] not in there_anyway(case) and not any(set(name) <= right for name in s["names"])]


def case_row(case: FieldCase, answer: Answer) -> dict[str, Any]:
    """What was said of a campaign."""
    steps, in_model = named_steps(answer), [step for step in answer["steps"] if step["added"] in answer["found"]]
    return {
        "flights": len(case.flights),
        "rows": sum(flight.rows for flight in case.flights),
        "rounded": case.noise.rounded,
        "stated": case.noise.stated,
        "hidden": "+".join(case.hidden),
        "outside": "+".join(case.outside),
        "found": "+".join(answer["found"]),
        "groups": " ".join("/".join(step["group"]) for step in steps),
        "false_names": "+".join(false_names(case, answer)),
        "false_names_or_suspected": "+".join(false_among(case, in_model)),
        "suspected": "+".join(step["added"] for step in in_model if step not in steps),
        "unknown": bool(answer["unknown"]),
        "unknown_in_group": bool(answer["unknown"]) or any([UNKNOWN] in step["names"] for step in steps),
        "answered": NO_ANSWER not in answer.get("reasons", []),
        "cpu_s": answer.get("cpu_s", {}).get("whole", float("nan")),
    }


def hidden_rows(case: FieldCase, answer: Answer) -> Rows:
    """Of every hidden effect: whether it is in the model, or in a group of the model."""
    steps = named_steps(answer)
    right = set(case.hidden) | there_anyway(case)
    grouped = {key for step in steps for name in step["names"] if set(name) <= right for key in name}
    found = {step["added"] for step in steps}
    return [
        {"effect": key, "over_limit": over, "found": key in found, "named": key in grouped}
        for key, over in case.over_limit.items()
        if key in case.hidden
    ]


def probability_rows(case: FieldCase, answer: Answer) -> Rows:
    """Every stated probability with what is true; the stray effect and wrong lengths, below their limits, count as not there."""
    true = set(case.hidden) | ({UNKNOWN} if case.outside else set())
    stated = {key: p for key, p in answer.get("probability", {}).items() if key not in there_anyway(case)}
    return [
        {
            "effect": key,
            "probability": float(p),
            "true": key in true,
            "log_score": log_score(p, true=key in true),
            "stated": case.noise.stated,
        }
        for key, p in stated.items()
    ]


def log_score(p: float, *, true: bool) -> float:
    """Logarithm (nats) of the probability given to what is true [Good 1952]; 0 is best."""
    return float(np.log(np.clip(p if true else 1.0 - p, LEAST_PROBABILITY, 1.0)))


def parameter_rows(case: FieldCase, answer: Answer) -> Rows:
    """Value, truth and pull of every size of effects that are there and were found."""
    numbers = {flight.name: number for number, flight in enumerate(case.flights)}
    rows: Rows = []
    for row in answer["parameters"]:
        key = row["effect"]
        there = case.values(numbers.get(row["sequence"], 0)).get(key, {})
        if key == "centre_of_mass" and there:
            there = dict(zip(there, axes_apart(case, answer) @ list(there.values()), strict=True))
        true = there.get(row["parameter"])
        if true is None or not row["is_size"] or key not in {*case.hidden, PUSHES}:
            continue
        pull = (row["value"] - true) / row["sigma"] if row["sigma"] > 0 else float("nan")
        named = {name: row[name] for name in ("effect", "parameter", "sequence", "value", "sigma")}
        rows.append({**named, "true": true, "pull": pull, "hidden": key in case.hidden, "stated": case.noise.stated})
    return rows


def axes_apart(case: FieldCase, answer: Answer) -> Array:
    """``R_found_true`` (3, 3): the true body's principal axes seen in those that the solver carved; those of trajectories are stated."""
    found = next(iter(answer.get("axes", {}).values()), None)
    if case.scene is None or found is None:
        return np.eye(3)
    return np.asarray(np.array(found).T @ np.array(case.scene.R_particle_body))


def velocity_rows(case: FieldCase, root: Path, answer: Answer) -> Rows:
    """Error of v (m/s) and omega (rad/s) of every flight, with its chi-squared of 3 by the stated covariance, where they are measured.

    A model that has the frame rate is asked at true times. Empirical shifts of stamps leave a rate as it is.
    """
    rate = case.values(0).get("frame_rate", {}).get("relative", 0.0) if "frame_rate" in model_keys(answer) else 0.0
    parts = [("v", slice(0, 3))] if case.measured != "gyroscope" else []
    parts += [("omega", slice(3, 6))] if case.measured != "positions" else []
    rows: Rows = []
    for model, states in answer.get("velocities", {}).items():
        for state in states:
            path = case_folder(root, case.name) / f"{state['sequence']}.csv"
            truth = true_state(path, state["time_s"] * (1.0 + rate), tracked=case.measured == "gyroscope")
            error = np.array([*state["v_world"], *state["omega_world"]]) - truth
            covariance = np.array(state["covariance"])
            for name, part in parts:
                chi2 = float(error[part] @ np.linalg.pinv(covariance[part, part], hermitian=True) @ error[part])
                found = {"error": float(np.linalg.norm(error[part])), "chi2": chi2}
                rows.append({"sequence": state["sequence"], "model": model, "of": name, "stated": case.noise.stated, **found})
    return rows
