"""Flights of few rows, alone, whose noise nobody states: their velocities lie where their covariances say."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from datasets.trajectory import Trajectory
from estimator.diagnosis.adding import fit_with
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import LAYOUT
from tests.estimator.made_trajectories import GRAVITY, Hidden, Tracker, campaign

Array = NDArray[np.float64]
FLIGHTS, NOISE_M = 120, 1e-3
EXACT = Tracker(rows=10, sigma_x=0.0, orientation=False)


def pull_of_v(flight: Trajectory, errors: Array) -> float:
    """Squared error of the velocity over its covariance, of a flight with ``errors`` (n, 3) of its positions, in metres."""
    registered = register_trajectories([replace(flight, x_world=flight.x_world + errors)])
    there, fit = fit_with(registered.campaign, registered.start, ())
    found, t = fit.state.flights[0], flight.times_s
    shape = np.column_stack([np.ones(len(t)), t - found.time_s])
    (_, v), *_ = np.linalg.lstsq(shape, flight.x_world - 0.5 * GRAVITY * (t - found.time_s)[:, None] ** 2, rcond=None)
    C = campaign_covariance(there, fit).of(0, LAYOUT.columns(["v"]))
    return float((found.v - v) @ np.linalg.solve(C, found.v - v))


@pytest.mark.parametrize("alike", [1, 2])
def test_velocities_of_single_flights_lie_inside_their_ellipsoids(alike: int) -> None:
    """With noise taken as known, 97% and 78% of these did."""
    rng, exact = np.random.default_rng(21), campaign(5, Hidden(), EXACT, sequences=FLIGHTS)
    drawn = [rng.normal(size=(EXACT.rows + alike - 1, 3)) for _ in exact]
    noise = [sum(e[k : k + EXACT.rows] for k in range(alike)) * NOISE_M / np.sqrt(alike) for e in drawn]
    squares = np.array([pull_of_v(flight, errors) for flight, errors in zip(exact, noise, strict=True)])
    assert np.mean(squares < chi2.isf(0.05, 3)) > 0.9
    assert np.median(squares) > 0.3 * chi2.median(3)
