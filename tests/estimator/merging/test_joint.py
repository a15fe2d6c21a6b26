"""The joint fit of sets of which a view is another particle's: it goes to its minimum, though many errors are beyond ``huber``."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.recipes.recipe import ParticleRecipe
from estimator.merging.joint import JointTask, _cost, _equations, _linear, fit_jointly
from scripts.trials.study_shape import rendered, sets_of
from tests.estimator.merging.test_merging import STONE, task_of, true_placements

HUBER = 4.0


@pytest.fixture(scope="module")
def mixed() -> JointTask:
    """Two sets; one view of the second is of another particle."""
    made, other = rendered("stone", STONE, 21, drops=2), rendered("other", ParticleRecipe(size_mm=(6.0, 6.0)), 77, drops=1)
    second = made.drops[1]
    second = replace(second, outlines=(other.drops[0].outlines[0], *second.outlines[1:]))
    return replace(task_of(sets_of([made.drops[0], second])), huber=HUBER)


def test_a_foreign_view_does_not_keep_the_fit_where_it_starts(mixed: JointTask) -> None:
    steps = np.zeros((2, 6))
    steps[1] = [1e-5, -1e-5, 1e-5, 0.01, -0.01, 0.01]
    start = true_placements(rendered("stone", STONE, 21, drops=2)).moved(steps, mixed.pivot)
    fitted = fit_jointly(mixed, start)
    assert fitted.settled
    assert _cost(mixed, fitted.placements) < _cost(mixed, start) - 100.0


def test_the_linearisation_has_the_cost_that_steps_are_judged_by(mixed: JointTask) -> None:
    at = true_placements(rendered("stone", STONE, 21, drops=2))
    _, linear = _linear(mixed, at)
    assert (linear.z2 > HUBER**2).any()
    assert _equations(mixed, at, linear).cost == pytest.approx(_cost(mixed, at), rel=1e-12)
