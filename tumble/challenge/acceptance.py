"""The challenge's acceptance: each figure with its number of cases, its interval, what was asked for, and whether it held."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy.stats import chi2

from datasets.recipes.synth_only import SYNTH_ONLY
from datasets.vocabulary.effects import Stage
from estimator.effects.registry import MODELS
from tumble.challenge.drops import drops_figures
from tumble.challenge.figures import Figure, of_rows, share, share_of_rows, typical
from tumble.challenge.scoring import Scored

Array = NDArray[np.float64]
BIASED = float(chi2.isf(0.0027, 3))
"""Chi-squared of three components that is as rare as three standard deviations of one."""
NEAR_ORACLE = 1.05
WHOLE = tuple(key for key, effect in MODELS.items() if effect.whole)
"""Effects that come in whole numbers, which are right or wrong and have no interval."""
INSIDE = float(chi2.isf(0.05, 3))
TWINS = ({"frame_rate", "length_scale"}, {"outline_offset", "view_outline_offset"})
"""Effects that no data of a free flight tell apart, or hardly: one clock's rate and all lengths scale a fall alike, and a body drawn too
large looks as one whose frames are drawn too small."""
LAWS = {"outgassing_thrust": {"body_fixed", "torque_body_fixed"}, "wall_attraction": {"towards_plane", "towards_point"}}
"""Terms of :mod:`estimator.effects.empirical.law_terms` of which a law for a hidden force should have one."""


def acceptance(scored: Scored) -> list[Figure]:
    """Every line that the challenge can decide; all but the sixth are of the silhouette tier and left out where that has no case."""
    every = scored.cases
    dropped = every["plate"].astype(bool) if "plate" in every else pd.Series(False, index=every.index)
    drawn = (every["tier"] == "silhouette") & ~dropped
    cases, pictures = every[drawn], every[~drawn & ~dropped]
    if dropped.all():
        return [*drops_figures(every, scored.impacts), *_times(every)]
    return [
        *(_drawn(scored, cases) if len(cases) else []),
        *(_rendered(pictures) if len(pictures) else []),
        *_times(cases if len(cases) else pictures),
    ]


def _drawn(scored: Scored, cases: pd.DataFrame) -> list[Figure]:
    """Cases of which every outline was projected."""
    kinds = {kind: cases[cases["kind"] == kind] for kind in ("single", "control", "pair", "outside")}
    above = kinds["single"][kinds["single"]["ratio"] >= 1.0]
    own = kinds["single"][kinds["single"]["own_ratio"] >= 1.0]
    pairs_certain = kinds["pair"][kinds["pair"]["certain"].astype(bool)]
    grouped = cases[(cases["group_size"] > 0) & (cases["kind"] != "outside")]
    sizes = grouped["group_size"].to_numpy(dtype=np.float64)
    return [
        share("1", "true effect first or in its alias group", above["within_group"] | above["named_first"], least=95.0, needed=240),
        share("1", "true effect alone and first", above["alone_first"], least=85.0, needed=240),
        share("1", "the same, or with nothing but the twin that no data tell it from", _alone_but_for_twins(above)),
        Figure("1", "effects among these cases", float(above["hidden"].nunique()), math.nan, math.nan, len(above), unit="effects"),
        share("1", "first or in its group, of those above the limit in their very campaign", own["within_group"] | own["named_first"]),
        typical("1", "members of an alias group, mean", sizes, np.mean, most=1.5, needed=100, unit="members"),
        Figure(
            "1",
            "members of an alias group, most",
            float(sizes.max(initial=0.0)),
            math.nan,
            math.nan,
            len(sizes),
            most=3.0,
            needed=100,
            unit="members",
        ),
        share("2", "false alarms on controls", kinds["control"]["false_alarm"], most=3.0, needed=100),
        share("3", "both effects of a pair found", kinds["pair"]["all_found"], least=85.0, needed=60),
        share("3", "the same where a fit that knows of both is certain of each", pairs_certain["all_found"]),
        share("3", "both in the last model, not merely in a group", _in_last_model(kinds["pair"])),
        *_outside(kinds["outside"]),
        *_after(scored, cases[cases["kind"].isin(["single", "pair"])]),
    ]


def _alone_but_for_twins(singles: pd.DataFrame) -> "pd.Series[bool]":
    """Whether the true effect is alone in its group, or with its twin."""
    rows = zip(singles["hidden"], singles["group"].astype(str), strict=True)
    with_twin = [any({hidden, *group.split("+")} <= pair for pair in TWINS) for hidden, group in rows]
    return singles["alone_first"] | (singles["within_group"] & np.array(with_twin, dtype=np.bool_))


def _in_last_model(cases: pd.DataFrame) -> "pd.Series[bool]":
    """Whether all hidden effects are in the last model themselves."""
    rows = zip(cases["hidden"].astype(str), cases["found"].astype(str), strict=True)
    return pd.Series([set(hidden.split("+")) <= set(found.split("+")) for hidden, found in rows], dtype=np.bool_)


def _rendered(cases: pd.DataFrame) -> list[Figure]:
    """Cases of which every picture was rendered."""
    singles = cases[cases["kind"] == "single"]
    right = singles["within_group"] | singles["named_first"]
    effects, stages = (float(singles[column].nunique()) for column in ("hidden", "true_stage"))
    controls = cases[cases["kind"] == "control"]
    return [
        share("6", "rendered cases with the true effect first or in its alias group", right, least=100 * 13 / 16, needed=16),
        Figure("6", "effects among the rendered cases", effects, math.nan, math.nan, len(singles), least=12.0, needed=16, unit="effects"),
        Figure("6", "their stages", stages, math.nan, math.nan, len(singles), least=len(Stage) - 1.0, needed=16, unit="stages"),
        share("6", "the same with the true effect alone and first", singles["alone_first"]),
        share("6", "false alarms on rendered controls", controls["false_alarm"]),
    ]


def _outside(cases: pd.DataFrame) -> list[Figure]:
    forces = cases[cases["hidden"].isin([k for k, e in SYNTH_ONLY.items() if e.stage is Stage.DYNAMICS])]
    named = forces[forces["law"].astype(str) != ""]
    right = pd.Series([bool(LAWS[hidden] & set(law.split("+"))) for hidden, law in zip(named["hidden"], named["law"], strict=True)])
    return [
        share("4", "effects outside of the catalogue reported as unknown", cases["unknown"], least=90.0, needed=60),
        share("4", "their stage right", cases["stage"] == cases["true_stage"], least=85.0, needed=60),
        typical(
            "4",
            "excess of held-out squares that the empirical force removes, median",
            _removed(forces, "empirical_px"),
            np.median,
            least=80.0,
            needed=30,
        ),
        typical("4", "the same, that the proposed law removes, median", _removed(forces, "law_px"), np.median),
        share("4", "proposed laws with a term of the right family", right.astype(bool)),
    ]


def _removed(cases: pd.DataFrame, model: str) -> Array:
    """Share (%) of the excess of held-out squares over the oracle's that a model removes; nothing where no model was proposed."""
    squares = cases[["base_px", model, "oracle_px"]].to_numpy(dtype=np.float64) ** 2
    excess = squares[:, 0] - squares[:, 2]
    removed = np.where(cases["unknown"].to_numpy(dtype=np.bool_), squares[:, 0] - squares[:, 1], 0.0)
    return np.asarray(100 * removed / np.where(excess > 0, excess, np.nan))


