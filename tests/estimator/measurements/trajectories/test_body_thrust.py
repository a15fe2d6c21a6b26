"""A thrust that is fixed to the body pushes every toss another way: told as something unknown, not as the tosses' own accelerations."""

from functools import cache

from datasets.vocabulary.effects import Stage
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign

TRIED = ("uniform_acceleration", "linear_drag", "quadratic_drag", "gravity", "length_scale")


@cache
def explained() -> Explanation:
    hidden = Hidden(thrust=(1.5, -0.8, 1.0), spin_rads=8.0)
    registered = register_trajectories(campaign(5, hidden, Tracker(rows=40, spin=True)))
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})


def test_the_unknown_takes_the_place_of_accelerations_of_every_toss() -> None:
    """Alone these are far more probable than nothing; beside them a law would be left with what they do not take."""
    assert any("uniform_acceleration" in at.keys for at in explained().path)
    assert explained().found == ()


def test_it_is_told_as_an_unknown_of_the_dynamics() -> None:
    left = explained().left
    assert left is not None
    assert left.present
    assert left.stage is Stage.DYNAMICS
