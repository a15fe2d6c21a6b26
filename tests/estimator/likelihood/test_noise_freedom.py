"""By how many degrees of freedom noise is known that nobody states, and what intervals make of it."""

import numpy as np
import pytest
from scipy.stats import norm
from scipy.stats import t as student

from estimator.likelihood.noise_freedom import as_students, noise_freedom
from estimator.likelihood.rows import NOISE_FREEDOM

OWN, UNKNOWN = 9.0, np.zeros(3, dtype=np.bool_)


def along_one_axis(sequences: int, *, known: bool = False) -> float:
    return float(noise_freedom(np.full((sequences, 3), OWN), np.full(3, known))[0, 0])


def test_of_one_sequence_that_of_an_axis_is_known_by_the_axis_s_own_rows() -> None:
    assert along_one_axis(1) == pytest.approx(OWN)


def test_many_sequences_leave_what_is_a_sequence_s_own() -> None:
    """Its three axes tell it beside the prior; sizes of the axes are all but known."""
    assert along_one_axis(4) > 2.0 * OWN
    assert along_one_axis(4000) == pytest.approx(NOISE_FREEDOM + 3.0 * OWN, rel=0.01)
    assert along_one_axis(1, known=True) == pytest.approx(NOISE_FREEDOM + 3.0 * OWN)


def test_an_axis_that_was_not_measured_takes_nothing_from_the_others() -> None:
    freedom = np.array([[OWN, OWN, 0.0]])
    assert noise_freedom(freedom, UNKNOWN)[0, :2] == pytest.approx(OWN)


@pytest.mark.parametrize("freedom", [3.0, 20.0, np.inf])
def test_the_normal_interval_of_the_wider_variance_is_students(freedom: float) -> None:
    expected = student.ppf(0.975, freedom) if np.isfinite(freedom) else norm.ppf(0.975)
    assert norm.ppf(0.975) * np.sqrt(as_students(np.array(freedom))) == pytest.approx(expected)
