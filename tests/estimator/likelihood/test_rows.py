"""The density of residuals whose noise is integrated, where a set of effects leaves a share of them."""

import numpy as np
import pytest
from scipy.stats import t as student

from estimator.likelihood.rows import NOISE_FREEDOM, AtFit, Density, noise_scales

MISFITS, FREEDOM = np.array([40.0, 3.0]), np.array([20.0, 5.0])


def test_one_number_of_a_sequence_has_students_density() -> None:
    """Of a variance whose prior is known to one of ``NOISE_FREEDOM`` degrees of freedom about one."""
    one = Density(np.array([4.0]), np.array([1.0]), 0.0)
    expected = [student(NOISE_FREEDOM).logpdf(np.sqrt(4.0 * share)) - student(NOISE_FREEDOM).logpdf(0.0) for share in (0.1, 1.0)]
    np.testing.assert_allclose([one.log(0.1), one.log()], expected, rtol=1e-12)


def test_what_a_set_explains_counts_by_the_noise_of_the_fit_at_first_and_by_more_the_more_it_is() -> None:
    """The tangent at the fit is the normal density at its noise: a misfit that counts as noise hides what would remove it."""
    squares = float(np.sum(MISFITS / noise_scales(MISFITS, FREEDOM) ** 2))
    fit = AtFit(Density(MISFITS, FREEDOM, 7.0), squares, priors=2.0, drawn=0.5)
    there = squares + 2.0
    assert fit.log_density(there) == pytest.approx(Density(MISFITS, FREEDOM, 7.0).log() - 1.0 - 0.5)
    gains = [fit.log_density(there - less) - fit.log_density(there) for less in (1e-6, 0.9 * squares)]
    assert gains[0] == pytest.approx(0.5e-6, rel=1e-4)
    assert gains[1] > 1.5 * 0.5 * 0.9 * squares
