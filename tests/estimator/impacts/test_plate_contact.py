"""What a plate adds to a fit: nothing where the particle is clear of it, derivatives of its cost, a covariance that knows."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import norm

from datasets.vocabulary.plate import Plate
from estimator.fitting.weighed_tangencies import Refinement
from estimator.impacts.piecewise_fit import refine_piecewise
from estimator.impacts.plate_contact import PlateTask, gaps_of, held_by_plate, penalty, stated_spread, tangents
from estimator.motion.piecewise import PiecewiseFlight, touch_and_sensitivity
from tests.estimator.impacts.test_piecewise_fit import TIMES, bouncing, seen

Array = NDArray[np.float64]
SETTINGS = Refinement(floor_px=0.04, body_noise_px=0.05, within_pairs=0)
SIGMA_M = 3e-5
CORNERS = 3e-3 * np.array([[1.0, 0.2, -0.3], [-0.9, 0.4, 0.2], [0.1, 1.1, 0.5], [0.2, -1.0, 0.4], [-0.3, 0.1, 1.2], [0.4, -0.2, -1.1]])
NORMAL = np.array([-0.6, -0.8, 0.0])


def plate_at(flight: PiecewiseFlight, height_m: float, **stated: float) -> Plate:
    """A plate so far under the lowest corner at the impact, pointing against the motion before it."""
    touch, _ = touch_and_sensitivity(flight, 0)
    arms = (CORNERS - flight.first.com) @ touch.R[0].T
    lowest = touch.x[0] + arms[int(np.argmin(arms @ NORMAL))]
    return Plate(lowest - height_m * NORMAL + 4e-3 * tangents(NORMAL)[0], NORMAL, **stated)


def task_of(plate: Plate, *, touched: bool = False, kept_out: bool = True) -> PlateTask:
    return PlateTask(plate, 0.0, stated_spread(plate), CORNERS, SIGMA_M, kept_out=kept_out, touched=touched)


def test_the_penalty_is_that_of_a_gap_that_is_not_negative() -> None:
    z = np.array([-60.0, -29.9, -3.0, 0.0, 2.0, 8.0])
    cost, slope, curvature = penalty(z, np.zeros(6, dtype=bool))
    np.testing.assert_allclose(cost[1:], -norm.logcdf(z[1:]), rtol=1e-9)
    assert np.all(np.diff(cost) < 0.0)
    assert np.all((curvature >= 0.0) & (curvature <= 1.0))
    assert curvature[0] == pytest.approx(1.0, abs=1e-3)
    assert slope[0] == pytest.approx(-60.0, rel=1e-3)
    assert abs(slope[-1]) < 1e-10
    np.testing.assert_allclose(penalty(z, np.ones(6, dtype=bool))[0], 0.5 * z**2)


@pytest.mark.parametrize("stated", [{}, {"normal_sigma_rad": 0.004, "offset_sigma_m": 4e-5}])
@pytest.mark.parametrize("touched", [False, True])
def test_the_gradient_is_that_of_the_cost(stated: dict[str, float], touched: bool) -> None:
    """By the time of impact and the centre of mass too; the plate's own parameters follow, as fitted within."""
    flight = bouncing()
    flight = replace(flight, first=replace(flight.first, com=np.array([3e-5, -2e-5, 4e-5])))
    task = task_of(replace(plate_at(flight, -4e-5, **stated), velocity_world=np.array([0.2, 0.3, -0.1])), touched=touched)
    g = held_by_plate(task, flight, TIMES).equations.g
    assert np.abs(g).max() > 0.0
    for column, width in ((0, 1e-7), (1, 1e-7), (4, 1e-6), (7, 1e-5), (10, 1e-3), (13, 1e-7), (21, 1e-9)):
        step = np.zeros(flight.size)
        step[column] = width
        costs = [held_by_plate(task, flight.moved(s * step), TIMES).equations.cost for s in (1.0, -1.0)]
        assert (costs[0] - costs[1]) / (2.0 * width) == pytest.approx(g[column], rel=2e-3, abs=1e-4 * np.abs(g[column]) + 1e-6)


def test_a_plate_well_below_says_nothing_and_one_that_is_reached_into_pushes_out() -> None:
    flight = bouncing()
    far = gaps_of(task_of(plate_at(flight, 5e-3)), flight, TIMES)
    assert far.h[0] == pytest.approx(5e-3)
    inside, clear = (held_by_plate(task_of(plate_at(flight, d), kept_out=False), flight, TIMES).equations for d in (-1e-4, 1e-3))
    assert clear.cost < 1e-12
    assert np.abs(clear.H).max() < 1e-6 * np.abs(inside.H).max()
    assert inside.cost == pytest.approx(-norm.logcdf(-1e-4 / SIGMA_M), rel=1e-6)
    _, J = touch_and_sensitivity(flight, 0)
    assert inside.g @ np.linalg.pinv(J[:3]) @ NORMAL < 0.0


def test_what_is_not_known_of_the_plate_holds_the_flight_less() -> None:
    flight = bouncing()
    plates = [plate_at(flight, -2e-5, offset_sigma_m=sigma) for sigma in (0.0, 3 * SIGMA_M, 1.0)]
    exact, loose, unknown = (held_by_plate(task_of(p, touched=True, kept_out=False), flight, TIMES).equations.H for p in plates)
    kept = np.argmax(np.diag(exact))
    assert loose[kept, kept] == pytest.approx(exact[kept, kept] / 10.0, rel=0.2)
    assert unknown[kept, kept] < 1e-6 * exact[kept, kept]


def test_a_touch_makes_the_error_bar_along_the_normal_smaller() -> None:
    """The others stay what they are, up to the noise that is measured anew."""
    truth = bouncing()
    task = replace(seen(truth), huber=4.0)
    free = refine_piecewise(task, truth, SETTINGS)
    plate = replace(task_of(plate_at(free.flight, 0.0), touched=True, kept_out=False), sigma_m=2e-6)
    held = refine_piecewise(task, free.flight, SETTINGS, plate)
    assert held.settled
    sigmas = []
    for refined in (free, held):
        touch, J = touch_and_sensitivity(refined.flight, 0)
        arms = (CORNERS - refined.flight.first.com) @ touch.R[0].T
        row = NORMAL @ J[:3] + np.cross(arms[int(np.argmin(arms @ NORMAL))], NORMAL) @ J[3:6]
        row[12:15] -= NORMAL @ touch.R[0]
        sigmas.append(float(np.sqrt(row @ refined.covariance @ row)))
    assert sigmas[1] < 0.5 * sigmas[0]
    assert np.all(np.diag(held.covariance) < 1.3 * np.diag(free.covariance))
