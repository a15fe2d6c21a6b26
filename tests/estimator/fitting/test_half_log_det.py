"""Half the log determinant of what is seen, beside numpy's of all."""

import numpy as np
import pytest

from estimator.fitting.stable_inverse import NothingSeen, half_log_det


def test_it_is_half_the_log_determinant_and_follows_units() -> None:
    J = np.random.default_rng(3).normal(size=(20, 5))
    H, units = J.T @ J, np.array([1e-3, 1.0, 50.0, 1e4, 2.0])
    assert half_log_det(H) == pytest.approx(0.5 * np.linalg.slogdet(H)[1])
    assert half_log_det(H * np.outer(units, units)) == pytest.approx(half_log_det(H) + np.log(units).sum())


def test_what_is_not_seen_does_not_count() -> None:
    H = np.diag([4.0, 0.0, 9.0])
    assert half_log_det(H) == pytest.approx(np.log(6.0))


def test_what_is_no_number_is_refused() -> None:
    with pytest.raises(NothingSeen):
        half_log_det(np.array([[np.nan, 0.0], [0.0, 1.0]]))
