"""Drops onto a plate in the challenge: what is drawn, and how measured impacts are held against true ones."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from datasets.recipes.checks import check_recipe
from datasets.truth import Truth
from datasets.truth_files import write_truth
from datasets.vocabulary.effects import EFFECTS
from synth.sequence import plan_sequence, truth_of
from tests.estimator.test_measure import RECIPE
from tumble.challenge.cases import Case, case_folder, case_from_dict, case_to_dict
from tumble.challenge.drawing import DROPPED, DROPS, Plan, Shape, can_reach_limit, draw_cases
from tumble.challenge.drops import drops_figures, impact_rows
from tumble.challenge.limits import TABLE, read_table
from tumble.cli.main import main

TABLE_READ = read_table(TABLE)
KEYS = tuple(key for key in TABLE_READ.effects if EFFECTS[key].stage in DROPPED and can_reach_limit(TABLE_READ, key))
CASES = draw_cases(Plan(Shape(frames=40, drops=True), *DROPS, TABLE_READ, KEYS), 3)


def test_every_campaign_is_dropped_onto_a_plate() -> None:
    assert len(CASES) == 60
    for case in CASES:
        check_recipe(case.recipe, case.name)
        assert case.recipe.plate is not None
        assert case.recipe.dropper.frames_before == case.recipe.dropper.frames_after == (30, 40)
        assert case_from_dict(case_to_dict(case)) == case
        assert all(EFFECTS[key].stage in DROPPED for key in case.keys)


def test_drops_are_no_field_campaigns(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["challenge", "make", "--field", "--drops", "--out", str(tmp_path / "out")]) == 2
    assert "--drops" in capsys.readouterr().err


@pytest.fixture(scope="module")
def truth() -> Truth:
    """A drop with one impact; the stamps of its frames are 1 ms early."""
    made = truth_of(plan_sequence(RECIPE, 0))
    stamps = made.motion.times_s
    return replace(made, name="c001-1", motion=replace(made.motion, times_s=stamps - 1e-3), notes={"true_times_s": stamps.tolist()})


def answer(truth: Truth, off: float) -> dict[str, Any]:
    """The impact measured with every component ``off`` standard deviations away."""
    (true,), sigma = truth.impacts, np.array([1e-3] * 3 + [0.1] * 3)
    last = int(np.searchsorted(truth.notes["true_times_s"], true.time_s)) - 1
    before, after = np.r_[true.v_before, true.omega_before] + off * sigma, np.r_[true.v_after, true.omega_after] + off * sigma
    ends = truth.motion.times_s[[last, last + 1]].tolist()
    measured = {"before": before.tolist(), "after": after.tolist(), "covariance": np.diag(np.tile(sigma**2, 2)).tolist()}
    return {"impacts": [{"recording": truth.name, "between_s": ends, "time_s": ends[0], "spread_s": 0.0, **measured}]}


@pytest.mark.parametrize(("off", "inside"), [(1.0, True), (3.0, False)])
def test_velocities_at_an_impact_are_held_against_the_true_ones(tmp_path: Path, truth: Truth, off: float, inside: bool) -> None:
    case = Case("c001", "control", RECIPE, 40, {})
    write_truth(truth, case_folder(tmp_path, "c001") / truth.name)
    (row,) = impact_rows(case, tmp_path, answer(truth, off))
    assert row["v_before_chi2"] == pytest.approx(3.0 * off**2)
    assert row["omega_after_chi2"] == pytest.approx(3.0 * off**2)
    figures = {each.what: each for each in drops_figures(_cases(), pd.DataFrame([row]))}
    assert figures["v after the impact inside its 95% ellipsoid"].value == 100.0 * inside


def test_an_impact_of_two_contacts_is_not_judged(tmp_path: Path, truth: Truth) -> None:
    twice = replace(truth, impacts=truth.impacts * 2)
    write_truth(twice, case_folder(tmp_path, "c001") / truth.name)
    assert impact_rows(Case("c001", "control", RECIPE, 40, {}), tmp_path, answer(truth, 1.0)) == []


def _cases() -> pd.DataFrame:
    single = {"kind": "single", "own_ratio": 2.0, "within_group": True, "named_first": False, "false_alarm": False}
    return pd.DataFrame([single, {**single, "own_ratio": 0.5, "within_group": False}, {**single, "kind": "control"}])


def test_effects_above_their_limit_count() -> None:
    named, every, alarms = drops_figures(_cases(), pd.DataFrame())
    assert (named.value, named.n, every.value, alarms.value) == (100.0, 1, 50.0, 0.0)
