"""Noise that nobody states is read about free flight first, and again about the effects that are found."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, campaign

Array = NDArray[np.float64]
NOISE_RADS, DAMPING = 0.05, 0.6
MOMENTS, STATED = np.array([0.515, 0.53, 1.0]), np.array([0.5, 0.5, 1.0])
TILT = np.array([0.04, -0.02, 0.0])


def wobbling_disc(seed: int, rows: int = 64) -> Trajectory:
    """A disc whose wobble dies out, read by a gyroscope that sits tilted on it: stated are a thin disc's moments, and no noise."""
    times = np.arange(rows) / 100.0

    def change(_: float, w: Array) -> Array:
        L = MOMENTS * w
        torque = -DAMPING * (w - (w @ L) / (L @ L) * L)
        return np.asarray((np.cross(L, w) + torque) / MOMENTS)

    spin = solve_ivp(change, (0.0, times[-1]), [-0.2, -4.0, -32.0], t_eval=times, rtol=1e-10, atol=1e-12).y.T
    read = Rotation.from_rotvec(TILT).apply(spin) + np.random.default_rng(seed).normal(0.0, NOISE_RADS, (rows, 3))
    nothing, where = np.full((rows, 3), np.nan), Surroundings(np.zeros(3), Body(np.zeros(3), np.eye(3), STATED))
    return Trajectory("throw", times, nothing, None, None, None, None, None, where, read)


@cache
def explained(seed: int) -> Explanation:
    registered = register_trajectories([wobbling_disc(seed)])
    return explain(registered.campaign, registered.start, catalogue())


@pytest.mark.parametrize("seed", [11, 12])
def test_what_takes_three_effects_to_follow_is_found_in_one_throw(seed: int) -> None:
    """About free flight the wobble is out of step, which no polynomial follows: noise seemed ten times as large, alike over ten rows."""
    found = explained(seed)
    assert {"inertia_ratios", "products_of_inertia", "nutation_damping"} <= set(found.found)
    assert all(step.established for step in found.steps if step.added in {"inertia_ratios", "products_of_inertia", "nutation_damping"})
    model, theta = found.fit.model, found.fit.state.theta[0]
    assert theta[model.slices[model.keys.index("nutation_damping")]] == pytest.approx([DAMPING], rel=0.15)


def test_the_noise_is_that_about_the_effects_that_were_found() -> None:
    found = explained(11)
    np.testing.assert_allclose(found.campaign.sequences[0].sigma[:, 3:], NOISE_RADS, rtol=0.25)
    assert np.all(found.campaign.sequences[0].repeats[3:] < 3.0)
    assert np.all(found.begun.campaign.sequences[0].sigma[:, 3:] > 5.0 * NOISE_RADS)


def test_held_out_errors_fall_from_rung_to_rung() -> None:
    errors = [explained(11).rungs[0].before.rms_px, *(step.after.rms_px for step in explained(11).rungs)]
    assert errors == sorted(errors, reverse=True)


def test_noise_stays_where_sequences_have_values_of_their_own() -> None:
    """Those take of the noise what they can."""
    registered = register_trajectories(campaign(6, Hidden(drag=0.3), Tracker(rows=24)))
    fits = {}
    for key in ("uniform_acceleration", "quadratic_drag"):
        model = Model((catalogue()[key],))
        start = CampaignState(registered.start.flights, tuple(np.zeros(model.size) for _ in registered.start.flights))
        fits[key] = fit_campaign(registered.campaign, start, model)
    again = {key: registered.campaign.kind.relinearised(registered.campaign, fit)[0] for key, fit in fits.items()}
    assert again["uniform_acceleration"] is registered.campaign
    assert again["quadratic_drag"] is not registered.campaign
