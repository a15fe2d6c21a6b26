"""What is hidden: drawn from the seed alone, of the sizes asked for, within what nature can do."""

from collections import Counter
from dataclasses import replace
from itertools import combinations, product

import numpy as np
import pytest

from datasets.recipes.effects import check_effects
from datasets.recipes.synth_only import SYNTH_ONLY
from datasets.vocabulary.effects import EFFECTS, PICTURED, Stage
from synth.effects.registry import REALISATIONS
from tumble.challenge.cases import Case, case_from_dict, case_to_dict
from tumble.challenge.drawing import (
    MOST_DROPPED,
    RENDERED,
    Counts,
    Plan,
    Shape,
    Sizes,
    can_reach_limit,
    draw_cases,
    is_plausible,
    pairs_of,
    worth_a_look,
)
from tumble.challenge.limits import TABLE, limit_along, read_table

TABLE_READ = read_table(TABLE)
REACHING = tuple(key for key in PICTURED if can_reach_limit(TABLE_READ, key))
PLAN = Plan(Shape(), Counts(75, 5, 20, 9), Sizes(), TABLE_READ)
CASES = draw_cases(PLAN, 11)


def of_kind(kind: str) -> list[Case]:
    return [case for case in CASES if case.kind == kind]


def test_the_seed_decides_everything() -> None:
    again = draw_cases(PLAN, 11)
    assert [(c.name, c.kind, c.recipe) for c in again] == [(c.name, c.kind, c.recipe) for c in CASES]
    assert [c.keys for c in draw_cases(PLAN, 12)] != [c.keys for c in CASES]


def test_views_that_are_off_leave_everything_else_as_it_is() -> None:
    off = draw_cases(replace(PLAN, shape=Shape(views_off_px=1.0)), 11)
    assert all(case.recipe.rig.calibration_px == 1.0 for case in off)
    assert [replace(c.recipe, rig=replace(c.recipe.rig, calibration_px=0.0)) for c in off] == [c.recipe for c in CASES]


def test_counts_are_those_asked_for_and_effects_take_turns() -> None:
    assert Counter(c.kind for c in CASES) == {"single": 75, "control": 5, "pair": 20, "outside": 9}
    assert Counter(c.keys[0] for c in of_kind("single")) == dict.fromkeys(PICTURED, 3)
    assert Counter(c.keys[0] for c in of_kind("outside")) == dict.fromkeys(SYNTH_ONLY, 3)
    assert all(len(set(c.keys)) == 2 for c in of_kind("pair"))
    assert len({c.keys for c in of_kind("pair")}) == 20


@pytest.mark.parametrize("seed", range(20))
def test_a_few_cases_cover_every_stage_with_different_effects(seed: int) -> None:
    counts, span = RENDERED
    plan = Plan(Shape(rendered=True), replace(counts, singles=8), span, TABLE_READ, REACHING)
    cases = [c for c in draw_cases(plan, seed) if c.kind == "single"]
    assert {EFFECTS[c.keys[0]].stage for c in cases} == set(Stage) - {Stage.CONTACT, Stage.TRACKING, Stage.GYROSCOPE}
    assert len({c.keys for c in cases}) == len(cases) == 8
    assert all(c.recipe.tier == "rendered" and c.least_ratio >= 1.0 for c in cases)


def test_effects_that_stay_below_their_limit_are_not_hidden_in_few_cases() -> None:
    assert len(REACHING) >= 20
    blooming = TABLE_READ.effects["blooming"]
    blind = replace(blooming, information=tuple(1e-6 * matrix for matrix in blooming.information))
    assert can_reach_limit(TABLE_READ, "blooming")
    assert not can_reach_limit(replace(TABLE_READ, effects={**TABLE_READ.effects, "blooming": blind}), "blooming")


def test_pairs_leave_out_what_stays_below_its_limit() -> None:
    blooming = TABLE_READ.effects["blooming"]
    blind = replace(blooming, information=tuple(1e-6 * matrix for matrix in blooming.information))
    table = replace(TABLE_READ, effects={**TABLE_READ.effects, "blooming": blind})
    plan = replace(PLAN, counts=Counts(0, 0, 300, 0), table=table, sizes=Sizes(pair=(1.0, 10.0)))
    assert "blooming" not in {key for case in draw_cases(plan, 5) for key in case.keys}
    small = replace(plan, sizes=Sizes(pair=(0.5, 10.0)))
    assert "blooming" in {key for case in draw_cases(small, 5) for key in case.keys}


