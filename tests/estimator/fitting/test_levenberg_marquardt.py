"""Levenberg-Marquardt against SciPy's on known problems, and its ways of ending."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import least_squares

from estimator.fitting.levenberg_marquardt import Descent, NormalEquations, Outcome, minimise, solve_damped

Array = NDArray[np.float64]
TIMES = np.linspace(0.0, 3.0, 40)


def decay(p: Array) -> Array:
    """Residuals of a noisy decay with an offset; the second parameter is a million times the others."""
    noise = np.random.default_rng(5).normal(scale=0.02, size=len(TIMES))
    return np.asarray(p[0] * np.exp(-TIMES * p[1] * 1e-6) + p[2] - (2.0 * np.exp(-1.3 * TIMES) + 0.5 + noise))


def rosenbrock(p: Array) -> Array:
    return np.array([10.0 * (p[1] - p[0] ** 2), 1.0 - p[0]])


def jacobian(residuals: Callable[[Array], Array], p: Array) -> Array:
    columns = []
    for k in range(len(p)):
        step = np.zeros(len(p))
        step[k] = 1e-6 * max(1.0, abs(p[k]))
        columns.append((residuals(p + step) - residuals(p - step)) / (2.0 * step[k]))
    return np.column_stack(columns)


def problem(residuals: Callable[[Array], Array]) -> Descent[Array]:
    def linearise(p: Array) -> NormalEquations:
        r, J = residuals(p), jacobian(residuals, p)
        return NormalEquations(J.T @ J, J.T @ r, 0.5 * float(r @ r))

    return Descent(cost=lambda p: 0.5 * float(np.sum(residuals(p) ** 2)), linearise=linearise, move=lambda p, step: p + step)


@pytest.mark.parametrize(
    ("residuals", "start"), [(decay, np.array([0.3, 4e6, 0.0])), (rosenbrock, np.array([-1.2, 1.0]))], ids=["decay", "rosenbrock"]
)
def test_the_minimum_is_scipys(residuals: Callable[[Array], Array], start: Array) -> None:
    expected = least_squares(residuals, start, x_scale="jac", xtol=1e-14, ftol=1e-14, gtol=1e-14)
    found = minimise(problem(residuals), start, max_steps=200, tolerance=1e-12)
    assert found.outcome is Outcome.CONVERGED
    assert found.equations.cost == pytest.approx(expected.cost, rel=1e-9, abs=1e-12)
    np.testing.assert_allclose(found.state, expected.x, rtol=1e-5)


def test_a_linear_problem_takes_the_least_squares_solution() -> None:
    rng = np.random.default_rng(1)
    A, b = rng.normal(size=(30, 4)) * np.array([1.0, 1e3, 1e-3, 1e6]), rng.normal(size=30)
    found = minimise(problem(lambda p: A @ p - b), np.zeros(4), tolerance=1e-14)
    assert found.outcome is Outcome.CONVERGED
    np.testing.assert_allclose(found.state, np.linalg.lstsq(A, b, rcond=None)[0], rtol=1e-6)


def test_steps_are_counted_and_limited() -> None:
    start = np.array([-1.2, 1.0])
    costs = [minimise(problem(rosenbrock), start, max_steps=steps) for steps in (0, 1, 5, 10)]
    assert [c.outcome for c in costs] == [Outcome.MAX_STEPS] * 4
    assert [c.steps for c in costs] == [0, 1, 5, 10]
    np.testing.assert_array_equal(costs[0].state, start)
    assert np.all(np.diff([c.equations.cost for c in costs]) <= 0.0)
    done = minimise(problem(rosenbrock), np.array([1.0, 1.0]))
    assert (done.outcome, done.steps) == (Outcome.CONVERGED, 0)


def test_a_gradient_that_points_uphill_is_reported_as_stalled() -> None:
    good = problem(decay)

    def uphill(p: Array) -> NormalEquations:
        equations = good.linearise(p)
        return NormalEquations(equations.H, -equations.g, equations.cost)

    start = np.array([0.3, 4e6, 0.0])
    found = minimise(Descent(good.cost, uphill, good.move), start, max_steps=200, tolerance=0.0)
    assert found.outcome is Outcome.STALLED
    np.testing.assert_array_equal(found.state, start)


def test_a_cost_that_is_not_finite_is_never_taken() -> None:
    """A step out of the domain (all pairs lost) costs infinity; the fit has to come back from it."""

    def cost(p: Array) -> float:
        return np.inf if p[0] <= 0.0 else float((np.log(p[0]) - 1.0) ** 2) / 2.0

    def linearise(p: Array) -> NormalEquations:
        r, slope = np.log(p[0]) - 1.0, 1.0 / p[0]
        return NormalEquations(np.array([[slope**2]]), np.array([slope * r]), 0.5 * r * r)

    found = minimise(Descent(cost, linearise, lambda p, step: p + step), np.array([40.0]), max_steps=60, tolerance=1e-14)
    assert found.outcome is Outcome.CONVERGED
    assert found.state[0] == pytest.approx(np.e, rel=1e-6)


def test_damping_turns_and_shortens_the_step_and_does_not_know_units() -> None:
    rng = np.random.default_rng(2)
    J, g = rng.normal(size=(12, 3)), rng.normal(size=3)
    equations = NormalEquations(J.T @ J, g, 1.0)
    np.testing.assert_allclose(solve_damped(equations, 0.0), -np.linalg.solve(J.T @ J, g), rtol=1e-10)
    sizes = [np.linalg.norm(solve_damped(equations, d) * np.sqrt(np.diag(J.T @ J))) for d in (0.0, 0.1, 1.0, 100.0)]
    assert np.all(np.diff(sizes) < 0.0)
    far = solve_damped(equations, 1e9)
    np.testing.assert_allclose(far * 1e9, -g / np.diag(J.T @ J), rtol=1e-6)
    units = np.array([1e-6, 1.0, 1e6])
    other = NormalEquations(equations.H * units * units[:, None], g * units, 1.0)
    np.testing.assert_allclose(solve_damped(other, 0.3) * units, solve_damped(equations, 0.3), rtol=1e-9)
