"""Field flights are what the instrument predicts to a hundredth of the noise; their noise is what the case says; files come back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.trajectory_files import read_trajectory
from estimator.effects.choosing import catalogue
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import CampaignState, fit_campaign
from estimator.measurements.trajectories.registering import register_trajectories
from tumble.challenge.field_case import CHANNELS, TRAJECTORIES, FieldCase, FlightPlan, Measured, Noise
from tumble.challenge.field_files import true_state, write_surroundings, write_trajectory, write_true_motion
from tumble.challenge.field_flights import DENSE, flown, measured
from tumble.challenge.field_noise import FAR_OFF

SIGMA = {"x": 5e-4, "theta": 3e-3, "omega": 0.5, "gyro": 0.02}
EFFECTS: dict[Measured, dict[str, dict[str, float]]] = {
    "poses": {"centre_of_mass": {"c1": 1e-3, "c2": -5e-4, "c3": 2e-4}, "frame_rate": {"relative": 0.01}, "spin_damping": {"rate": 0.5}},
    "positions_and_spin": {"magnus_lift": {"coefficient": 0.01}, "quadratic_drag": {"per_length": 0.1}},
    "positions": {"length_scale": {"relative": 0.01}, "linear_drag": {"rate": 0.2}},
    "gyroscope": {"gyroscope_bias": {"b_x": 0.1, "b_y": 0.2, "b_z": -0.1}, "inertia_ratios": {"e1": 0.05, "e2": -0.03}},
}


def case_of(kind: Measured, noise: Noise, rows: int = 20) -> FieldCase:
    flights = tuple(
        FlightPlan(
            f"f-{i}",
            rows,
            100.0,
            (1.0, -2.0, 1.0 + i),
            (3.0, 8.0 - i, -5.0),
            (0.5, 0.5, 0.5, 0.5) if kind != "positions" else (0.0, 0.0, 0.0, 1.0),
        )
        for i in range(2)
    )
    hidden = {key: {name: (value,) * 2 for name, value in each.items()} for key, each in EFFECTS[kind].items()}
    ratios = (1.0, 1.0, 1.0) if kind.startswith("positions") else (0.6, 0.8, 1.0)
    return FieldCase("f", 3, kind, ratios, flights, noise, hidden, {}, {}, {}, {})


def noise_of(kind: Measured, *, scale: float = 1.0, rounded: bool = False, outliers: float = 0.015, stated: bool = True) -> Noise:
    return Noise({channel: scale * SIGMA[channel] for channel in CHANNELS[kind]}, 2, outliers, rounded, stated)


@pytest.mark.parametrize("kind", TRAJECTORIES)
def test_without_noise_the_instrument_predicts_every_row(kind: Measured) -> None:
    case = case_of(kind, noise_of(kind, scale=1e-3, outliers=0.0))
    registered = register_trajectories([measured(case, number) for number in range(2)])
    effects = [catalogue()[key] for key in case.hidden]
    theta = np.concatenate([[EFFECTS[kind][e.entry.key][name] for name in e.entry.names] for e in effects])
    fit = fit_campaign(registered.campaign, CampaignState(registered.start.flights, (theta, theta)), Model(tuple(effects)))
    assert fit.settled
    assert max(float(np.abs(each.errors.e).max()) for each in fit.equations) < 10.0  # of a thousandth of the noise
    truth = flown(case, 0, DENSE)
    flight = fit.state.flights[0]
    rate = case.values(0).get("frame_rate", {}).get("relative", 0.0)
    at = int(np.argmin(np.abs(truth.nominal_s - flight.time_s * (1.0 + rate))))
    if kind != "gyroscope":
        np.testing.assert_allclose(flight.v, truth.motion.v_world[at], atol=0.02)


@pytest.mark.parametrize("kind", TRAJECTORIES)
def test_the_reader_takes_what_is_written(kind: Measured, tmp_path: Path) -> None:
    case = case_of(kind, noise_of(kind, rounded=True))
    written = measured(case, 1)
    write_surroundings(case, tmp_path)
    write_trajectory(written, tmp_path)
    read = read_trajectory(tmp_path / "f-1.csv", {})
    np.testing.assert_array_equal(np.round(read.times_s * 1e3, 6) % 1.0, 0.0)
    for name in ("x_world", "q_world_tracked", "omega_world", "gyro", "sigma_x", "sigma_theta", "sigma_omega", "sigma_gyro"):
        before, after = getattr(written, name), getattr(read, name)
        if before is not None and np.isfinite(before).any():
            np.testing.assert_allclose(after, before, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(read.surroundings.gravity_world, written.surroundings.gravity_world)
    np.testing.assert_allclose(read.surroundings.body.inertia_ratios, case.ratios)


def test_noise_that_is_not_stated_is_not_told(tmp_path: Path) -> None:
    write_surroundings(case_of("poses", noise_of("poses", stated=False)), tmp_path)
    assert "sigma" not in (tmp_path / "trajectory.toml").read_text()


def test_noise_has_its_size_is_alike_over_rows_and_has_outliers() -> None:
    case = replace(case_of("positions", noise_of("positions"), rows=4000), hidden={})
    errors = (measured(case, 0).x_world - flown(case, 0).x) / SIGMA["x"]
    far = np.linalg.norm(errors, axis=1) > 0.9 * FAR_OFF[0]
    assert 0.01 < far.mean() < 0.03
    plain = np.clip(errors[~far], -4.0, 4.0)
    assert plain.std() == pytest.approx(1.0, abs=0.12)
    alike = [np.corrcoef(plain[:-k, 0], plain[k:, 0])[0, 1] for k in (1, 3)]
    assert alike[0] == pytest.approx(0.5, abs=0.08)
    assert abs(alike[1]) < 0.06


def test_true_states_are_those_of_the_motion(tmp_path: Path) -> None:
    case = case_of("gyroscope", noise_of("gyroscope"))
    path = tmp_path / "truth.csv"
    write_true_motion(flown(case, 0, DENSE), path)
    fine = flown(case, 0, 64)
    number = 200
    world, tracked = (true_state(path, float(fine.nominal_s[number]), tracked=each) for each in (False, True))
    np.testing.assert_allclose(world, [*fine.motion.v_world[number], *fine.motion.omega_world[number]], atol=1e-4)
    assert np.linalg.norm(tracked[3:]) == pytest.approx(np.linalg.norm(world[3:]), abs=1e-4)