def test_names_say_nothing() -> None:
    assert [case.name for case in CASES] == [f"c{i:03d}" for i in range(1, len(CASES) + 1)]
    assert [c.kind for c in CASES] != sorted(c.kind for c in CASES)


def test_every_recipe_can_be_realised() -> None:
    for case in CASES:
        check_effects(case.recipe.effects, case.recipe.sequences, case.name)
        assert set(case.keys) <= set(REALISATIONS)


def test_sizes_are_the_ratio_times_the_limit() -> None:
    for case in of_kind("single"):
        (effect,) = case.recipe.effects
        entry = EFFECTS[effect.key]
        columns = [np.atleast_1d(np.array(effect.values[name], dtype=np.float64)) for name in entry.sizes]
        ratio = 1.0 / limit_along(TABLE_READ, effect.key, np.stack(columns, axis=1))
        assert ratio == pytest.approx(case.ratios[effect.key])
        assert effect.key == "dropped_frames" or ratio <= 10.0 + 1e-9
        own = entry.scope.own
        assert all(len(c) == (case.recipe.sequences if own else 1) for c in columns)


def test_pairs_are_above_their_limits_unless_nature_forbids() -> None:
    ratios = [ratio for case in of_kind("pair") for ratio in case.ratios.values()]
    assert np.mean(np.array(ratios) >= 1.0) > 0.7


def test_pairs_that_no_data_resolve_are_not_drawn() -> None:
    pairs = {frozenset(pair) for pair in pairs_of(tuple(PICTURED))}
    scales, free = ("frame_rate", "length_scale"), ("gravity", "uniform_acceleration")
    refused = {frozenset(pair) for pair in (*product(scales, free), scales, free)}
    assert len(refused) == 6
    assert pairs == {frozenset(pair) for pair in combinations(PICTURED, 2)} - refused


def test_sizes_stay_plausible_where_that_is_asked_for() -> None:
    plan = Plan(Shape(), Counts(75, 0, 0, 0), Sizes(), TABLE_READ, plausible=True)
    assert all(is_plausible(effect) for case in draw_cases(plan, 4) for effect in case.recipe.effects)
    assert not all(is_plausible(effect) for case in of_kind("single") for effect in case.recipe.effects)


def test_dropped_frames_come_in_whole_numbers_in_at_least_one_sequence() -> None:
    plan = Plan(Shape(), Counts(20, 0, 0, 0), Sizes(), TABLE_READ, ("dropped_frames",))
    for case in draw_cases(plan, 3):
        counts = np.array(case.recipe.effects[0].values["count"])
        assert set(counts) <= set(range(MOST_DROPPED + 1))
        assert counts.any()
        after = np.array(case.recipe.effects[0].values["after_frame"])
        assert np.all((after >= 8) & (after < 72))


def test_a_vibration_has_a_frequency_that_is_searched_for() -> None:
    plan = Plan(Shape(), Counts(20, 0, 0, 0), Sizes(), TABLE_READ, ("camera_vibration",))
    frequencies = [case.recipe.effects[0].values["frequency"] for case in draw_cases(plan, 3)]
    assert 70.0 < min(frequencies) < max(frequencies) <= 1000.0


def test_a_case_survives_its_file() -> None:
    for case in CASES[:20]:
        back = case_from_dict(case_to_dict(case))
        assert back.recipe == case.recipe
        assert (back.name, back.kind, back.views) == (case.name, case.kind, case.views)


def test_what_is_hidden_for_a_look_is_of_a_size_that_nature_gives_it_and_that_data_show() -> None:
    plan = Plan(Shape(), Counts(1, 0, 0, 0), Sizes((2.0, 10.0)), TABLE_READ)
    cases = [worth_a_look(plan, seed) for seed in range(60)]
    assert all(is_plausible(effect) for case in cases for effect in case.recipe.effects)
    assert min(case.least_ratio for case in cases) >= 1.0
    assert len({case.keys for case in cases}) > 10
    assert worth_a_look(plan, 7).recipe == cases[7].recipe
