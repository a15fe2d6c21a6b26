"""A fit that misses something is no plain ``converged`` on the console and in the report."""

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from datasets.estimate import Estimate, Status
from datasets.estimate_files import read_estimate, write_estimate
from estimator.fitting.adequacy import Misfit
from estimator.motion.slow_errors import SlowErrors
from estimator.reports.misfit_words import adequacy_statistics, misfit_remark, misfit_sentence, p_value, p_words
from tumble.cli.estimate import _status_cell, remarks, tell
from tumble.reports.words import MISFIT_MEANING, MISFIT_NEXT, besides_status, meaning, next_steps

SLOW: dict[str, Any] = {
    "scales": {0: np.stack([np.eye(3)] * 2)},
    "moved": np.zeros(21),
    "velocity_shift": np.array([0.003, 0.0, 0.004, 0.0, 0.0, 0.0]),
    "segment": 0,
    "slow": SlowErrors(np.zeros((9, 6, 18)), (0,), ((0.0, 1.0),)),
    "b": np.zeros(18),
}
MISSES = Misfit(p=1e-9, statistic=90.0, freedom=18, component=1, size=8e-5, component_p=1e-8, noise_ratio=1.1, **SLOW)
NOISE = Misfit(p=0.3, statistic=20.0, freedom=18, component=1, size=1e-5, component_p=0.2, noise_ratio=0.8, **SLOW)


def estimate_of(tested: Misfit, status: Status = Status.CONVERGED) -> Estimate:
    return Estimate(name="toss", status=status, message=misfit_sentence(tested), statistics=adequacy_statistics(tested))


def test_a_misfit_is_said() -> None:
    estimate = estimate_of(MISSES)
    assert _status_cell(estimate) == "converged, misfit"
    assert meaning(estimate) == MISFIT_MEANING
    assert next_steps(estimate)[0] == MISFIT_NEXT
    assert "misses something (p = 1.0e-09)" in remarks(estimate)[0]
    assert "path along y is off by 0.08 mm" in estimate.message
    assert "moves the velocities by (0.005 m/s, 0 rad/s) is in their uncertainties; its cause may move them by more" in estimate.message


@pytest.mark.parametrize(("p", "told"), [(1.0, "1"), (0.683, "0.68"), (0.0057, "0.0057"), (9.9e-4, "9.9e-04"), (1e-20, "< 1e-16")])
def test_p_values_are_written_as_people_do(p: float, told: str) -> None:
    assert p_value(p) == told
    assert p_words(p) == (f"p {told}" if told.startswith("<") else f"p = {told}")


def test_after_impacts_the_impact_before_a_misfit_is_told() -> None:
    told = misfit_remark(replace(MISSES, segment=2))
    assert told.startswith("The model misses something")
    assert "off by 0.08 mm RMS after impact 2" in told
    assert misfit_remark(NOISE) == ""


def test_shifts_are_kept_where_slow_errors_show_alone() -> None:
    assert "velocity_shift_ms" not in adequacy_statistics(NOISE)["adequacy"]
    assert "velocity_shift_ms" not in adequacy_statistics(replace(NOISE, noise_ratio=5.0))["adequacy"]


@pytest.mark.parametrize(("tested", "status"), [(NOISE, Status.CONVERGED), (MISSES, Status.AMBIGUOUS)])
def test_what_fits_or_did_not_converge_is_called_what_it_is(tested: Misfit, status: Status) -> None:
    estimate = estimate_of(tested, status)
    assert _status_cell(estimate) == status.value
    assert meaning(estimate) != MISFIT_MEANING


@pytest.mark.parametrize(("message", "said"), [("converged.", ""), ("converged. Six views were left out.", "Six views were left out.")])
def test_what_stands_beside_a_status_does_not_repeat_it(message: str, said: str) -> None:
    assert besides_status(Estimate(name="toss", status=Status.CONVERGED, message=message)) == said


def test_next_is_to_compare(capsys: pytest.CaptureFixture[str]) -> None:
    tell(argparse.Namespace(json=False, quiet=False, observations=Path("drag"), out=Path("out")), [estimate_of(MISSES)])
    assert "next: tumble compare drag" in capsys.readouterr().out


def test_the_document_keeps_the_test(tmp_path: Path) -> None:
    write_estimate(estimate_of(MISSES, Status.AMBIGUOUS), tmp_path / "toss.json")
    kept = read_estimate(tmp_path / "toss.json").statistics["adequacy"]
    assert kept["p"] == pytest.approx(1e-9)
    assert kept["velocity_shift_ms"] == [0.003, 0.0, 0.004]
