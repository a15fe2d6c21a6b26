"""Scores of made-up answers: what is right counts as right, and each figure can be missed."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from datasets.errors import InputError
from datasets.recipes.recipe import EffectRecipe, Recipe
from tumble.challenge.acceptance import acceptance
from tumble.challenge.answers import no_answer
from tumble.challenge.cases import Case, Kind
from tumble.challenge.detection import detection_table
from tumble.challenge.figures import HELD, MISSED, NOT_ASKED, TOO_FEW, line_of, share, share_of_rows
from tumble.challenge.scoring import NO_ANSWER, Scored, named, pulls
from tumble.challenge.summary import TABLES, falls, of_challenge, pooled, read_tables, table_path, write_tables


def case(kind: Kind, *keys: str) -> Case:
    return Case("c001", kind, Recipe(effects=tuple(EffectRecipe(key, {}) for key in keys)), 40, dict.fromkeys(keys, 2.0))


def answer(*steps: tuple[str, ...], unknown: bool = False) -> dict[str, Any]:
    said = [{"added": group[0], "group": list(group)} for group in steps]
    found = [group[0] for group in steps]
    return {"steps": said, "found": found, "unknown": unknown, "stage": "dynamics" if unknown else "", "left_out": [], "parameters": []}


def test_a_name_alone_and_first() -> None:
    row = named(case("single", "gravity"), answer(("gravity",)))
    assert (row["first"], row["named_first"], row["alone_first"], row["all_found"]) == ("gravity", True, True, True)


def test_a_name_within_a_group() -> None:
    row = named(case("single", "quadratic_drag"), answer(("linear_drag", "quadratic_drag")))
    assert not row["named_first"]
    assert not row["alone_first"]
    assert row["within_group"]
    assert row["all_found"]


def test_a_wrong_name_finds_nothing() -> None:
    row = named(case("single", "linear_drag"), answer(("gravity",)))
    assert not any(row[key] for key in ("within_group", "named_first", "all_found"))


def test_both_of_a_pair_must_be_found() -> None:
    pair = case("pair", "gravity", "blooming")
    assert named(pair, answer(("blooming",), ("gravity",)))["all_found"]
    assert not named(pair, answer(("blooming",)))["all_found"]


def test_false_alarms() -> None:
    assert not named(case("control"), answer())["false_alarm"]
    assert named(case("control"), answer(("gravity",)))["false_alarm"]
    assert named(case("control"), answer(unknown=True))["false_alarm"]


def test_where_the_solver_crashed_nothing_is_right() -> None:
    crashed = no_answer([NO_ANSWER])
    assert named(case("control"), crashed)["false_alarm"]
    assert named(case("control"), crashed)["first"] == NO_ANSWER
    assert not named(case("single", "gravity"), crashed)["all_found"]
    drawn = table(250, 0, 0)
    lost = {**drawn.cases.iloc[0].to_dict(), **named(case("single", "gravity"), crashed), "oracle_px": math.nan, "final_px": math.nan}
    figures = {
        f.what: f for f in acceptance(Scored(pd.DataFrame([*drawn.cases.to_dict("records"), lost]), drawn.parameters, drawn.velocities))
    }
    assert figures["held-out RMS ETE within 5% of the oracle's"].value == pytest.approx(100 * 250 / 251)


def test_a_step_whose_effect_was_dropped_in_the_end_names_nothing() -> None:
    said = {**answer(("gravity",)), "found": []}
    assert named(case("single", "gravity"), said)["first"] == "nothing"
    assert not named(case("control"), said)["false_alarm"]


def test_outside_of_the_catalogue() -> None:
    row = named(case("outside", "wall_attraction"), answer(unknown=True))
    assert (row["first"], row["stage"], row["true_stage"]) == ("unknown", "dynamics", "dynamics")


def test_pulls_are_errors_over_their_standard_deviations() -> None:
    hidden = Case("c001", "single", Recipe(sequences=2, effects=(EffectRecipe("uniform_acceleration", {"a_x": (1.0, 2.0)}),)), 40, {})
    row = {"effect": "uniform_acceleration", "parameter": "a_x", "sequence": "c001-2", "value": 2.3, "is_size": True}
    row |= {"sigma": 0.1, "sigma_of_noise": 0.05}
    other = {**row, "effect": "gravity", "parameter": "dg_x", "sequence": None}
    (found,) = pulls(hidden, {"parameters": [row, other]}, np.eye(3))
    assert found["true"] == 2.0
    assert (found["pull"], found["pull_of_noise"]) == pytest.approx((3.0, 6.0))


def test_a_centre_of_mass_is_judged_along_the_axes_that_were_found() -> None:
    hidden = Case("c001", "single", Recipe(effects=(EffectRecipe("centre_of_mass", {"c1": 1.0, "c2": 2.0, "c3": 3.0}),)), 40, {})
    row = {"effect": "centre_of_mass", "parameter": "c2", "sequence": None, "value": -2.0, "is_size": True}
    row |= {"sigma": 0.1, "sigma_of_noise": 0.1}
    (found,) = pulls(hidden, {"parameters": [row]}, np.diag([1.0, -1.0, -1.0]))
    assert found["pull"] == pytest.approx(0.0)


def table(hits: int, misses: int, alarms: int) -> Scored:
    base = {
        "ratio": 3.0,
        "own_ratio": 2.0,
        "base_px": 0.3,
        "final_px": 0.2,
        "oracle_px": 0.2,
        "empirical_px": math.nan,
        "law_px": math.nan,
        "law": "",
        "stage": "",
        "true_stage": "",
    }
    base |= {"cpu_register_s": 1.0, "cpu_diagnose_s": 10.0, "cpu_explain_s": 50.0, "cpu_whole_s": 90.0, "unknown": False, "certain": True}
    rows = [{**base, **named(case("single", "gravity"), answer(("gravity",))), "ratio": 3.0}] * hits
    rows += [{**base, **named(case("single", "gravity"), answer(("blooming",))), "final_px": 0.3, "ratio": 3.0}] * misses
    rows += [{**base, **named(case("control"), answer()), "ratio": math.nan}] * (110 - alarms)
    rows += [{**base, **named(case("control"), answer(("gravity",))), "ratio": math.nan}] * alarms
    pulls = {"pull": np.linspace(-2.05, 2.05, 200), "pull_of_noise": np.linspace(-2.5, 2.5, 200)}
    parameters = pd.DataFrame({"case": [f"c{i // 4}" for i in range(200)], "effect": "gravity", **pulls})
    velocities = pd.DataFrame(
        [
            {"case": f"c{i}", "kind": "single", "v_base": 0.1, "v_final": 0.01 + 1e-4 * i, "v_bias_chi2": 50.0, "omega_bias_chi2": 1.0}
            for i in range(40)
        ]
    )
    return Scored(pd.DataFrame(rows), parameters, velocities)


def test_a_pair_of_which_one_is_merely_in_a_group_is_told() -> None:
    drawn = table(1, 0, 0)
    steps = (answer(("gravity",), ("blooming",)), answer(("gravity",), ("outline_offset", "blooming")))
    rows = [{**drawn.cases.iloc[0].to_dict(), **named(case("pair", "gravity", "blooming"), said)} for said in steps]
    figures = {f.what: f.value for f in acceptance(Scored(pd.DataFrame(rows), drawn.parameters, drawn.velocities))}
    assert figures["both effects of a pair found"] == 100.0
    assert figures["both in the last model, not merely in a group"] == 50.0


@pytest.mark.parametrize(
    ("group", "counts"),
    [(("length_scale", "frame_rate"), 100.0), (("frame_rate",), 100.0), (("frame_rate", "gravity"), 0.0), (("gravity",), 0.0)],
)
def test_a_twin_that_no_data_tell_apart_is_counted_beside(group: tuple[str, ...], counts: float) -> None:
    drawn = table(1, 0, 0)
    row = {**drawn.cases.iloc[0].to_dict(), **named(case("single", "frame_rate"), answer(group))}
    figures = {f.what: f for f in acceptance(Scored(pd.DataFrame([row]), drawn.parameters, drawn.velocities))}
    beside = figures["the same, or with nothing but the twin that no data tell it from"]
    assert (beside.value, beside.verdict) == (counts, NOT_ASKED)


def verdicts(scored: Scored) -> dict[str, str]:
    return {figure.what: figure.verdict for figure in acceptance(scored)}


def test_a_perfect_solver_holds_every_line_that_has_cases() -> None:
    found = verdicts(table(250, 0, 0))
    assert found.pop("both effects of a pair found") == TOO_FEW
    assert found.pop("the same where a fit that knows of both is certain of each") == TOO_FEW
    assert found.pop("first or in its group, of those above the limit in their very campaign") == NOT_ASKED
    assert found.pop("the same, or with nothing but the twin that no data tell it from") == NOT_ASKED
    assert found.pop("effects among these cases") == NOT_ASKED
    assert found.pop("both in the last model, not merely in a group") == TOO_FEW
    assert found.pop("the same by noise alone, without the models' own accuracy") == NOT_ASKED
    assert found.pop("numbers of missing frames right") == TOO_FEW
    falls = ("where the verdict says that something is missing", "of velocities without angular velocities", "of angular velocities")
    for of in (*falls, "with a model that knows what is hidden"):
        assert found.pop(f"the same {of}") in {TOO_FEW, NOT_ASKED}
    outside = [what for what in found if "outside" in what or "stage" in what or "empirical force" in what or "law" in what]
    assert all(found.pop(what) == TOO_FEW for what in outside)
    assert set(found.values()) == {HELD}


def test_a_poor_solver_misses() -> None:
    found = verdicts(table(220, 30, 5))
    missed = {what for what, verdict in found.items() if verdict == MISSED}
    assert missed >= {
        "true effect first or in its alias group",
        "false alarms on controls",
        "held-out RMS ETE within 5% of the oracle's",
    }


def test_what_a_campaign_cannot_show_is_counted_apart() -> None:
    drawn = table(90, 10, 0)
    missed = ~drawn.cases["named_first"] & (drawn.cases["kind"] == "single")
    weak = drawn.cases.assign(own_ratio=np.where(missed & (missed.cumsum() <= 5), 0.9, 2.0))
    found = {f.what: f for f in acceptance(Scored(weak, drawn.parameters, drawn.velocities))}
    own = found["first or in its group, of those above the limit in their very campaign"]
    assert (own.n, own.value) == (95, pytest.approx(100 * 90 / 95))
    assert found["true effect first or in its alias group"].value == pytest.approx(90.0)


def test_rendered_cases_are_counted_apart() -> None:
    drawn = table(250, 0, 0)
    pictures = drawn.cases[drawn.cases["kind"] == "single"].head(16).assign(tier="rendered", hidden=[f"e{i % 13}" for i in range(16)])
    pictures = pictures.assign(named_first=[i > 3 for i in range(16)], within_group=False)
    figures = acceptance(Scored(pd.concat([drawn.cases, pictures]), drawn.parameters, drawn.velocities))
    right, effects, stages, alone, alarms = (f for f in figures if f.line == "6")
    assert (right.value, right.verdict) == (75.0, MISSED)
    assert (effects.value, effects.verdict) == (13.0, HELD)
    assert (stages.value, stages.verdict) == (1.0, MISSED)
    assert (alone.verdict, alarms.n, alarms.verdict) == (NOT_ASKED, 0, TOO_FEW)
    assert next(f for f in figures if f.line == "1").n == 250


def test_pictures_alone_decide_no_line_of_outlines() -> None:
    drawn = table(20, 0, 1)
    figures = acceptance(Scored(drawn.cases.assign(tier="rendered"), drawn.parameters, drawn.velocities))
    assert {f.line for f in figures} == {"6", "7"}
    assert next(f for f in figures if f.what == "false alarms on rendered controls").value == pytest.approx(100 / 110)


def test_laws_of_unknown_forces() -> None:
    """Excess of 0.3² over 0.1²; the empirical term leaves 0.02, the law 0.05; of three laws two are of the right kind."""
    drawn = table(250, 0, 0)
    base = {**drawn.cases.iloc[0].to_dict(), "kind": "outside", "base_px": 0.3, "oracle_px": 0.1, "empirical_px": 0.02**0.5}
    base["unknown"] = True
    laws = (("outgassing_thrust", "body_fixed"), ("wall_attraction", "against_spin+towards_plane"), ("wall_attraction", "body_fixed"))
    rows = [{**base, "hidden": hidden, "law": law, "law_px": 0.05**0.5} for hidden, law in laws]
    missed = {**base, "hidden": "wall_attraction", "unknown": False, "law": "", "empirical_px": np.nan, "law_px": np.nan}
    removed = {f.what: f for f in acceptance(Scored(pd.DataFrame([*rows, *[missed] * 4]), drawn.parameters, drawn.velocities))}
    assert removed["excess of held-out squares that the empirical force removes, median"].value == 0.0  # four of seven were missed
    figures = {f.what: f for f in acceptance(Scored(pd.DataFrame(rows), drawn.parameters, drawn.velocities))}
    assert figures["excess of held-out squares that the empirical force removes, median"].value == pytest.approx(100 * 7 / 8)
    assert figures["the same, that the proposed law removes, median"].value == pytest.approx(50.0)
    assert figures["proposed laws with a term of the right family"].value == pytest.approx(200 / 3)


def test_the_fall_of_velocity_errors_counts_every_case_and_tells_where_something_was_added() -> None:
    """Ten cases whose errors fall tenfold, eleven of which the verdict says nothing: those are not left out of what is asked for."""
    drawn = table(1, 0, 0)
    steps = [answer(("gravity",))] * 10 + [answer()] * 11
    rows = [{**drawn.cases.iloc[0].to_dict(), **named(case("single", "gravity"), said), "case": f"c{i}"} for i, said in enumerate(steps)]
    errors = [{"v_base": 1.0, "v_final": 0.1 if i < 10 else 1.0, "v_oracle": 0.05, "v_bias_chi2": 50.0} for i in range(21)]
    turns = {"omega_base": 1.0, "omega_final": 0.5, "omega_oracle": 0.5, "omega_bias_chi2": 1.0}
    velocities = pd.DataFrame([{"case": f"c{i}", "kind": "single", **each, **turns} for i, each in enumerate(errors)])
    figures = {f.what: f for f in acceptance(Scored(pd.DataFrame(rows), drawn.parameters, velocities))}
    asked = figures["fall of velocity errors that the effect had biased beyond 3 sigma, median"]
    assert (asked.value, asked.n, asked.verdict) == (pytest.approx(1.0), 21, MISSED)
    added = figures["the same where the verdict says that something is missing"]
    assert (added.value, added.n, added.verdict) == (pytest.approx(10.0), 10, NOT_ASKED)
    assert figures["the same with a model that knows what is hidden"].value == pytest.approx(20.0)
    assert figures["the same of angular velocities"].n == 0
    (row,) = falls(Scored(pd.DataFrame(rows), drawn.parameters, velocities))
    assert (row["effect"], row["n"], row["fall"], row["known"]) == ("gravity", 21, pytest.approx(1.0), pytest.approx(20.0))


def test_a_share_has_an_exact_interval_and_is_printed_with_its_number() -> None:
    figure = share("2", "false alarms", pd.Series([True] + [False] * 99), most=3.0)
    assert (figure.value, figure.n, figure.verdict) == (1.0, 100, HELD)
    assert figure.low == pytest.approx(0.0253, abs=1e-3)
    assert figure.high == pytest.approx(5.446, abs=1e-2)
    assert "n = 100" in line_of(figure)
    assert line_of(figure).endswith("HELD")


def test_rows_of_one_case_count_as_one_another() -> None:
    """Forty cases whose four rows agree: the interval is that of forty draws, not of a hundred and sixty."""
    right = pd.Series(np.repeat(np.arange(40) % 5 > 0, 4))
    figure = share_of_rows("5", "inside", right, pd.Series(np.repeat([f"c{i}" for i in range(40)], 4)), least=90.0)
    assert (figure.value, figure.n, figure.verdict) == (pytest.approx(80.0), 160, MISSED)
    assert figure.high - figure.low == pytest.approx(2 * 196 * (0.8 * 0.2 / 40) ** 0.5, rel=0.15)
    assert share_of_rows("5", "inside", right[:0], pd.Series(dtype=str)).verdict == TOO_FEW


def test_detection_against_size_is_recovered() -> None:
    rng = np.random.default_rng(2)
    ratio = np.exp(rng.uniform(np.log(0.3), np.log(10.0), size=1500))
    found = np.log(ratio / 0.8) / 0.35 + rng.normal(size=ratio.size) > 0
    cases = pd.DataFrame({"kind": "single", "hidden": np.where(rng.random(ratio.size) < 0.5, "a", "b"), "ratio": ratio, "all_found": found})
    rows = detection_table(cases).set_index("effect")
    assert list(rows.index) == ["all", "a", "b"]
    for key in rows.index:
        assert rows.loc[key, "half_low"] < 0.8 < rows.loc[key, "half_high"]
    assert rows.loc["all", "in_95_percent"] == pytest.approx(0.8 * np.exp(1.645 * 0.35), rel=0.15)


def test_effects_that_are_found_at_different_sizes_do_not_widen_the_curve_of_each() -> None:
    rng = np.random.default_rng(4)
    middles = {"a": 0.3, "b": 0.8, "c": 1.6, "d": 4.0}
    hidden = np.repeat(list(middles), 200)
    ratio = np.exp(rng.uniform(np.log(0.2), np.log(10.0), size=hidden.size))
    found = np.log(ratio / [middles[key] for key in hidden]) / 0.2 + rng.normal(size=ratio.size) > 0
    rows = detection_table(pd.DataFrame({"kind": "single", "hidden": hidden, "ratio": ratio, "all_found": found})).set_index("effect")
    for key, middle in middles.items():
        assert rows.loc[key, "in_95_percent"] == pytest.approx(middle * np.exp(1.645 * 0.2), rel=0.2)


def test_challenges_are_pooled_from_their_files(tmp_path: Path) -> None:
    """What two challenges give together, one of them read back, are the figures of all their cases."""
    first, second = table(150, 10, 2), table(100, 20, 0)
    result = tmp_path / "first.json"
    parameters = first.parameters.assign(case="c001")
    tagged = of_challenge(Scored(first.cases, parameters, first.velocities), 11)
    write_tables(tagged, {name: table_path(result, name) for name in TABLES})
    both = pooled([read_tables(result, without=12), of_challenge(Scored(second.cases, parameters, second.velocities), 12)])
    found = {figure.what: figure for figure in acceptance(both)}
    right = found["true effect first or in its alias group"]
    assert (right.n, right.value) == (280, pytest.approx(100 * 250 / 280))
    assert found["false alarms on controls"].value == pytest.approx(100 * 2 / 220)
    assert both.velocities["case"].nunique() == 80
    with pytest.raises(InputError, match="expected other challenges"):
        read_tables(result, without=11)
    with pytest.raises(InputError, match="expected a table"):
        read_tables(tmp_path / "other.json", without=1)
