"""What is told of values that every sequence has for itself."""

import pytest

from estimator.effects.registry import MODELS
from tests.estimator.made_balls import explained_balls
from tumble.scattering import scattered


def test_flights_that_curve_to_another_side_than_their_stated_spin_are_named() -> None:
    told = explained_balls(15, 3, ("magnus_lift", "unmeasured_lift"))
    (sentence,) = scattered(told)
    names = {name for name in (f"shot_{i}" for i in range(15)) if name in sentence.replace(".", ",").replace(" ", ",").split(",")}
    assert names <= {"shot_0", "shot_1", "shot_2"}
    assert f"in {len(names)} of 15" in sentence


def test_spins_that_are_right_are_not_told() -> None:
    assert not scattered(explained_balls(8, 0, ("magnus_lift", "unmeasured_lift")))


def test_a_push_of_every_flights_own_is_told_with_its_size_and_with_what_stands_out() -> None:
    told = explained_balls(15, 3, ("unmeasured_lift", "uniform_acceleration"))
    assert told.found == ("uniform_acceleration",)
    (sentence,) = scattered(told)
    assert sentence.startswith("Uniform acceleration differs from sequence to sequence, cause unknown: a_x ")
    assert not told.noise


def test_where_all_spins_are_of_other_flights_that_they_do_not_tell_the_lift_is_said() -> None:
    (sentence,) = scattered(explained_balls(6, 6, ("magnus_lift", "unmeasured_lift"), seed=3))
    assert sentence.startswith("How much spin lifts, the stated spins of these 6 flights do not tell")


def test_a_force_by_the_spin_that_is_no_known_lift_tells_nothing_of_sides(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plug-in of a user's, beside which misread spins are noise all the same."""
    monkeypatch.setattr(type(MODELS["magnus_lift"]), "lifts", False)
    told = explained_balls(6, 2, ("magnus_lift", "unmeasured_lift"))
    assert told.noise == ("unmeasured_lift",)
    assert not scattered(told)
