"""What acts on tumbling bodies in trajectories alone: nature's flights with it, and what the instrument makes of them."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from datasets.vocabulary.effects import EFFECTS
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign
from estimator.measurements.trajectories.registering import register_trajectories
from synth.effects import EffectsInForce, FlyingBody
from synth.motion import Start, fly_pushed
from tests.agreement.trajectory_derivatives import held_to_central_differences

Array = NDArray[np.float64]
TIMES, GRAVITY, RATIOS = np.linspace(0.0, 0.5, 51), np.array([0.0, 0.0, -9.81]), np.array([0.5, 0.8, 1.0])
SIZES = {
    "products_of_inertia": {"e12": 0.02, "e13": -0.03, "e23": 0.01},
    "nutation_damping": {"rate": 2.0},
}
SIGMA_X, SIGMA_THETA, SIGMA_SPIN = 5e-5, 1e-3, 5e-3


def of_nature(
    key: str, rng: np.random.Generator, name: str, *, gyroscope: bool, beside: dict[str, dict[str, float]] | None = None
) -> Trajectory:
    """A tumbling body's flight with an effect, without noise: poses, or readings of a gyroscope along the uniform body's axes."""
    force = EffectsInForce({key: SIZES[key], **(beside or {})})
    uniform = FlyingBody(np.zeros((1, 3)), Body(np.zeros(3), np.eye(3), RATIOS), 0.03, 1e-5 * RATIOS)
    body = force.flying_body(uniform)
    start = Start(np.zeros(3), Rotation.random(random_state=rng).as_quat(), rng.uniform(-3.0, 3.0, 3), rng.normal(0.0, 8.0, 3))
    motion = fly_pushed(start, body, GRAVITY, force, span_s=(0.0, float(TIMES[-1]))).at(TIMES)
    q = Rotation.from_quat(motion.q_world_body) * Rotation.from_matrix(body.body.R_particle_body).inv()
    n, none = len(TIMES), np.full((len(TIMES), 3), np.nan)
    if gyroscope:
        where = Surroundings(np.zeros(3), uniform.body)
        read = q.inv().apply(motion.omega_world)
        return Trajectory(name, TIMES, none, None, None, None, None, None, where, read, np.full((n, 3), SIGMA_SPIN))
    where, sigma_x, sigma_theta = Surroundings(GRAVITY, uniform.body), np.full((n, 3), SIGMA_X), np.full((n, 3), SIGMA_THETA)
    return Trajectory(name, TIMES, motion.x_world, q.as_quat(), None, sigma_x, sigma_theta, None, where)


@pytest.mark.parametrize("gyroscope", [False, True], ids=["poses", "gyroscope"])
@pytest.mark.parametrize("key", SIZES)
def test_what_nature_does_is_recovered(key: str, gyroscope: bool) -> None:
    rng = np.random.default_rng(5)
    trajectories = [of_nature(key, rng, f"{key}_{number}", gyroscope=gyroscope) for number in range(4)]
    registered = register_trajectories(trajectories)
    start = CampaignState(registered.start.flights, tuple(np.zeros(len(SIZES[key])) for _ in trajectories))
    fit = fit_campaign(registered.campaign, start, Model((MODELS[key],)))
    assert fit.settled
    np.testing.assert_allclose(fit.state.theta[0], [SIZES[key][name] for name in EFFECTS[key].names], rtol=5e-3)
    assert max(np.abs(each.errors.e).max() for each in fit.equations) < 0.05


@pytest.mark.parametrize("key", SIZES)
def test_so_is_it_beside_other_moments(key: str) -> None:
    rng, beside = np.random.default_rng(6), {"inertia_ratios": {"e1": 0.25, "e2": 0.15}}
    registered = register_trajectories([of_nature(key, rng, f"{key}_{number}", gyroscope=False, beside=beside) for number in range(4)])
    model = Model((MODELS["inertia_ratios"], MODELS[key]))
    fit = fit_campaign(registered.campaign, CampaignState(registered.start.flights, (np.zeros(model.size),) * 4), model)
    assert fit.settled
    np.testing.assert_allclose(fit.state.theta[0], [0.25, 0.15, *(SIZES[key][name] for name in EFFECTS[key].names)], rtol=1e-2)


@pytest.mark.parametrize("key", SIZES)
def test_derivatives_are_central_differences(key: str) -> None:
    trajectory = of_nature(key, np.random.default_rng(2), key, gyroscope=False)
    held_to_central_differences(trajectory, {key: SIZES[key]})


def test_a_wobble_shows_only_where_moments_differ() -> None:
    trajectory = of_nature("nutation_damping", np.random.default_rng(3), "tumbling", gyroscope=True)
    round_body = replace(trajectory.surroundings.body, inertia_ratios=np.ones(3))
    rounder = replace(trajectory, surroundings=replace(trajectory.surroundings, body=round_body))
    reasons = {}
    for each in (trajectory, rounder):
        campaign = register_trajectories([each]).campaign
        reasons[each is rounder] = {key: campaign.kind.why_not(campaign, MODELS[key]) for key in ("nutation_damping", "spin_damping")}
    assert reasons[False] == {"nutation_damping": None, "spin_damping": None}
    assert reasons[True] == {"nutation_damping": "its body is stated with three equal moments of inertia", "spin_damping": None}
