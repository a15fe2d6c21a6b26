"""The study of real impacts: the cube's shape and mass from impacts, what counts as clear, and a page that says what its result says."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.estimate import ImpactEstimate, Status, VelocityEstimate
from estimator.contact_validation.laws.models import RIGID
from estimator.measurements.trajectories.impacts import measure_impacts
from scripts.real.real_impacts import several_contacts
from scripts.real.real_impacts_cube import (
    BOARD,
    HALF_WIDTH_M,
    Cube,
    CubeImpact,
    board_impacts,
    clearances,
    kind,
    lowest_lever,
    mass_of,
    measured,
    rounding_of,
    whole_tosses,
)
from scripts.real.real_impacts_page import page
from scripts.real.real_tosses import RATE_HZ

ROOT = Path(__file__).parents[2]
STORED = json.loads((ROOT / "docs" / "results" / "real_impacts.json").read_text(encoding="utf-8"))
CENTRE = np.array([0.001, -0.002, 0.005])
CUBE = Cube(0.005, 0.0026, CENTRE)


def struck(R: np.ndarray, impulse: np.ndarray, *, spread_s: float = 0.0, rows: int = 0) -> CubeImpact:
    """A cube that touches the board in the orientation ``R`` and gets ``impulse`` (m/s) where it does."""
    nothing = np.zeros((6, 6))
    height = -CUBE.levers(R)[:, 2].min()
    q = Rotation.from_matrix(R).as_quat()
    before = VelocityEstimate(0.1, np.array([0.3, 0.0, -1.0]), np.array([1.0, -2.0, 0.5]), nothing, nothing)
    bare = ImpactEstimate(0.1, 1e-4, np.array([0.0, 0.0, height]), q, before, before, np.eye(18) * 1e-6)
    lever = lowest_lever(CUBE, CubeImpact(0, 0, bare, 0.0, 0))
    turn = np.cross(lever, impulse) / CUBE.kappa_m2
    after = VelocityEstimate(0.1, before.v_world + impulse, before.omega_world + turn, nothing, nothing)
    record = ImpactEstimate(0.1, 1e-4, bare.x_world, q, before, after, bare.covariance)
    return CubeImpact(0, 0, record, spread_s, rows)


def test_radius_centre_and_inertia_come_back_from_impacts() -> None:
    rng = np.random.default_rng(2)
    impacts = [struck(R, np.array([*rng.normal(0.0, 0.2, 2), 1.3])) for R in Rotation.random(40, rng=rng).as_matrix()]
    radius, height, rms = rounding_of(impacts, CENTRE)
    np.testing.assert_allclose([radius, height, rms], [CUBE.rounding_m, 0.0, 0.0], atol=1e-12)
    known = mass_of(impacts, CUBE)
    assert known.kappa_m2 == pytest.approx(CUBE.kappa_m2, rel=1e-6)
    np.testing.assert_allclose(known.shift, 0.0, atol=1e-8)
    # Who takes the middle of the cube for the centre of mass is told where that is.
    taken = mass_of(impacts, Cube(CUBE.rounding_m, 1.0, np.zeros(3)))
    np.testing.assert_allclose(taken.shift, CENTRE, atol=1e-8)


def test_what_touches() -> None:
    flat, edge = np.eye(3), Rotation.from_euler("x", 45.0, degrees=True).as_matrix()
    corner = Rotation.from_euler("xy", [45.0, 35.0], degrees=True).as_matrix()
    push = np.array([0.0, 0.0, 1.0])
    assert [kind(CUBE, struck(R, push)) for R in (flat, edge, corner)] == ["face", "edge", "corner"]
    np.testing.assert_allclose(clearances(CUBE, struck(flat, push))[[3, 4]], [0.0, 2.0 * (HALF_WIDTH_M - CUBE.rounding_m)], atol=1e-12)
    # A rounded cube on its face is as high as a sharp one, on a corner it is lower.
    assert CUBE.levers(flat)[:, 2].min() + CENTRE[2] == pytest.approx(-HALF_WIDTH_M)
    assert CUBE.levers(corner)[:, 2].min() + (corner @ CENTRE)[2] > -HALF_WIDTH_M * np.abs(corner[2]).sum()


def test_clear_impacts_have_one_contact() -> None:
    push = np.array([0.0, 0.0, 1.0])
    assert struck(np.eye(3), push).clear
    assert not struck(np.eye(3), push, spread_s=0.2 / RATE_HZ).clear
    assert not struck(np.eye(3), push, rows=1).clear


def test_models_see_the_point_that_touches() -> None:
    rng = np.random.default_rng(4)
    for R in Rotation.random(5, rng=rng).as_matrix():
        one = struck(R, np.array([0.1, 0.0, 1.3]))
        seen = measured(CUBE, one)
        lowest = seen.low_corners[np.argmin(seen.low_corners @ BOARD.normal_world)]
        np.testing.assert_allclose(lowest, lowest_lever(CUBE, one), atol=1e-12)


def test_all_corners_act_where_an_edge_lands_and_one_where_a_corner_does() -> None:
    corner = struck(Rotation.from_euler("xy", [45.0, 35.26], degrees=True).as_matrix(), np.array([0.0, 0.0, 1.0]))
    edge = struck(Rotation.from_euler("xy", [45.0, 0.5], degrees=True).as_matrix(), np.array([0.0, 0.0, 1.0]))
    values = np.array([0.3, 0.16])
    impacts = [measured(CUBE, corner), measured(CUBE, edge)]
    one, all_of_them = RIGID.predict(impacts, values), several_contacts(CUBE).predict(impacts, values)
    off = np.linalg.norm(one - all_of_them, axis=1)
    assert off[0] < 0.1 * np.linalg.norm(one[0] - np.concatenate([corner.record.before.v_world, corner.record.before.omega_world]))
    assert off[1] > 10.0 * off[0]


def test_real_tosses_have_impacts_and_resting_ones_are_refused(shared_data: Path) -> None:
    centre = np.array(STORED["passes"][-1]["centre_m"])
    tosses = whole_tosses(shared_data / "tosses" / "cube_tosses.npz", centre)
    chosen = [tosses[k] for k in (0, 3, 37, 59)]
    estimates = measure_impacts(chosen)
    assert [e.status for e in estimates] == [Status.CONVERGED, Status.RESTING, Status.CONVERGED, Status.CONVERGED]
    assert "no second free flight" in estimates[1].message
    impacts = board_impacts(estimates, centre)
    first = {i.toss: i for i in reversed(impacts)}
    assert first[0].clear
    assert first[3].clear
    assert not first[2].clear
    for one in impacts:
        assert 0.2 < one.jump[2] < 2.5
        assert one.record.time_sigma_s < (0.05 if one.clear else 1.0) / RATE_HZ
    told = next(e for e in STORED["clear"] if e["toss"] == 59)
    assert first[3].record.time_s == pytest.approx(told["time_s"], abs=5e-4)


def test_the_page_is_that_of_its_result() -> None:
    assert (ROOT / "docs" / "studies" / "real_impacts.md").read_text(encoding="utf-8") == "\n".join(page(STORED)).rstrip("\n") + "\n"


def test_the_stored_result_adds_up() -> None:
    assert sum(STORED["statuses"].values()) == STORED["tosses"] == 60
    assert len(STORED["clear"]) == STORED["clear_impacts"] == STORED["impacts"] - len(STORED["unclear"])
    assert len({e["toss"] for e in STORED["clear"]}) == STORED["tosses_with_clear_impact"]
    assert all(e["rows_in_contact"] == 0 and e["spread_s"] < 7e-4 for e in STORED["clear"])
    assert STORED["models"][0]["held_out_cost"] == min(m["held_out_cost"] for m in STORED["models"])
