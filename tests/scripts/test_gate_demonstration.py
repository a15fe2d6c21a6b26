"""The gate demonstration at its smallest: a change finds what it replaces and puts it back, noise is fresh, verdicts become a page."""

import json
from pathlib import Path

import numpy as np
import pytest

from datasets.scoring.gate import Baseline
from datasets.scoring.gate_measures import MEASURES
from scripts.gate.gate_changes import FAULTS, HARMLESS, Change, fresh_noise
from scripts.gate.gate_demonstration import Work, fresh, judged, rows_of
from scripts.gate.gate_demonstration_page import page
from synth.sequence import build_silhouette_sequence
from tests.tumble.made_up import CAMPAIGN_OF_A_SET, small_recipe
from tumble.challenge import field_making
from tumble.gate.sets import case_of


@pytest.fixture(scope="module")
def work(tmp_path_factory: pytest.TempPathFactory) -> Work:
    folder = tmp_path_factory.mktemp("demonstration")
    (folder / "set.toml").write_text(CAMPAIGN_OF_A_SET, encoding="utf-8")
    return Work(folder, folder / "set.toml")


def test_ten_of_each_on_every_kind() -> None:
    assert (len(FAULTS), len(HARMLESS)) == (10, 10)
    assert {kind for fault in FAULTS for kind in fault.kinds} == set(MEASURES) == {kind for change in HARMLESS for kind in change.kinds}


@pytest.mark.parametrize("change", [*FAULTS, *HARMLESS], ids=lambda change: change.name)
def test_a_change_finds_what_it_replaces(change: Change) -> None:
    with change.patched():
        pass


def test_fresh_noise_leaves_the_flight_as_it_is() -> None:
    recipe = small_recipe()
    observation, truth = build_silhouette_sequence(recipe, 0)
    with fresh_noise(1):
        other, same = build_silhouette_sequence(recipe, 0)
    assert np.array_equal(truth.motion.x_world, same.motion.x_world)
    assert not np.array_equal(observation.recordings[0][0].points_px[:5], other.recordings[0][0].points_px[:5])
    again, _ = build_silhouette_sequence(recipe, 0)
    assert np.array_equal(observation.recordings[0][0].points_px, again.recordings[0][0].points_px)


def test_fresh_noise_of_trajectories(work: Work) -> None:
    case = case_of(work.gate_set.campaigns[0])
    first = field_making.measured(case, 0)
    with fresh_noise(1):
        other = field_making.measured(case, 0)
    assert np.array_equal(first.times_s, other.times_s)
    assert 0 < np.abs(first.x_world - other.x_world).max() < 0.1


def test_a_fault_is_judged_and_told(work: Work) -> None:
    (fault,) = (each for each in FAULTS if "drag" in each.name)
    folder = work.nature("campaigns", 0)
    rows, wrong = rows_of("campaigns", folder, HARMLESS[1]), rows_of("campaigns", folder, fault)
    assert rows[0]["measured"]
    assert wrong[0]["names_nats"] > rows[0]["names_nats"] + 1.0 or wrong[0]["parameter_percent"] > 2 * rows[0]["parameter_percent"]
    baseline = Baseline({"campaigns": rows}, {}, "set.toml", {})
    told = judged(baseline, {"campaigns": wrong}, fault, work.out)
    unchanged = judged(baseline, {"campaigns": rows}, HARMLESS[0], work.out)
    assert (unchanged["worse"], unchanged["right"], unchanged["equal_to_the_digit"]) == (False, True, True)
    assert told["right"] is told["worse"]
    noise = fresh(baseline, [{"campaigns": rows}])
    assert (noise["pairs"], noise["alarms_of_pairs"], noise["share_lost"]) == (2, 0, 0.0)
    text = page({"changes": [told, unchanged], "fresh_noise": noise})
    assert "| quadratic drag with power one | campaigns |" in text
    assert "equal to the last digit" in text
    assert "1 of 1 harmless changes pass" in text


def test_the_committed_page_is_that_of_the_result() -> None:
    root = Path(__file__).resolve().parents[2] / "docs"
    result = json.loads((root / "results" / "gate_demonstration.json").read_text(encoding="utf-8"))
    assert (root / "studies" / "gate.md").read_text(encoding="utf-8") == page(result)
