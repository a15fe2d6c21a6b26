"""Blocks by name, and problems of several parts: what each says is added up where its blocks lie."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.focal_flight import LOG_FOCAL, FocalFlight, at_focal
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.problem import Part, Problem, alone, prior_of
from estimator.fitting.refinement import refine, solve, system_at
from estimator.fitting.weighed_tangencies import Linearised, Refinement, linearise
from estimator.motion.blocks import Block, Layout
from estimator.motion.flight import LAYOUT, Flight
from tests.estimator.fitting.test_within_sequence import seen_by_two, spinning

Array = NDArray[np.float64]
SETTINGS = Refinement(floor_px=0.04, body_noise_px=0.05, within_pairs=0)


def test_blocks_are_found_by_name() -> None:
    layout = Layout((Block("a", ("a_m",), 0.1), Block("b", ("b_1", "b_2"), precision=4.0)))
    assert (layout["a"], layout["b"], layout.size) == (slice(0, 1), slice(1, 3), 3)
    assert layout.columns(["b", "a"]).tolist() == [1, 2, 0]
    np.testing.assert_array_equal(layout.steps, [0.1, 0.0, 0.0])
    np.testing.assert_array_equal(layout.precision, [0.0, 4.0, 4.0])
    np.testing.assert_array_equal(layout.held({"a": 9.0, "b": np.array([1.0, 2.0])}).precision, [9.0, 1.0, 2.0])


def test_effects_are_blocks_behind_those_of_a_flight_each_with_its_scope() -> None:
    model = Model((MODELS["uniform_acceleration"], MODELS["quadratic_drag"].held_by((0.5,))))
    assert model.layout.names == (*LAYOUT.names, "uniform_acceleration", "quadratic_drag")
    assert model.layout["quadratic_drag"] == slice(LAYOUT.size + 3, LAYOUT.size + 4)
    np.testing.assert_array_equal(model.layout.of(Scope.SEQUENCE), np.arange(12))
    np.testing.assert_array_equal(model.layout.of(Scope.PARTICLE), model.layout.columns(["com", "inertia", "quadratic_drag"]))
    assert model.layout.scopes[LAYOUT.size] is MODELS["uniform_acceleration"].entry.scope
    np.testing.assert_array_equal(model.layout.precision[LAYOUT.size :], [0.0, 0.0, 0.0, 4.0])
    np.testing.assert_array_equal(model.layout.steps[LAYOUT.size :], model.steps)


def test_a_step_and_its_values_agree_but_for_rotations() -> None:
    step = np.random.default_rng(1).normal(size=LAYOUT.size) * 1e-3
    changed = spinning().moved(step).values - spinning().values
    turned = LAYOUT.columns(["theta"])
    np.testing.assert_allclose(np.delete(changed, turned), np.delete(step, turned), atol=1e-12)
    np.testing.assert_array_equal(changed[turned], 0.0)


def test_two_parts_that_share_all_blocks_say_twice_as_much_and_the_prior_once() -> None:
    task, flight = replace(seen_by_two(spinning()), huber=4.0), spinning()
    (one,) = alone(task, flight)
    twice: Problem[Flight, Flight, Linearised] = Problem(
        (one, Part(task, lambda state: state, one.place)), partial(linearise, settings=SETTINGS)
    )
    single, both = system_at(task, flight, SETTINGS), twice.at(flight)
    prior = prior_of((one,), flight)
    np.testing.assert_allclose(both.H - prior.H, 2.0 * (single.H - prior.H))
    np.testing.assert_allclose(both.g - prior.g, 2.0 * (single.g - prior.g))


def test_a_fact_counts_as_what_it_says() -> None:
    """A velocity along z that is known to be that of the start, and nothing else, stays there and is known as well as that."""
    task, flight = replace(seen_by_two(spinning()), huber=4.0), spinning()
    column, value, sigma = LAYOUT["v"].start + 2, float(spinning().v[2]) + 0.3, 1e-6

    def known(state: Flight) -> NormalEquations:
        H, g = np.zeros((LAYOUT.size, LAYOUT.size)), np.zeros(LAYOUT.size)
        H[column, column], g[column] = sigma**-2, (state.values[column] - value) / sigma**2
        return NormalEquations(H, g, 0.0)

    held, free = solve(alone(task, flight), flight, SETTINGS, [known]), refine(task, flight, SETTINGS)
    assert held.state.v[2] == pytest.approx(value, abs=3.0 * sigma)
    assert np.sqrt(held.covariance[column, column]) == pytest.approx(sigma, rel=1e-3)
    assert np.sqrt(free.covariance[column, column]) > 100.0 * sigma


def test_the_column_of_the_focal_length_is_a_difference() -> None:
    task, motion, width = seen_by_two(spinning()), FocalFlight(spinning(), 0.01, 0.05), 1e-6
    place = motion.layout[LOG_FOCAL]
    at = linearise(task, motion, SETTINGS)
    steps = [replace(motion, log_focal=motion.log_focal + sign * width) for sign in (1.0, -1.0)]
    high, low = (linearise(task, step, SETTINGS).errors for step in steps)
    told = at.errors.told[:, :, :2] & high.told[:, :, :2] & low.told[:, :, :2]
    expected = (high.error - low.error)[:, :, :2] / (2.0 * width)
    found = (at.errors.jacobian[:, :, :2] @ at.S[:, None])[..., place][..., 0]
    np.testing.assert_allclose(found[told], expected[told], atol=1e-3 * np.abs(expected[told]).max())
    assert at_focal(task, spinning()) is task


def test_pairs_within_the_sequence_move_with_the_focal_length_as_well() -> None:
    """Where all outlines are exact, the gradient's change is the normal matrix."""
    task, motion, width = seen_by_two(spinning()), FocalFlight(spinning(), 0.0, 0.05), 1e-5
    place, settings = motion.layout[LOG_FOCAL], replace(SETTINGS, within_pairs=600)
    steps = [replace(motion, log_focal=sign * width) for sign in (1.0, -1.0)]
    high, low = (linearise(task, step, settings).within.g for step in steps)
    H = linearise(task, motion, settings).within.H
    scale = np.sqrt(np.diag(H))
    np.testing.assert_allclose((high - low) / (2.0 * width) / scale, H[:, place][:, 0] / scale, atol=2e-3 * scale[place].item())


def test_the_prior_of_the_focal_length_pulls_to_that_of_the_camera() -> None:
    task, motion = seen_by_two(spinning()), FocalFlight(spinning(), 0.01, 0.05)
    known = prior_of(alone(task, motion), motion)
    assert known.g[motion.layout[LOG_FOCAL]].item() == pytest.approx(0.01 / 0.05**2)
    assert known.H[-1, -1] == pytest.approx(0.05**-2)
