"""A gyroscope's rows alone, spins known once in a flight, and rows of which a part was not measured."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from estimator.diagnosis.adding import fit_with
from estimator.diagnosis.empirical_fit import fit_empirical
from estimator.diagnosis.explain import explain
from estimator.diagnosis.residual_maps import residual_maps
from estimator.effects.choosing import catalogue
from estimator.effects.empirical.families import BodyThrust
from estimator.effects.empirical.force_curves import ForceCurve, TorqueCurve
from estimator.effects.model import Model
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories, task_of
from estimator.measurements.trajectories.starting import first_flight
from estimator.measurements.trajectories.task import trajectory_errors
from estimator.motion.flight import N_PARAMETERS, OMEGA, THETA, V, X, moved
from estimator.reports.campaign_reporting import effect_values
from tests.estimator.made_trajectories import Hidden, Tracker, campaign

Array = NDArray[np.float64]
NOISE_RADS = 0.01
MOMENTS = np.array([0.55, 0.56, 1.0])


def gyro_rows(
    seed: int, damping: float, ratios: tuple[float, float, float], *, sequences: int = 2, rows: int = 120, vent: Array | float = 0.0
) -> list[Trajectory]:
    """Body-frame angular velocities under a torque against the angular momentum, by Euler's equations and SciPy's DOP853.

    ``vent`` (3,) rad/s²: a torque beside it that is fixed to the body, per largest moment.
    """
    rng, times, moments = np.random.default_rng(seed), np.arange(rows) / 100.0, np.array(ratios)
    made = []
    for number in range(sequences):
        spin = np.array([0.4, -0.7, 6.0]) + rng.normal(0.0, 0.2, 3)
        solved = solve_ivp(
            lambda _, w: (np.cross(moments * w, w) + vent) / moments - damping * w,
            (0.0, times[-1]),
            spin,
            t_eval=times,
            rtol=1e-10,
            atol=1e-12,
        )
        read = solved.y.T + rng.normal(0.0, NOISE_RADS, (rows, 3))
        nothing, body = np.full((rows, 3), np.nan), Body(np.zeros(3), np.eye(3), moments)
        where = Surroundings(np.zeros(3), body)
        made.append(Trajectory(f"spun_{number}", times, nothing, None, None, None, None, None, where, read))
    return made


def value_of(registered: Registered, fit: CampaignFit, name: str) -> tuple[float, float]:
    found = {v.parameter.name: v for v in effect_values(registered, fit, campaign_covariance(registered.campaign, fit))}
    return found[name].value, found[name].sigma


@pytest.mark.parametrize("ratios", [(1.0, 1.0, 1.0), (0.55, 0.56, 1.0)], ids=["ball", "disc"])
def test_the_damping_of_a_spin_is_recovered_from_a_gyroscope_alone(ratios: tuple[float, float, float]) -> None:
    registered = register_trajectories(gyro_rows(4, 0.2, ratios))
    _, fit = fit_with(registered.campaign, registered.start, (catalogue()["spin_damping"],))
    value, sigma = value_of(registered, fit, "rate")
    assert fit.settled
    assert abs(value - 0.2) < 3.0 * sigma
    assert sigma < 1e-3
    noise = registered.campaign.sequences[0].sigma[:, 3:]
    np.testing.assert_allclose(noise, NOISE_RADS, rtol=0.15)


def test_a_torque_that_is_fixed_to_the_body_is_told_as_unknown() -> None:
    """A gyroscope reads it in the body's axes, where it is the same in all sequences; its force would need positions, and is not on trial.

    The right family has three numbers for all sequences; torques of every sequence over time have 36 here, and cost more than they gain.
    """
    registered = register_trajectories(gyro_rows(6, 0.0, (0.55, 0.7, 1.0), sequences=4, vent=np.array([0.02, -0.03, 0.02])))
    tried = {key: catalogue()[key] for key in ("spin_damping", "nutation_damping", "gyroscope_bias", "gyroscope_scale")}
    found = explain(registered.campaign, registered.start, tried)
    assert found.found == ()
    assert found.left is not None
    assert found.left.present
    assert found.left.test.effect.entry.key == "body_thrust"


def test_an_axis_that_a_gyroscope_never_reads_starts_at_rest() -> None:
    """A saturated axis has no reading in any row: the fit starts with what the others read."""
    (each,) = gyro_rows(4, 0.0, (1.0, 1.0, 1.0), sequences=1)
    assert each.gyro is not None
    blind = replace(each, gyro=np.column_stack([each.gyro[:, :2], np.full(len(each.gyro), np.nan)]))
    flight = first_flight(task_of(blind), blind.surroundings.body)
    np.testing.assert_allclose(flight.omega, [*each.gyro[60, :2], 0.0], atol=0.1)


def test_a_ball_whose_spin_nothing_tells_is_refused() -> None:
    """Its readings along two axes are the same whatever the spin about the third: the fit ran away, at no end of steps."""
    (each,) = gyro_rows(4, 0.0, (1.0, 1.0, 1.0), sequences=1)
    assert each.gyro is not None
    blind = replace(each, gyro=np.column_stack([each.gyro[:, :2], np.full(len(each.gyro), np.nan)]))
    with pytest.raises(InputError, match="expected inertia_ratios of a body whose gyro_z is not read in any row, got those of a ball"):
        register_trajectories([blind])


@pytest.mark.parametrize(
    "turned", [np.eye(3), np.eye(3)[[1, 2, 0]], Rotation.from_rotvec([0.0, 0.0, 0.4]).as_matrix()], ids=["z", "x", "oblique"]
)
def test_a_spin_that_is_never_read_is_found_from_the_wobble(turned: Array) -> None:
    """A thrown disc turns faster than its gyroscope reads: how fast its other axes wobble says how fast, beside a bias and a lost row."""
    read = gyro_rows(4, 0.0, (0.55, 0.56, 1.0), sequences=1, rows=250)
    blind = []
    for each in read:
        assert each.gyro is not None
        gyro = (each.gyro + np.array([0.1, -0.1, 0.0])) @ turned.T
        gyro[:, np.argmax(turned[:, 2])] = np.nan
        gyro[7] = np.nan
        blind.append(replace(each, gyro=gyro, surroundings=replace(each.surroundings, body=Body(np.zeros(3), turned, MOMENTS))))
    registered = register_trajectories(blind)
    _, fit = fit_with(registered.campaign, registered.start, (catalogue()["gyroscope_bias"],))
    assert fit.settled
    for each, flight in zip(read, fit.state.flights, strict=True):
        assert each.gyro is not None
        assert flight.omega @ turned[:, 2] == pytest.approx(each.gyro[125, 2], rel=0.01)


def test_maps_of_readings_of_two_axes_warn_of_nothing() -> None:
    each = gyro_rows(4, 0.0, (0.55, 0.56, 1.0))
    blind = [replace(t, gyro=np.where([True, True, False], np.asarray(t.gyro), np.nan)) for t in each]
    registered = register_trajectories(blind)
    maps = residual_maps(registered.campaign, base_fit(registered.campaign, registered.start))
    assert {m.kind for m in maps} == {"spin_x", "spin_y", "spin_along"}


def test_a_gyroscope_alone_shows_where_it_misses_and_what_needs_more_is_refused() -> None:
    registered = register_trajectories(gyro_rows(5, 0.2, (0.55, 0.56, 1.0)))
    task = registered.campaign.sequences[0]
    assert task.measured == {"gyro"}
    assert task.still[np.r_[X, V, THETA]].all()
    assert not task.still[OMEGA].any()
    refused = {key: registered.campaign.kind.why_not(registered.campaign, e) for key, e in catalogue().items()}
    assert refused["linear_drag"] == refused["length_scale"] == "it needs measured positions"
    assert refused["spin_damping"] is None
    assert refused["inertia_ratios"] is None
    assert "positions or orientations" in str(refused["frame_rate"])
    assert registered.campaign.kind.why_not(registered.campaign, BodyThrust()) is None
    fit = base_fit(registered.campaign, registered.start)
    assert "spin_along" in {m.kind for m in residual_maps(registered.campaign, fit)}


def test_derivatives_of_readings_beside_orientations_are_central_differences() -> None:
    known = campaign(3, Hidden(), Tracker(rows=12, spin=True, ratios=(0.5, 0.8, 1.0), stated=True), sequences=1)[0]
    tilted = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    body = Body(np.zeros(3), tilted * np.sign(np.linalg.det(tilted)), np.array([0.5, 0.8, 1.0]))
    trajectory = replace(
        known, omega_world=None, gyro=known.omega_world, sigma_gyro=known.sigma_omega, surroundings=replace(known.surroundings, body=body)
    )
    task, model = task_of(trajectory), Model((catalogue()["spin_damping"], catalogue()["frame_rate"], catalogue()["inertia_ratios"]))
    flight, theta = first_flight(task, body), np.array([0.5, 0.01, 0.05, -0.04])
    J = trajectory_errors(task, flight, model, theta).J[:, task.columns("gyro")]
    for column in [*range(12), *range(N_PARAMETERS, N_PARAMETERS + 4)]:
        step, change = np.zeros(N_PARAMETERS), np.zeros(4)
        (step if column < N_PARAMETERS else change)[column % N_PARAMETERS] = 1e-4
        ends = [trajectory_errors(task, moved(flight, sign * step), model, theta + sign * change).e for sign in (1.0, -1.0)]
        difference = ((ends[0] - ends[1]) / 2e-4)[:, task.columns("gyro")]
        # The clock's column takes the rate of the spin from row to row, which the ends know to the first order alone.
        inner = slice(1, -1) if column == N_PARAMETERS + 1 else slice(None)
        assert np.abs(J[..., column] - difference)[inner].max() < 5e-3 * np.abs(difference).max() + 1e-6, column


def test_a_spin_that_is_known_once_shows_lift_and_no_damping() -> None:
    known = campaign(6, Hidden(drag=0.2, spin_rads=60.0), Tracker(rows=30, orientation=False, stated=True), sequences=4)
    turning = campaign(6, Hidden(drag=0.2, spin_rads=60.0), Tracker(rows=30, orientation=False, spin=True, stated=True), sequences=4)
    once = []
    for trajectory, other in zip(known, turning, strict=True):
        omega, sigma = np.full((30, 3), np.nan), np.full((30, 3), np.nan)
        assert other.omega_world is not None
        omega[15], sigma[15] = other.omega_world[15], 0.5
        once.append(replace(trajectory, omega_world=omega, sigma_omega=sigma))
    registered = register_trajectories(once)
    refused = {key: registered.campaign.kind.why_not(registered.campaign, e) for key, e in catalogue().items()}
    assert refused["magnus_lift"] is None
    assert refused["spin_damping"] == "it needs a spin that was measured more than once in a flight"
    _, fit = fit_with(registered.campaign, registered.start, (catalogue()["quadratic_drag"], catalogue()["magnus_lift"]))
    drag, lift = (value_of(registered, fit, name) for name in ("per_length", "coefficient"))
    assert abs(drag[0] - 0.2) < 3.0 * drag[1]
    assert abs(lift[0]) < 3.0 * lift[1]
    assert lift[1] < 1e-3


def test_positions_in_two_dimensions_and_missing_cells_still_show_the_drag() -> None:
    tracked = campaign(8, Hidden(drag=0.3), Tracker(rows=40, orientation=False, sigma_x=2e-4), sequences=4)
    partly = []
    for number, trajectory in enumerate(tracked):
        x = trajectory.x_world.copy()
        x[:, 1] = np.nan
        x[5 + number : 9 + number, 2] = np.nan
        partly.append(replace(trajectory, x_world=x))
    registered = register_trajectories(partly)
    assert registered.campaign.sequences[0].still[[1, 7]].all()
    np.testing.assert_allclose(registered.campaign.sequences[0].sigma[0, [0, 2]], 2e-4, rtol=0.2)
    _, fit = fit_with(registered.campaign, registered.start, (catalogue()["linear_drag"],))
    value, sigma = value_of(registered, fit, "rate")
    assert fit.settled
    assert 0.1 < value < 2.0
    assert sigma < 0.1
    assert not fit.equations[0].errors.seen[:, 1].any()
    assert not fit.equations[1].errors.seen[6:10, 2].any()


def test_without_positions_a_law_has_no_terms_of_a_force() -> None:
    campaign = register_trajectories(gyro_rows(2, 0.2, (0.55, 0.8, 1.0), rows=40)).campaign
    assert campaign.kind.why_not(campaign, ForceCurve()) == "it needs measured positions"
    assert campaign.kind.why_not(campaign, TorqueCurve()) is None


def test_the_law_of_dry_friction_is_read_off_a_gyroscope_alone() -> None:
    """No force is on trial where no position is measured: the curve of the torque was taken for one, and no law was found.

    A torque that stands still in the body is something unknown by itself: no damping is told that is not there.
    """
    friction, rows = 25.0, 45
    times, rng = np.arange(rows) / 100.0, np.random.default_rng(8)
    spin = np.array([0.3, 0.6, -13.0])
    read = spin * (1.0 - friction * times / np.linalg.norm(spin))[:, None] + rng.normal(0.0, 10.0 * NOISE_RADS, (rows, 3))
    nothing, where = np.full((rows, 3), np.nan), Surroundings(np.zeros(3), Body(np.zeros(3), np.eye(3), np.ones(3)))
    registered = register_trajectories([Trajectory("table", times, nothing, None, None, None, None, None, where, read)])
    found = explain(registered.campaign, registered.start, catalogue())
    assert found.found == ()
    assert found.left is not None
    assert found.left.present
    law = fit_empirical(found.campaign, found.fit, found.left).law
    assert law is not None
    assert [term.key for term in law.terms] == ["against_spin"]
    assert law.law.exponents[0].taken == 0.0
    assert law.removed.share > 0.9
