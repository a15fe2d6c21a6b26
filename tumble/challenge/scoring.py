"""Compares answers with what was hidden: a row per case, per parameter and per sequence."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.json_documents import revived
from datasets.recipes.effects import KNOWN, values_in_sequence
from datasets.truth import Truth
from datasets.truth_files import read_truth
from datasets.vocabulary.effects import EFFECTS, Stage
from estimator.effects.empirical.families import EMPIRICAL
from tumble.challenge.answers import UNKNOWN, no_answer
from tumble.challenge.cases import Case, case_folder, sequence_name
from tumble.challenge.drawing import is_plausible
from tumble.challenge.drops import impact_rows
from tumble.challenge.limits import LimitTable, noncentrality
from tumble.challenge.oracle import oracle_path
from tumble.challenge.solving import answer_path
from tumble.output_directory import UNFINISHED
from tumble.written_files import read_run

Array = NDArray[np.float64]
Answer = Mapping[str, Any]
NOTHING, NO_ANSWER = "nothing", "no answer"


@dataclass(frozen=True)
class Scored:
    """Tidy tables: ``cases``, ``parameters`` (of hidden effects that were found), ``velocities`` (a row per sequence) and ``impacts``."""

    cases: pd.DataFrame
    parameters: pd.DataFrame
    velocities: pd.DataFrame
    impacts: pd.DataFrame = field(default_factory=pd.DataFrame)


def score_cases(cases: Sequence[Case], root: Path, answers: Path, oracles: Path, table: LimitTable) -> Scored:
    """Score every case; where a finished run left no answer (it crashed there), that counts as an error of its kind.

    Raises
    ------
    InputError
        Where none was.
    """
    rows: list[dict[str, Any]] = []
    parameters: list[dict[str, Any]] = []
    velocities: list[dict[str, Any]] = []
    impacts: list[dict[str, Any]] = []
    run = read_run(answers)
    finished = run is not None and run["state"] != UNFINISHED and len(list(answers.glob("*.answer.json"))) > 0
    for case in cases:
        answer, oracle = read_answer(answers, case.name), _read(oracle_path(oracles, case.name))
        if not answer and not finished:
            continue
        answer = answer or no_answer([NO_ANSWER])
        certain = oracle.get("p_weakest", 0.0) <= table.alpha / table.tests
        sizes = {"own_ratio": own_ratio(case, answer, table), "certain": certain}
        rows.append({**named(case, answer), **_errors(answer, oracle), **sizes, **_cpu(answer)})
        parameters += [{"case": case.name, **row} for row in pulls(case, answer, axes_apart(case, root, answer))]
        velocities += velocity_rows(case, root, answer, oracle)
        impacts += impact_rows(case, root, answer)
    if not rows:
        raise InputError(f"{answers}: expected answers (*.answer.json) to the campaigns of {root}, found none.")
    return Scored(pd.DataFrame(rows), pd.DataFrame(parameters), pd.DataFrame(velocities), pd.DataFrame(impacts))


def read_answer(answers: Path, campaign: str) -> dict[str, Any]:
    """The answer to a campaign; empty where there is none."""
    return _read(answer_path(answers, campaign))


def _read(path: Path) -> dict[str, Any]:
    return dict(revived(json.loads(path.read_text(encoding="utf-8")))) if path.is_file() else {}


def model_keys(answer: Answer) -> tuple[str, ...]:
    """Keys of the model that an answer's velocities are of; answers from before that was said have those of what was found."""
    return tuple(answer.get("model", answer["found"]))


def corrects_the_clock(keys: Sequence[str]) -> bool:
    """Whether a model has an effect of the clock, a family of empirical shifts among them: its velocities are by the true times."""
    entries = {**EFFECTS, **{key: family.entry for key, family in EMPIRICAL.items()}}
    return any(entries[key].stage is Stage.CLOCK for key in keys if key in entries)


def named_steps(answer: Answer) -> list[Answer]:
    """Steps whose effect is in the last model and established; what is only suspected is no name."""
    return [step for step in answer["steps"] if step["added"] in answer["found"] and step.get("established", True)]