def _after(scored: Scored, cases: pd.DataFrame) -> list[Figure]:
    judged = cases[np.isfinite(cases["oracle_px"].astype(float)) | ~cases["answered"].astype(bool)]
    near = judged["final_px"] <= NEAR_ORACLE * judged["oracle_px"]
    within = {column: _inside(scored.parameters, column) for column in ("pull", "pull_of_noise")}
    whole = scored.parameters[scored.parameters["effect"].isin(WHOLE)] if len(scored.parameters) else pd.DataFrame({"pull": [], "case": []})
    return [
        share("5", "held-out RMS ETE within 5% of the oracle's", near, least=95.0, needed=240),
        *_gains(scored.velocities, cases),
        share_of_rows("5", "effect parameters inside their 95% interval", *within["pull"], least=90.0, most=99.0, needed=100),
        share_of_rows("5", "the same by noise alone, without the models' own accuracy", *within["pull_of_noise"]),
        share_of_rows("5", "numbers of missing frames right", whole["pull"] == 0.0, whole["case"]),
        *_honest(scored.velocities),
    ]


def _honest(velocities: pd.DataFrame) -> list[Figure]:
    """Whether velocities where nothing is hidden lie in the ellipsoids that are reported with them."""
    controls = velocities[velocities["kind"] == "control"] if len(velocities) else velocities
    return [
        share_of_rows("5", f"{words} of controls inside their 95% ellipsoid", controls[column].astype(float) <= INSIDE, controls["case"])
        for column, words in (("v_final_chi2", "velocities"), ("omega_final_chi2", "angular velocities"))
        if column in controls
    ]


