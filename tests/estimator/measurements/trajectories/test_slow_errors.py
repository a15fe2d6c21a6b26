"""A tracker whose positions wander within a flight, differently in every flight: noise, beside what flights lack."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.polynomial import legendre
from scipy.signal import detrend

from datasets.trajectory import Trajectory
from estimator.diagnosis.explain import Explanation, explain
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import RATE_HZ, Hidden, Tracker, measured
from tumble.diagnosis_documents import campaign_content
from tumble.scattering import scattered

Array = np.ndarray
TRIED = ("linear_drag", "quadratic_drag", "gravity", "frame_rate", "uniform_acceleration", "steady_wind", "position_distortion")
TRACKER, FLIGHTS, DRAG = Tracker(rows=75, orientation=False), 14, 0.15
SIZE = 0.02
"""Of the process, m/s^1.5: two to three millimetres in half a second, beside half a millimetre of noise."""


def wandering(rng: np.random.Generator, rows: int) -> Array:
    """White accelerations, summed twice in steps of a tenth of a row."""
    step = 0.1 / RATE_HZ
    v = np.cumsum(SIZE * np.sqrt(step) * rng.normal(size=(10 * rows, 3)), axis=0)
    return np.asarray(np.cumsum(step * v, axis=0)[::10])


@cache
def flights(seed: int) -> tuple[list[Trajectory], list[Array]]:
    """Balls with drag as they fly, and what is added to their positions."""
    rng = np.random.default_rng(seed)
    made = [measured(f"ball_{i}", rng, Hidden(drag=DRAG), TRACKER) for i in range(FLIGHTS)]
    return made, [wandering(rng, TRACKER.rows) for _ in made]


def explained(seen: list[Trajectory]) -> Explanation:
    registered = register_trajectories(seen)
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})


@cache
def beside_slow_errors(seed: int) -> Explanation:
    made, off = flights(seed)
    return explained([replace(each, x_world=each.x_world + more) for each, more in zip(made, off, strict=True)])


def drag_of(found: Explanation) -> tuple[float, float]:
    part = found.fit.model.slices[found.fit.model.keys.index("quadratic_drag")]
    return float(found.fit.state.theta[0][part][0]), float(np.sqrt(found.covariance.of(0, 21 + np.r_[part])[0, 0]))


@pytest.mark.parametrize("seed", [3, 4])
def test_what_every_flight_has_for_itself_is_no_unknown_and_what_all_share_is_found(seed: int) -> None:
    found = beside_slow_errors(seed)
    assert found.found == ("quadratic_drag",)
    assert found.left is not None
    assert not found.left.present
    value, sigma = drag_of(found)
    assert abs(value - DRAG) < 3.0 * sigma < 0.1 * DRAG


@pytest.mark.parametrize("seed", [3, 4])
def test_their_size_is_that_of_the_process(seed: int) -> None:
    slow = beside_slow_errors(seed).campaign.kind.slow
    np.testing.assert_allclose(slow.size, SIZE, rtol=0.5)


def test_a_tracker_without_has_none() -> None:
    made, _ = flights(3)
    assert explained(made).campaign.kind.slow is None


def test_where_noise_is_stated_none_are_looked_for() -> None:
    made, off = flights(3)
    stated = [
        replace(each, x_world=each.x_world + more, sigma_x=0.0 * more + TRACKER.sigma_x) for each, more in zip(made, off, strict=True)
    ]
    assert explained(stated).campaign.kind.slow is None


def pushed(rng: np.random.Generator, rows: int) -> Array:
    """Places (n, 3) m by a force that changes smoothly during a flight: a cubic in time, of two metres per second squared or so."""
    t = np.linspace(-1.0, 1.0, 10 * rows)
    force = legendre.legvander(t, 3) @ rng.normal(0.0, 2.0, (4, 3))
    step = 0.1 / RATE_HZ
    return np.asarray(np.cumsum(step * np.cumsum(step * force, axis=0), axis=0)[::10])


def test_a_smooth_force_of_every_flight_is_unknown_and_no_error_of_the_tracker() -> None:
    made, _ = flights(3)
    rng = np.random.default_rng(6)
    found = explained([replace(each, x_world=each.x_world + pushed(rng, TRACKER.rows)) for each in made])
    assert found.left is not None
    assert found.left.present
    assert found.campaign.kind.slow is None


def test_they_are_told_with_the_flights_in_which_they_are_largest() -> None:
    found = beside_slow_errors(3)
    (sentence,) = [each for each in scattered(found) if "wander" in each]
    _, off = flights(3)
    sizes = [float(np.linalg.norm(detrend(each, axis=0))) for each in off]
    assert f"ball_{int(np.argmax(sizes))}" in sentence


def test_a_campaign_s_document_has_all_but_their_amplitudes() -> None:
    """Which are eighteen numbers of every flight: 80 of 94 MB of sixty tosses."""
    found = beside_slow_errors(3)
    content = campaign_content(found.campaign, found.fit, campaign_covariance(found.campaign, found.fit), ())
    assert content["parameters"] == ["quadratic_drag.per_length"]
    assert {len(each["rows"]) for each in content["sequences"]} == {22}
    assert max(row for each in content["sequences"] for row in each["rows"]) == len(content["covariance"]) - 1
