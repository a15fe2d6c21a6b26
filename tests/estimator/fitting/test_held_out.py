"""Held-out errors judge by everything that is known without the frame, and by no more than that."""

from dataclasses import replace

import numpy as np

from estimator.diagnosis.adding import base_fit, with_effect
from estimator.effects.choosing import catalogue
from estimator.fitting.held_out import held_out
from estimator.registration import Registered
from estimator.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, measured

OFF_CENTRE = Hidden(com=(0.02, 0.0, -0.015))


def of_spins(*spins_rads: float) -> Registered:
    """A thing whose centre of mass lies beside the tracked point, tossed with these spins."""
    rng = np.random.default_rng(0)
    return register_trajectories(
        [measured(f"toss_{i}", rng, replace(OFF_CENTRE, spin_rads=spin), Tracker(rows=40)) for i, spin in enumerate(spins_rads)]
    )


def before_and_after(registered: Registered, effect: str) -> tuple[np.ndarray, np.ndarray]:
    """Held-out errors per sequence of free flight, and with one effect more."""
    campaign = registered.campaign
    base = base_fit(campaign, registered.start)
    fit = with_effect(campaign, base, catalogue()[effect])
    return tuple(held_out(campaign, f.state, f.model).per_sequence_px for f in (base, fit))  # type: ignore[return-value]


def test_an_effect_that_one_sequence_alone_shows_lowers_its_errors() -> None:
    """Without a spin there is nothing to tell where the centre of mass is: the others' half says nothing of it."""
    before, after = before_and_after(of_spins(8.0, 1e-3), "centre_of_mass")
    assert after[0] < 0.2 * before[0]


def test_what_others_tell_of_an_effect_is_used() -> None:
    before, after = before_and_after(of_spins(8.0, 8.0, 8.0, 8.0), "centre_of_mass")
    assert np.all(after < 1.2)
    assert np.mean(before) > 2.0


def test_an_effect_that_is_not_there_lowers_nothing() -> None:
    before, after = before_and_after(of_spins(8.0, 1e-3), "quadratic_drag")
    assert np.all(after > 0.97 * before)
