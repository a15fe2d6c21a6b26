"""Velocities are held against the truth by the clock of the model that they are of, not by what was found."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from datasets.truth import Truth
from datasets.truth_files import write_truth
from synth.sequence import plan_sequence, truth_of
from tests.estimator.small_campaign import recipe
from tumble.challenge.answers import keys_told
from tumble.challenge.cases import Case, case_folder
from tumble.challenge.scoring import corrects_the_clock, model_keys, velocity_rows

EARLY_S = 1e-3
RECIPE = recipe()


@pytest.fixture(scope="module")
def truth() -> Truth:
    """A flight; the stamps of its frames are early."""
    made = truth_of(plan_sequence(RECIPE, 0))
    times = made.motion.times_s
    return replace(made, name="c001-1", motion=replace(made.motion, times_s=times - EARLY_S), notes={"true_times_s": times.tolist()})


@pytest.mark.parametrize(
    ("found", "model", "clock"),
    [
        (["clock_offset"], None, True),
        ([], None, False),
        (["clock_offset"], ["volume_warp"], False),
        ([], ["smooth_time_shift"], True),
        (["gravity"], ["gravity", "frame_rate"], True),
    ],
)
def test_the_clock_is_that_of_the_model(tmp_path: Path, truth: Truth, found: list[str], model: list[str] | None, clock: bool) -> None:
    write_truth(truth, case_folder(tmp_path, "c001") / truth.name)
    state: dict[str, Any] = {"sequence": truth.name, "covariance": np.eye(6).tolist()}
    state |= {"v_world": truth.motion.v_world[5].tolist(), "omega_world": truth.motion.omega_world[5].tolist()}
    state["time_s"] = float(truth.motion.times_s[5]) + (EARLY_S if clock else 0.0)
    said = {"found": found, "velocities": {"final": [state]}, **({} if model is None else {"model": model})}
    (row,) = velocity_rows(Case("c001", "control", RECIPE, 40, {}), tmp_path, said, {})
    assert (row["v_final"], row["omega_final"]) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_answers_that_do_not_say_their_model_have_that_of_what_was_found() -> None:
    assert model_keys({"found": ["gravity"]}) == ("gravity",)
    assert not corrects_the_clock(model_keys({"found": ["frame_rate"], "model": ["./my_law.py:MyLaw"]}))


def test_an_answer_has_the_keys_of_the_most_probable_set_without_noise() -> None:
    """What is found in the unknown's place is not among them; what is unknown is."""
    of = SimpleNamespace(keys=("gravity", "frame_rate", "volume_warp", "unmeasured_lift"))
    best = SimpleNamespace(members=(0, 2, 3), trial=SimpleNamespace(evidence=SimpleNamespace(of=of), noise={3}))
    told: Any = SimpleNamespace(path=(None, best), found=("gravity", "frame_rate"))
    assert keys_told(told) == ["gravity", "volume_warp"]
