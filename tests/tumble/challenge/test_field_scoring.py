"""Names, probabilities and intervals of field campaigns are counted as they are meant."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tumble.challenge.field_case import FieldCase, FlightPlan, Noise
from tumble.challenge.field_figures import calibration_error, field_figures, reliability
from tumble.challenge.field_files import write_true_motion
from tumble.challenge.field_flights import DENSE, flown
from tumble.challenge.field_scoring import (
    FieldScored,
    case_row,
    false_names,
    hidden_rows,
    log_score,
    parameter_rows,
    probability_rows,
    velocity_rows,
)

FLIGHT = FlightPlan("f-1", 10, 100.0, (1.0, 0.0, 2.0), (1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))
HIDDEN = {"quadratic_drag": {"per_length": (0.2,)}, "gravity": {"dg_x": (0.1,), "dg_y": (0.0,), "dg_z": (0.0,)}}
MESS = {"uniform_acceleration": {"a_x": (0.1,), "a_y": (0.0,), "a_z": (0.0,)}, "length_scale": {"relative": (1e-4,)}}


def case_of(*, rounded: bool = True, **changes: Any) -> FieldCase:
    noise = Noise({"x": 1e-3, "theta": 1e-2}, 2, 0.01, rounded, False)
    plain = {"hidden": HIDDEN, "over_limit": {"quadratic_drag": 2.0, "gravity": 3.0}, "mess": MESS, "mess_over_limit": {}, "outside": {}}
    return FieldCase("f", 1, "poses", (0.6, 0.8, 1.0), (FLIGHT,), noise, **{**plain, **changes})


def answer_of(*groups: tuple[str, ...], **more: Any) -> dict[str, Any]:
    steps = [{"added": group[0], "group": list(group), "names": [name.split("+") for name in group]} for group in groups]
    return {"found": [group[0] for group in groups], "steps": steps, "unknown": False, "parameters": [], **more}


def test_a_name_is_false_where_nothing_hidden_is_in_its_group() -> None:
    case = case_of()
    assert false_names(case, answer_of(("length_scale", "gravity"), ("quadratic_drag",))) == []
    assert false_names(case, answer_of(("length_scale", "frame_rate"), ("linear_drag", "quadratic_drag"))) == ["length_scale"]
    assert false_names(case_of(hidden={}, over_limit={}), answer_of(("gravity",))) == ["gravity"]


def test_a_name_of_two_effects_is_right_where_both_were_hidden_and_unknown_where_the_catalogue_lacks_it() -> None:
    case = case_of()
    assert false_names(case, answer_of(("position_distortion", "gravity+quadratic_drag"))) == []
    assert false_names(case, answer_of(("position_distortion", "gravity+linear_drag"))) == ["position_distortion"]
    assert false_names(case, answer_of(("length_scale", "unknown"))) == ["length_scale"]
    assert false_names(case_of(outside={"wall": {}}), answer_of(("length_scale", "unknown"))) == []
    rows = {row["effect"]: row["named"] for row in hidden_rows(case, answer_of(("position_distortion", "gravity+linear_drag")))}
    assert rows == {"quadratic_drag": False, "gravity": False}


def test_what_is_only_suspected_is_told_apart() -> None:
    answer = answer_of(("length_scale",), ("gravity",))
    answer["steps"][0]["established"] = False
    row = case_row(case_of(), answer)
    assert (row["false_names"], row["false_names_or_suspected"], row["suspected"]) == ("", "length_scale", "length_scale")


def test_pushes_and_the_jitter_of_rounded_stamps_are_truly_there() -> None:
    answer = answer_of(("uniform_acceleration",), ("trigger_jitter",), ("stamp_scatter",))
    assert false_names(case_of(), answer) == []
    assert false_names(case_of(rounded=False), answer) == ["trigger_jitter", "stamp_scatter"]
    assert false_names(case_of(mess={}), answer) == ["uniform_acceleration"]
    stated = {"uniform_acceleration": 0.9, "trigger_jitter": 0.9, "gravity": 0.8, "length_scale": 0.1, "unknown": 0.2}
    rows = {row["effect"]: row["true"] for row in probability_rows(case_of(), answer_of(probability=stated))}
    assert rows == {"gravity": True, "length_scale": False, "unknown": False}


def test_a_hidden_effect_is_named_in_a_group_and_found_in_the_model() -> None:
    rows = {row["effect"]: row for row in hidden_rows(case_of(), answer_of(("length_scale", "gravity")))}
    assert (rows["gravity"]["named"], rows["gravity"]["found"], rows["quadratic_drag"]["named"]) == (True, False, False)


def test_a_force_outside_of_the_catalogue_is_an_unknown() -> None:
    case = case_of(hidden={}, outside={"wall_attraction": {"strength": (1.0,)}}, over_limit={"wall_attraction": 2.0})
    assert hidden_rows(case, answer_of()) == []
    assert probability_rows(case, answer_of(probability={"unknown": 0.7}))[0]["true"]


def test_parameters_are_held_against_all_that_is_there() -> None:
    value = {"parameter": "a_x", "value": 0.12, "sigma": 0.01, "is_size": True, "sequence": "f-1", "effect": "uniform_acceleration"}
    drag = {"parameter": "per_length", "value": 0.19, "sigma": 0.01, "is_size": True, "sequence": None, "effect": "quadratic_drag"}
    other = {**drag, "effect": "linear_drag", "parameter": "rate"}
    rows = parameter_rows(case_of(), answer_of(parameters=[value, drag, other]))
    assert [row["pull"] for row in rows] == pytest.approx([2.0, -1.0])
    assert [row["hidden"] for row in rows] == [False, True]


def test_velocities_are_held_against_the_true_motion(tmp_path: Path) -> None:
    case = case_of()
    flight = flown(case, 0, DENSE)
    write_true_motion(flight, tmp_path / "truth" / "f" / "f-1.csv")
    true = [*flight.motion.v_world[8], *flight.motion.omega_world[8]]
    state = {"sequence": "f-1", "time_s": float(flight.nominal_s[8]), "v_world": [true[0] + 0.01, *true[1:3]], "omega_world": true[3:]}
    covariance = (1e-4 * np.eye(6)).tolist()
    rows = velocity_rows(case, tmp_path, answer_of(velocities={"final": [{**state, "covariance": covariance}]}))
    assert [row["of"] for row in rows] == ["v", "omega"]
    assert [row["chi2"] for row in rows] == pytest.approx([1.0, 0.0], abs=1e-4)


def test_the_model_that_velocities_are_of_says_by_which_clock_they_are(tmp_path: Path) -> None:
    """A frame rate that is told in the unknown's place is not in the fit that velocities are of."""
    rate = 0.02
    case = case_of(hidden={**HIDDEN, "frame_rate": {"relative": (rate,)}})
    flight = flown(case, 0, DENSE)
    write_true_motion(flight, tmp_path / "truth" / "f" / "f-1.csv")

    def errors(time_s: float, **told: Any) -> list[float]:
        true = {"v_world": flight.motion.v_world[8].tolist(), "omega_world": flight.motion.omega_world[8].tolist()}
        state = {"sequence": "f-1", "time_s": time_s, **true, "covariance": np.eye(6).tolist()}
        return [row["error"] for row in velocity_rows(case, tmp_path, answer_of(**told, velocities={"final": [state]}))]

    by_recorder = float(flight.nominal_s[8])
    by_true = by_recorder / (1.0 + rate)
    assert errors(by_true, found=["frame_rate"]) == pytest.approx([0.0, 0.0], abs=1e-5)
    assert errors(by_true, found=[], model=["frame_rate"]) == pytest.approx([0.0, 0.0], abs=1e-5)
    assert errors(by_recorder, found=["frame_rate"], model=["smooth_time_shift"]) == pytest.approx([0.0, 0.0], abs=1e-5)