def named(case: Case, answer: Answer) -> dict[str, Any]:
    """What was named against what is hidden. Without an answer nothing is right."""
    accepted = named_steps(answer)
    answered = NO_ANSWER not in answer.get("reasons", [])
    nothing = NOTHING if answered else NO_ANSWER
    first = accepted[0]["added"] if accepted else (UNKNOWN if answer["unknown"] else nothing)
    group = accepted[0]["group"] if accepted else []
    called = {key for step in accepted for key in (step["added"], *step["group"])}
    hidden = set(case.keys)
    stages = sorted({KNOWN[key].stage.value for key in case.keys})
    return {
        "case": case.name,
        "kind": case.kind,
        "tier": case.recipe.tier,
        "plate": case.recipe.plate is not None,
        "hidden": "+".join(case.keys),
        "particle": _particle(case),
        "ratio": case.least_ratio,
        "plausible": all(is_plausible(effect) for effect in case.recipe.effects if effect.key in EFFECTS),
        "first": first,
        "found": "+".join(answer["found"]),
        "group": "+".join(group),
        "group_size": len(group),
        "named_first": first in hidden,
        "within_group": bool(hidden & set(group)),
        "alone_first": first in hidden and len(group) == 1,
        "all_found": bool(hidden) and hidden <= called,
        "answered": answered,
        "false_alarm": not hidden and bool(accepted or answer["unknown"] or not answered),
        "unknown": bool(answer["unknown"]),
        "stage": answer["stage"],
        "law": "+".join(answer.get("law", [])),
        "true_stage": "+".join(stages),
        "left_out": len(answer["left_out"]),
        "reasons": "; ".join(answer.get("reasons", [])),
    }


def _particle(case: Case) -> str:
    particle = case.recipe.particle
    return Path(particle.files[0]).stem if particle.files else particle.family


def _errors(answer: Answer, oracle: Answer) -> dict[str, float]:
    held = answer.get("held_out", {})
    base = held["base"]["rms_px"] if "base" in held else oracle.get("base_px") or answer.get("before_px", math.nan)
    final = held["final"]["rms_px"] if "final" in held else base
    return {
        "base_px": base,
        "final_px": final,
        "empirical_px": answer.get("empirical_px", math.nan),
        "law_px": answer.get("law_px") or math.nan,
        "oracle_px": oracle.get("oracle_px", math.nan),
    }


CPU = ("register", "diagnose", "explain", "whole")
"""Parts of solving whose CPU times are told."""


def _cpu(answer: Answer) -> dict[str, float]:
    return {f"cpu_{name}_s": answer.get("cpu_s", {}).get(name, math.nan) for name in CPU}


def true_sizes(case: Case, key: str) -> Array:
    """Sizes (sequences or 1, q) of a hidden effect."""
    effect = next(each for each in case.recipe.effects if each.key == key)
    rows = case.recipe.sequences if EFFECTS[key].scope.own else 1
    return np.array([[values_in_sequence(effect, i)[name] for name in EFFECTS[key].sizes] for i in range(rows)])


def own_ratio(case: Case, answer: Answer, table: LimitTable) -> float:
    """Size of the weakest hidden effect over the 95% limit in this very campaign, by the solver's own information about it."""
    ratios = []
    for key in case.keys:
        information = answer.get("information", {}).get(key)
        if information is None or key not in table.effects:
            return math.nan
        amounts, entry = true_sizes(case, key), table.effects[key]
        linear = amounts**entry.power
        searches = len(amounts) if EFFECTS[key].scope.own else 1
        strength = float(np.einsum("si,ij,sj->", linear, np.array(information), linear))
        wanted = noncentrality(table.alpha / table.tests / float(entry.tried) ** searches, amounts.size, 0.95)
        ratios.append((strength / wanted) ** (0.5 / entry.power))
    return min(ratios, default=math.nan)


def axes_apart(case: Case, root: Path, answer: Answer) -> Array:
    """``R_found_true``: the true body's principal axes seen in those of the body that the solver carved; hulls can turn them."""
    for sequence, found in answer.get("axes", {}).items():
        true = read_truth(case_folder(root, case.name) / sequence).body.R_particle_body
        return np.asarray(np.array(found).T @ true)
    return np.eye(3)