def _inside(table: pd.DataFrame, column: str) -> "tuple[pd.Series[bool], pd.Series[str]]":
    """Which pulls lie in their 95% interval, and the case of each; whole numbers and what has no interval are left out."""
    table = table[~table["effect"].isin(WHOLE)] if len(table) else table
    pulls = table[column].to_numpy(dtype=np.float64) if len(table) else np.zeros(0)
    kept = np.isfinite(pulls)
    cases = table["case"][kept] if len(table) else pd.Series(dtype=str)
    return pd.Series(np.abs(pulls[kept]) <= 1.96), cases


FALL = "fall of velocity errors that the effect had biased beyond 3 sigma, median"


def velocity_falls(table: pd.DataFrame, model: str, of: Sequence[str] = ("v", "omega")) -> "pd.Series[float]":
    """How many times smaller velocity errors became where the effect had biased them by more than three sigma, per case and v or omega."""
    wanted = table[table["kind"].isin(["single", "pair"])] if len(table) else table
    falls = [pd.Series(dtype=np.float64)]
    for name in of:
        if f"{name}_{model}" not in wanted or f"{name}_bias_chi2" not in wanted:
            continue
        biased = wanted[wanted[f"{name}_bias_chi2"] > BIASED]
        before, after = ((biased[f"{name}_{m}"].astype(float) ** 2).groupby(biased["case"]).sum() ** 0.5 for m in ("base", model))
        falls.append(before / after)
    return pd.concat([each for each in falls if len(each)] or falls)


def velocity_gain(table: pd.DataFrame, model: str, what: str = FALL, of: Sequence[str] = ("v", "omega"), **bounds: Any) -> Figure:
    """The median of :func:`velocity_falls`."""
    falls = velocity_falls(table, model, of)
    cases = [str(case) for case in falls.index]
    return of_rows("5", what, np.asarray(falls, dtype=np.float64), cases, np.median, unit="times", **bounds)


def _gains(velocities: pd.DataFrame, cases: pd.DataFrame) -> list[Figure]:
    """The fall that is asked for, of every case, and where it comes from."""
    added = velocities[velocities["case"].isin(cases["case"][cases["found"].astype(str) != ""])] if len(velocities) else velocities
    return [
        velocity_gain(velocities, "final", least=5.0, needed=20),
        velocity_gain(added, "final", "the same where the verdict says that something is missing"),
        velocity_gain(velocities, "final", "the same of velocities without angular velocities", ("v",)),
        velocity_gain(velocities, "final", "the same of angular velocities", ("omega",)),
        velocity_gain(velocities, "oracle", "the same with a model that knows what is hidden"),
    ]


TIMED = (
    ("cpu_diagnose_s", 30.0, "diagnosing, slowest"),
    ("cpu_explain_s", 300.0, "explaining, slowest"),
    ("cpu_whole_s", 300.0, "the same with finding the particle and empirical terms, slowest"),
)


def _times(cases: pd.DataFrame) -> list[Figure]:
    found = []
    for column, most, what in TIMED:
        values = cases[column].to_numpy(dtype=np.float64)
        values = values[np.isfinite(values)]
        slowest = float(values.max()) if len(values) else math.nan
        found.append(Figure("7", what, slowest, math.nan, math.nan, len(values), most=most, unit="s of CPU time"))
    return found
