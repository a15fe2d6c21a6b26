"""Priors with tails: the precision that a fit is given is the derivative of the cost that it is judged by."""

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.effects.link import TAILS
from estimator.effects.model import Model
from estimator.effects.registry import MODELS

Array = NDArray[np.float64]
HELD = (0.2, 0.5, 1.5)


def model() -> Model:
    """An effect without a prior, one under a normal prior, one under a prior with tails."""
    drag, gravity, push = (MODELS[key] for key in ("linear_drag", "gravity", "uniform_acceleration"))
    return Model((drag, gravity.held_by(HELD), push.held_by(HELD, tails=True)))


def drawn(seed: int, size: float) -> Array:
    return size * np.random.default_rng(seed).normal(size=model().size)


@pytest.mark.parametrize("size", [1e-3, 0.3, 1.0, 30.0])
def test_the_gradient_of_the_cost_is_precision_times_value(size: float) -> None:
    theta, of = drawn(1, size), model()
    steps = 1e-6 * np.maximum(np.abs(theta), 1e-3)
    slopes = [
        float(np.sum(of.prior_cost(theta + step) - of.prior_cost(theta - step))) / (2.0 * width)
        for step, width in zip(np.diag(steps), steps, strict=True)
    ]
    np.testing.assert_allclose(slopes, of.precision_at(theta) * theta, rtol=1e-5, atol=1e-7)


def test_what_is_free_costs_nothing_and_what_is_normal_is_the_same_everywhere() -> None:
    of = model()
    for size in (0.1, 100.0):
        precision, cost = of.precision_at(drawn(2, size)), of.prior_cost(drawn(2, size))
        assert (precision[0], cost[0]) == (0.0, 0.0)
        np.testing.assert_allclose(precision[1:4], np.array(HELD) ** -2.0)
    np.testing.assert_array_equal(of.precision[:4], of.precision_at(drawn(3, 5.0))[:4])


def test_tails_hold_small_values_more_and_large_ones_less() -> None:
    """At zero by (nu + q) / nu, as Student's density is narrower there; far out by nearly nothing, and costs grow with the logarithm."""
    of, part = model(), model().slices[-1]
    at_zero, far = np.zeros(of.size), np.zeros(of.size)
    far[part] = 1e3 * np.array(HELD)
    np.testing.assert_allclose(of.precision_at(at_zero)[part], (TAILS + 3) / TAILS * np.array(HELD) ** -2.0)
    np.testing.assert_allclose(of.precision_at(far)[part], 1e-6 * (TAILS + 3) / 3 * np.array(HELD) ** -2.0, rtol=1e-5)
    assert of.prior_cost(10.0 * far)[-1] - of.prior_cost(far)[-1] == pytest.approx((TAILS + 3) * np.log(10.0), rel=1e-4)


def test_parameters_without_a_prior_do_not_count_for_the_tails() -> None:
    part_held = Model((MODELS["uniform_acceleration"].held_by((0.2, np.inf, np.inf), tails=True),))
    theta = np.array([0.4, 7.0, -9.0])
    np.testing.assert_allclose(part_held.precision_at(theta), [25.0 * (TAILS + 1) / (TAILS + 4.0), 0.0, 0.0])
    assert part_held.prior_cost(theta)[0] == pytest.approx(0.5 * (TAILS + 1) * np.log1p(4.0 / TAILS))


def test_a_free_effect_is_free_again() -> None:
    held = MODELS["uniform_acceleration"].held_by(HELD, tails=True)
    assert (held.held, held.tails) == (HELD, True)
    assert (held.held_by(None).held, held.held_by(None).tails) == (None, False)
    assert MODELS["uniform_acceleration"].held is None, "the catalogue's own stays as it is"