def pulls(case: Case, answer: Answer, R_found_true: Array) -> list[dict[str, Any]]:
    """Value, truth and pull of every size of every hidden effect in the last model; a centre of mass along the axes that were found."""
    rows = []
    numbers = {sequence_name(case.name, i): i for i in range(case.recipe.sequences)}
    hidden = {effect.key: effect for effect in case.recipe.effects}
    for row in answer["parameters"]:
        if row["effect"] not in hidden or not row["is_size"]:
            continue
        sizes_there = values_in_sequence(hidden[row["effect"]], numbers[row["sequence"]] if row["sequence"] else 0)
        if row["effect"] == "centre_of_mass":
            sizes_there = dict(zip(sizes_there, R_found_true @ list(sizes_there.values()), strict=True))
        true = sizes_there[row["parameter"]]
        if row["effect"] == "dropped_frames" and true == 0.0:
            continue  # where no frame is missing the place of the gap is arbitrary
        value = abs(row["value"]) if row["effect"] == "defocus_growth" else row["value"]
        sigmas = {key: row[key] for key in ("sigma", "sigma_of_noise")}
        pull, of_noise = ((value - true) / sigma if sigma > 0 else math.nan for sigma in sigmas.values())
        named_row = {key: row[key] for key in ("effect", "parameter", "sequence")}
        rows.append({**named_row, "true": true, "value": value, **sigmas, "pull": pull, "pull_of_noise": of_noise})
    return rows


def velocity_rows(case: Case, root: Path, answer: Answer, oracle: Answer) -> list[dict[str, Any]]:
    """Errors of v (m/s) and omega (rad/s) at the reference time by model, each with its chi-squared of 3 by that model's covariance.

    ``_bias_chi2``: how significant the effect's bias is, the base model's state less the oracle's by the base model's covariance.
    """
    states = {**answer.get("velocities", {}), "oracle": oracle.get("velocities", [])}
    keys = {"base": (), "final": model_keys(answer), "oracle": case.keys}
    rows: dict[str, dict[str, Any]] = {}
    for model, found in states.items():
        clock = corrects_the_clock(keys[model])
        for state in found:
            truth = read_truth(case_folder(root, case.name) / state.get("recording", state["sequence"]))
            row = rows.setdefault(state["sequence"], {"case": case.name, "kind": case.kind, "sequence": state["sequence"]})
            error = _state(state) - np.concatenate(_true_state(truth, state["time_s"], clock))
            for name, part in PARTS:
                row[f"{name}_{model}"] = float(np.linalg.norm(error[part]))
                row[f"{name}_{model}_chi2"] = _chi2(error[part], np.array(state["covariance"])[part, part])
    for base, oracle_state in _matched(states.get("base", []), states["oracle"]):
        apart = _state(base) - _state(oracle_state)
        for name, part in PARTS:
            rows[base["sequence"]][f"{name}_bias_chi2"] = _chi2(apart[part], np.array(base["covariance"])[part, part])
    return list(rows.values())


PARTS = (("v", slice(0, 3)), ("omega", slice(3, 6)))


def _matched(first: Sequence[Answer], second: Sequence[Answer]) -> list[tuple[Answer, Answer]]:
    others = {state["sequence"]: state for state in second}
    return [(state, others[state["sequence"]]) for state in first if state["sequence"] in others]


def _state(state: Answer) -> Array:
    return np.concatenate([np.array(state["v_world"]), np.array(state["omega_world"])])


def _chi2(difference: Array, covariance: Array) -> float:
    return float(difference @ np.linalg.pinv(covariance, hermitian=True) @ difference)


def _true_state(truth: Truth, time_s: float, clock: bool) -> tuple[Array, Array]:
    """True v and omega (3,) at a time: by the stamps, or by the true times for a model that corrects the clock."""
    times = truth.motion.times_s
    if clock and "true_times_s" in truth.notes:
        times = np.array(truth.notes["true_times_s"])
    order = np.argsort(times)
    motion = truth.motion
    v, omega = (np.array([np.interp(time_s, times[order], a[order, i]) for i in range(3)]) for a in (motion.v_world, motion.omega_world))
    return v, omega
