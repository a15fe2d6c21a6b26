"""Residuals of trajectories: derivatives, what is not varied, and which effects apply."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.measurements.trajectories.registering import register_trajectories, task_of
from estimator.measurements.trajectories.starting import first_flight
from estimator.measurements.trajectories.task import trajectory_errors
from estimator.motion.flight import N_PARAMETERS, NAMES, OMEGA, THETA, moved
from tests.estimator.made_trajectories import Hidden, Tracker, campaign

TRACKERS = {
    "poses": Tracker(rows=14, ratios=(0.5, 0.8, 1.0), stated=True),
    "positions": Tracker(rows=14, orientation=False, stated=True),
    "positions and spin": Tracker(rows=14, orientation=False, spin=True, stated=True),
    "poses and spin": Tracker(rows=14, spin=True, ratios=(0.5, 0.8, 1.0), stated=True),
}
EFFECTS = ("frame_rate", "length_scale", "gravity", "quadratic_drag", "magnus_lift", "spin_damping", "centre_of_mass", "inertia_ratios")
STEP = np.array([1e-5] * 3 + [1e-4] * 3 + [1e-4] * 3 + [1e-2] * 3 + [1e-4] * 8 + [1e-3])


@pytest.mark.parametrize("name", TRACKERS)
def test_derivatives_are_central_differences(name: str) -> None:
    trajectory = campaign(3, Hidden(), TRACKERS[name], sequences=1)[0]
    task = task_of(trajectory)
    flight = first_flight(task, trajectory.surroundings.body)
    model = Model(tuple(catalogue()[key] for key in EFFECTS))
    theta = np.array([0.01, 0.02, 0.1, -0.2, 0.3, 0.1, 0.02, 0.5, 1e-3, -2e-3, 1e-3, 0.05, -0.04])
    J = trajectory_errors(task, flight, model, theta).J

    def e(column: int, size: float) -> np.ndarray:
        step, change = np.zeros(N_PARAMETERS), np.zeros(len(theta))
        (step if column < N_PARAMETERS else change)[column % N_PARAMETERS if column < N_PARAMETERS else column - N_PARAMETERS] = size
        return trajectory_errors(task, moved(flight, step), model, theta + change).e

    free = [c for c in range(N_PARAMETERS) if not task.still[c]] + list(range(N_PARAMETERS, N_PARAMETERS + len(theta)))
    for column in free:
        size = STEP[column] if column < N_PARAMETERS else 10.0 * model.steps[column - N_PARAMETERS]
        difference = (e(column, size) - e(column, -size)) / (2.0 * size)
        # Differences are wrong by h² J'''/6; the rotation's inverse Jacobian is known to the third order of residuals below 0.1 rad.
        scale = np.abs(difference).max() + 1e-9
        assert np.abs(J[..., column] - difference).max() < 2e-3 * scale, (column, name)
    assert not J[..., np.flatnonzero(task.still)].any()


def test_a_good_start_leaves_only_noise() -> None:
    registered = register_trajectories(campaign(5, Hidden(), TRACKERS["poses and spin"]))
    fit = base_fit(registered.campaign, registered.start)
    square = np.mean([each.frames.mean_square for each in fit.equations])
    # 9 numbers a row, 14 rows, 12 parameters: 1 - 12/126 = 0.905 expected, with a standard deviation of 0.063 for four sequences.
    assert fit.settled
    assert 0.7 < square < 1.1


def test_rotation_is_left_out_where_it_was_not_measured() -> None:
    registered = register_trajectories(campaign(7, Hidden(), Tracker(orientation=False)))
    fit = base_fit(registered.campaign, registered.start)
    covariance = campaign_covariance(registered.campaign, fit).of(0, np.arange(N_PARAMETERS))
    turning = np.r_[THETA, OMEGA]
    assert fit.settled
    assert not covariance[turning].any()
    assert (np.diag(covariance)[[0, 1, 2, 6, 7, 8]] > 0).all()
    unmeasured = registered.campaign.kind.unmeasured(registered.campaign.sequences[0])
    assert {NAMES[i] for i in unmeasured} == {NAMES[i] for i in turning}


@pytest.mark.parametrize(
    ("name", "not_shown"),
    [
        ("poses", {"unmeasured_lift", "unmeasured_drag", "stamp_scatter"}),
        (
            "positions",
            {
                "stamp_scatter",
                "centre_of_mass",
                "inertia_ratios",
                "products_of_inertia",
                "magnus_lift",
                "saturating_lift",
                "unmeasured_drag",
                "spin_damping",
                "nutation_damping",
            },
        ),
        (
            "positions and spin",
            {
                "stamp_scatter",
                "centre_of_mass",
                "inertia_ratios",
                "products_of_inertia",
                "unmeasured_lift",
                "unmeasured_drag",
                "nutation_damping",
            },
        ),
    ],
)
def test_only_effects_that_apply_are_tried(name: str, not_shown: set[str]) -> None:
    registered = register_trajectories(campaign(9, Hidden(), TRACKERS[name]))
    kind = registered.campaign.kind
    reasons = {key: kind.why_not(registered.campaign, effect) for key, effect in catalogue().items()}
    pictures = {key for key, reason in reasons.items() if reason == "it acts on pictures"}
    assert {"radial_distortion", "outline_offset", "rolling_shutter", "blooming"} <= pictures
    gyroscope = {key for key, reason in reasons.items() if reason == "it acts on a gyroscope's readings"}
    assert gyroscope == {"gyroscope_bias", "gyroscope_scale"}
    assert {key for key, reason in reasons.items() if reason is not None} - pictures - gyroscope == not_shown
    assert kind.why_not(registered.campaign, MODELS["clock_offset"]) == "it is a camera's, and trajectories have none"


def test_rows_out_of_use_have_no_say() -> None:
    trajectory = campaign(3, Hidden(), TRACKERS["poses"], sequences=1)[0]
    task = task_of(trajectory)
    kept = np.arange(14) % 2 == 0
    errors = trajectory_errors(replace(task, kept=kept), first_flight(task, trajectory.surroundings.body), Model(()), np.zeros(0))
    assert not errors.e[~kept].any()
    assert not errors.J[~kept].any()
    assert errors.e[kept].all()
