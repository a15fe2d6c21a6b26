"""Advice for trajectories: the same candidates without those that need a camera."""

import numpy as np
import pytest

from datasets.trajectory import Surroundings, Trajectory
from datasets.vocabulary.body import Body
from estimator.diagnosis.score_tests import Candidates, score_tests
from estimator.diagnosis.separation import separations
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.base_model import base_fit
from estimator.measurements.trajectories.imagined import Tracks
from estimator.measurements.trajectories.registering import register_trajectories

SIGMA_M, ROWS, INTERVAL_S = 5e-4, 60, 0.01
BODY = Body(com_particle=np.zeros(3), R_particle_body=np.eye(3), inertia_ratios=np.array([0.6, 0.8, 1.0]))
GRAVITY = np.array([0.0, 9.81, 0.0])


def toss(number: int, *, rate: float) -> Trajectory:
    """A toss filmed at (1 + ``rate``) times the frame rate that its time stamps say."""
    rng = np.random.default_rng([number, 7])
    stamps = INTERVAL_S * np.arange(ROWS)
    times = (stamps / (1.0 + rate))[:, None]
    v = np.array([rng.uniform(1.0, 2.0), -2.5, rng.uniform(-0.5, 0.5)])
    x = v * times + 0.5 * GRAVITY * times**2 + SIGMA_M * rng.standard_normal((ROWS, 3))
    known = Surroundings(GRAVITY, BODY, sigma_x_m=SIGMA_M)
    return Trajectory(f"toss-{number}", stamps, x, None, None, None, None, None, known)


def test_scales_need_a_known_start_or_a_measurement_and_no_camera_is_offered() -> None:
    found = register_trajectories([toss(i, rate=0.03) for i in range(3)])
    fit = base_fit(found.campaign, found.start)
    effects = [catalogue()[k] for k in ("frame_rate", "length_scale", "linear_drag", "quadratic_drag", "gravity")]
    tests, _ = score_tests(found.campaign, fit, Candidates.of(found.campaign, effects))
    (scales,) = separations(found, fit, tests, [("frame_rate", "length_scale")], margin=3.0)[0]
    assert not scales.now.separates
    told = {p.key: p.expected for p in scales.prospects}
    assert set(told) == {
        "another",
        "longer",
        "faster",
        "slower",
        "opposite",
        "spinning",
        "calm",
        "other_attitude",
        "released",
        "clock",
        "calliper",
    }
    assert {key for key, expected in told.items() if expected.separates} == {"released", "clock", "calliper"}


def test_an_imagined_toss_is_where_the_flight_is() -> None:
    found = register_trajectories([toss(0, rate=0.0)])
    fit = base_fit(found.campaign, found.start)
    tracks = Tracks(found.campaign.sequences[0], fit.state.flights[0], fit.model, fit.state.theta[0])
    made = tracks.imagined(tracks.recorded).sequence
    real = found.campaign.sequences[0]
    later = made.times_s[:, None] - real.times_s
    i, j = np.nonzero(np.abs(later) < 1e-9)
    assert len(i) >= ROWS - 1
    assert np.std(made.x_world[i] - real.x_world[j]) == pytest.approx(SIGMA_M, rel=0.2)
    assert made.R_world_body is None
    assert made.omega_world is None