def test_probabilities_that_come_true_as_often_as_stated_have_no_calibration_error() -> None:
    p, true = np.repeat([0.05, 0.75], [100, 40]), np.zeros(140, dtype=bool)
    true[:5], true[100:130] = True, True
    assert calibration_error(p, true) == pytest.approx(0.0, abs=1e-9)
    assert calibration_error(np.full(10, 0.95), np.zeros(10, dtype=bool)) == pytest.approx(95.0)
    curve = reliability(pd.DataFrame({"probability": p, "true": true, "case": "f"}))
    assert curve["true"].tolist() == pytest.approx([5.0, 75.0])
    assert curve["n"].tolist() == [100, 40]


def test_the_logarithmic_score_is_that_of_the_truth() -> None:
    assert log_score(0.5, true=True) == pytest.approx(np.log(0.5))
    assert log_score(0.9, true=False) == pytest.approx(np.log(0.1))
    assert np.isfinite(log_score(1.0, true=False))


def test_figures_can_be_told_where_nothing_was_hidden_or_found() -> None:
    case = case_of(hidden={}, over_limit={})
    rows = [{"case": "f", "measured": case.measured, **case_row(case, answer_of())}]
    figures = {f.what: f for f in field_figures(FieldScored(pd.DataFrame(rows), *(pd.DataFrame() for _ in range(4))))}
    assert figures["campaigns with a false name"].value == 0.0
    assert figures["campaigns with a false name"].verdict == "TOO FEW CASES"
    assert figures["hidden effects named or in a group"].verdict == "TOO FEW CASES"
