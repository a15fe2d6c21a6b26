"""Flights of which a tracker got some rows wrong say nearly what they say without those."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.trajectory import Trajectory
from estimator.diagnosis.adding import fit_with
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.reports.campaign_reporting import effect_values
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tumble.unknowns import spoiled_words

Array = NDArray[np.float64]
HIDDEN = Hidden(drag=0.3)
SHORT = Tracker(rows=16)


@cache
def flights(off_m: float, turned_deg: float) -> tuple[list[Trajectory], list[set[int]]]:
    """Eight short flights with a row or two of each off, and which."""
    rng, made, spoiled = np.random.default_rng(21), [], []
    for each in campaign(9, HIDDEN, SHORT, sequences=8):
        rows = rng.choice(np.arange(len(each.times_s)), 1 + len(made) % 2, replace=False)
        x, q = each.x_world.copy(), Rotation.from_quat(np.asarray(each.q_world_tracked))
        away, about = (v / np.linalg.norm(v, axis=1, keepdims=True) for v in rng.normal(size=(2, len(rows), 3)))
        x[rows] += off_m * away
        turn = np.zeros(x.shape)
        turn[rows] = np.radians(turned_deg) * about
        made.append(replace(each, x_world=x, q_world_tracked=(Rotation.from_rotvec(turn) * q).as_quat()))
        spoiled.append(set(rows.tolist()) if off_m or turned_deg else set())
    return made, spoiled


@cache
def registered(off_m: float, turned_deg: float) -> Registered:
    return register_trajectories(flights(off_m, turned_deg)[0])


@cache
def told(off_m: float, turned_deg: float) -> tuple[Array, Array]:
    """Drag and spin damping with their standard deviations."""
    of = registered(off_m, turned_deg)
    effects = tuple(catalogue()[key] for key in ("quadratic_drag", "spin_damping"))
    where, fit = fit_with(of.campaign, of.start, effects)
    values = effect_values(replace(of, campaign=where), fit, campaign_covariance(where, fit))
    return np.array([v.value for v in values]), np.array([v.sigma for v in values])


@pytest.mark.parametrize(("off_m", "turned_deg"), [(0.02, 0.0), (0.1, 0.0), (0.0, 20.0), (0.02, 180.0)])
def test_rows_that_are_off_cost_what_is_known_next_to_nothing(off_m: float, turned_deg: float) -> None:
    """A tenth of all rows."""
    tasks = registered(off_m, turned_deg).campaign.sequences
    assert [set(task.spoiled) for task in tasks] == flights(off_m, turned_deg)[1]
    (values, sigma), (clean, least) = told(off_m, turned_deg), told(0.0, 0.0)
    assert np.all(sigma < 1.3 * least)
    assert np.all(np.abs(values - clean) < sigma)
    assert np.all(np.abs(values - [HIDDEN.drag, 0.0]) < 4.0 * sigma)


def test_the_user_is_told_which_rows_are_not_used() -> None:
    tasks = registered(0.02, 0.0).campaign.sequences
    (said,) = spoiled_words(tasks)
    first = tasks[0]
    (row,) = first.spoiled
    assert said.startswith("Not used, as far off the rows before and after them: 12 of 128 rows, in 8 of 8 sequences: toss_0 at ")
    assert f"toss_0 at {first.times_s[row]:.6g} s" in said
    assert spoiled_words(registered(0.0, 0.0).campaign.sequences) == ()
