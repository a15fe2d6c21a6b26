"""Where a path first touches something: a jump of its velocity, and nothing that forces, clocks, bad rows or noise do."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from datasets.trajectory import Trajectory
from estimator.measurements.trajectories.impacts import untouched
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.estimator.measurements.trajectories.struck_tosses import RATE_HZ, toss
from tests.estimator.measurements.trajectories.test_gyroscope import gyro_rows

pytestmark = pytest.mark.long


def before_contact(trajectories: Sequence[Trajectory]) -> dict[str, Trajectory]:
    named = {t.name: t for t in trajectories}
    return {name: named[name].between(*rows) for name, rows in untouched(trajectories).items()}


def test_whole_tosses_are_cut_at_their_first_hit() -> None:
    rng = np.random.default_rng(11)
    made = [toss(rng, rows=60) for _ in range(8)]
    named = [replace(each.trajectory, name=f"toss_{i}") for i, each in enumerate(made)]
    found = before_contact(named)
    assert sorted(found) == [each.name for each in named]
    for each, t in zip(made, named, strict=True):
        cut, last = found[t.name], int(each.hits[0].time_s * RATE_HZ)
        assert last - 1 <= len(cut.times_s) <= last + 1
        assert cut.q_world_tracked is not None
        assert len(cut.q_world_tracked) == len(cut.x_world) == len(cut.times_s)


def spoiled(trajectory: Trajectory, rng: np.random.Generator, share: float, off_m: float, rows: int = 1) -> Trajectory:
    """With a ``share`` of its rows off, each in a direction drawn for it, ``rows`` of them in a run."""
    n = len(trajectory.times_s)
    bad = np.convolve(rng.uniform(size=n) < share / rows, np.ones(rows))[:n] > 0.0
    away = rng.normal(size=(n, 3))
    return replace(trajectory, x_world=trajectory.x_world + off_m * bad[:, None] * away / np.linalg.norm(away, axis=1, keepdims=True))


@pytest.mark.parametrize(("share", "off_m"), [(0.03, 0.02), (0.03, 0.1), (0.08, 0.02)])
def test_bad_rows_hide_no_contact(share: float, off_m: float) -> None:
    """Before, a tenth to a third of such tosses was taken for one free flight with what it strikes."""
    rng = np.random.default_rng(14)
    made = [toss(rng, rows=60) for _ in range(24)]
    named = [replace(spoiled(each.trajectory, rng, share, off_m), name=f"toss_{i}") for i, each in enumerate(made)]
    found = before_contact(named)
    off = [len(found[t.name].times_s) - made[i].hits[0].time_s * RATE_HZ for i, t in enumerate(named) if t.name in found]
    assert len(off) >= 23
    assert min(off) > -4.0
    assert max(off) < 3.0


def test_a_run_of_bad_rows_is_no_contact() -> None:
    """Three rows off as far as one likes, of which most were: what comes back to its path touched nothing."""
    rng, cut = np.random.default_rng(15), 0
    for each in _flights():
        x = each.x_world.copy()
        x[20:23] += rng.normal(scale=0.02, size=(3, 3))
        cut += len(before_contact([replace(each, x_world=x)]))
    assert cut == 0


def test_rows_without_positions_are_passed_over() -> None:
    rng = np.random.default_rng(12)
    made = toss(rng, rows=60)
    x = made.trajectory.x_world.copy()
    x[3] = np.nan
    found = before_contact([replace(made.trajectory, x_world=x)])
    (cut,) = found.values()
    assert len(cut.times_s) == int(made.hits[0].time_s * RATE_HZ) + 1
    assert np.isnan(cut.x_world[3]).all()


@pytest.mark.parametrize(("unseen", "seen_in"), [([1], 8), ([0, 1], 7)])
def test_contacts_are_seen_along_the_axes_that_were_measured(unseen: list[int], seen_in: int) -> None:
    """A film from the side, and heights alone, by which one slow hit is too soft to be told."""
    rng, cut = np.random.default_rng(13), 0
    for _ in range(8):
        made = toss(rng, rows=60)
        x = made.trajectory.x_world.copy()
        x[:, unseen] = np.nan
        for found in before_contact([replace(made.trajectory, x_world=x, q_world_tracked=None, sigma_theta=None)]).values():
            assert abs(len(found.times_s) - made.hits[0].time_s * RATE_HZ) < 1.0
            cut += 1
    assert cut >= seen_in


def _flights(**changed: float) -> list[Trajectory]:
    return campaign(21, Hidden(**changed), Tracker(rows=40, sigma_x=2e-4), sequences=12)


@pytest.mark.parametrize("drag", [0.0, 0.5, 4.0])
def test_air_is_no_contact(drag: float) -> None:
    assert before_contact(_flights(drag=drag)) == {}


def test_a_thrust_that_turns_with_the_body_is_no_contact() -> None:
    made = campaign(23, Hidden(thrust=(8.0, 0.0, 0.0), spin_rads=20.0), Tracker(rows=40, sigma_x=2e-4), sequences=12)
    assert before_contact(made) == {}


@pytest.mark.parametrize("turn", [0.2, 0.3, 0.4, 0.6])
@pytest.mark.parametrize("sigma", [2e-5, 1e-4])
def test_a_marker_beside_the_centre_of_a_body_that_turns_is_no_contact(turn: float, sigma: float) -> None:
    """Up to a radian from row to row: its acceleration turns, and is many times gravity."""
    tracker = Tracker(rows=120, sigma_x=sigma, orientation=False)
    assert before_contact(campaign(27, Hidden(com=(0.005, 0.0, 0.0), spin_rads=turn * 148.0), tracker, sequences=20)) == {}


@pytest.mark.parametrize("rows", [3, 6, 15, 40])
def test_what_is_held_and_thrown_is_cut_where_it_is_let_go(rows: int) -> None:
    """But for those that are thrown so softly that they leave the hand as they would fall from rest."""
    rng, held = np.random.default_rng(7), []
    for each in _flights():
        x = np.concatenate([each.x_world[:1] + rng.normal(0.0, 2e-4, (rows, 3)), each.x_world])
        held.append(replace(each, times_s=np.arange(len(x)) / 148.0, x_world=x, q_world_tracked=None, sigma_theta=None))
    found = untouched(held)
    assert len(found) >= 11
    assert all(last == rows + 40 for _, last in found.values())
    assert all(rows <= first <= rows + 1 for first, _ in found.values())


@pytest.mark.parametrize("rate_hz", [60.0, 148.0, 240.0, 1000.0])
def test_what_lies_still_before_it_drops_is_left_out(rate_hz: float) -> None:
    """From rest: no velocity jumps, but what does not fall for so long is held."""
    rng = np.random.default_rng(29)
    for _ in range(6):
        held, rows = int(rng.integers(0.2 * rate_hz, 0.4 * rate_hz)), int(0.4 * rate_hz)
        fallen = np.maximum(np.arange(held + rows) - held, 0) / rate_hz
        x = np.outer(-0.5 * 9.81 * fallen**2, [0.0, 0.0, 1.0]) + rng.normal(0.0, 3e-4, (held + rows, 3))
        made = replace(
            _flights()[0], times_s=np.arange(held + rows) / rate_hz, x_world=x, q_world_tracked=None, sigma_x=None, sigma_theta=None
        )
        ((first, last),) = untouched([made]).values()
        assert last == held + rows
        assert held <= first <= held + 1 + 0.03 * rate_hz


def test_what_falls_from_rest_in_its_first_row_is_not_cut() -> None:
    rng = np.random.default_rng(30)
    times = np.arange(400) / 1000.0
    x = np.outer(-0.5 * 9.81 * times**2, [0.0, 0.0, 1.0]) + rng.normal(0.0, 3e-4, (400, 3))
    assert untouched([replace(_flights()[0], times_s=times, x_world=x, q_world_tracked=None, sigma_x=None, sigma_theta=None)]) == {}


@pytest.mark.parametrize("rows", [5, 15, 40])
def test_what_is_held_thrown_and_hits_is_cut_at_both_ends(rows: int) -> None:
    rng = np.random.default_rng(19)
    made = [toss(rng, rows=60) for _ in range(8)]
    held = []
    for i, each in enumerate(made):
        t = each.trajectory
        x = np.concatenate([t.x_world[:1] + rng.normal(0.0, 2e-4, (rows, 3)), t.x_world])
        times = np.arange(len(x)) / RATE_HZ
        held.append(replace(t, name=f"toss_{i}", times_s=times, x_world=x, q_world_tracked=None, sigma_theta=None))
    found = untouched(held)
    for each, t in zip(made, held, strict=True):
        first, last = found[t.name]
        assert rows <= first <= rows + 1
        assert abs(last - rows - int(each.hits[0].time_s * RATE_HZ)) <= 1


def test_a_spin_that_was_measured_once_stays_where_its_row_is_cut_off() -> None:
    t = _flights()[0]
    spin = np.full((40, 3), np.nan)
    spin[20] = [1.0, 2.0, 3.0]
    once = replace(t, omega_world=spin, sigma_omega=0.1 * spin)
    for first, last in ((0, 15), (25, 40), (10, 30)):
        cut = once.between(first, last)
        assert cut.omega_world is not None
        assert cut.sigma_omega is not None
        (row,) = np.flatnonzero(np.isfinite(cut.omega_world).all(axis=1))
        np.testing.assert_array_equal(cut.omega_world[row], [1.0, 2.0, 3.0])
        np.testing.assert_allclose(cut.sigma_omega[row], [0.1, 0.2, 0.3])
        assert len(cut.omega_world) == last - first


def test_a_stated_noise_that_is_far_too_large_hides_no_contact() -> None:
    made = toss(np.random.default_rng(13), rows=60).trajectory
    assert before_contact([replace(made, sigma_x=np.full(made.x_world.shape, 1e-3))])


def test_a_gap_in_the_clock_is_no_contact() -> None:
    """Three frames are missing, and time stamps do not say so."""
    gapped = []
    for each in _flights():
        kept = np.r_[0:18, 21:40]
        gapped.append(replace(each, times_s=each.times_s[: len(kept)], x_world=each.x_world[kept], q_world_tracked=None))
    assert before_contact(gapped) == {}


def test_bad_rows_are_no_contact() -> None:
    """One row in twenty is 5 to 20 standard deviations off, at the ends, too."""
    rng, made = np.random.default_rng(31), []
    for each in campaign(25, Hidden(), Tracker(rows=24, sigma_x=2e-4), sequences=60):
        x = each.x_world.copy()
        bad = rng.random(len(x)) < 0.05
        x[bad] += rng.normal(size=(int(bad.sum()), 3)) * rng.uniform(5, 20, (int(bad.sum()), 1)) * 2e-4
        made.append(replace(each, x_world=x))
    assert before_contact(made) == {}


def test_rounded_time_stamps_are_no_contact() -> None:
    made = [replace(each, times_s=np.round(each.times_s, 3)) for each in _flights(drag=0.3)]
    assert before_contact(made) == {}


def test_a_gyroscope_alone_and_rows_too_few_tell_no_contact() -> None:
    assert before_contact(gyro_rows(4, 0.0, (0.5, 0.6, 1.0))) == {}
    assert before_contact([each.between(0, 5) for each in _flights()]) == {}
    assert before_contact([]) == {}
