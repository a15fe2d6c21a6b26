"""What further data would tell apart: the expected difference is that of drawn scores, and imagined recordings are like real ones."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimator.appearance.hull_outlines import hull_of
from estimator.diagnosis.candidate_recordings import FARTHER, RECORDINGS
from estimator.diagnosis.diagnose import diagnose
from estimator.diagnosis.imagined_sequences import Drop, counted
from estimator.diagnosis.score_tests import Candidates, ScoreTest, score_tests
from estimator.diagnosis.separation import Prospect, Separation, _present, separations
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign import sequence_equations
from estimator.measurements.silhouettes.imagined import Pictures, silhouettes_of, thinned
from estimator.measurements.silhouettes.imagined_views import with_more_views
from tests.estimator.small_campaign import fitted, registered

MARGIN = 3.0


@cache
def likeness() -> Pictures:
    found, fit = registered(), fitted()
    corners = hull_of(found.particles[0])
    return Pictures(found.campaign.sequences[0], fit.state.flights[0], corners, fit.model, fit.state.theta[0])


def recorded() -> Drop:
    return likeness().recorded


def changed(key: str) -> Drop:
    return next(c.change for c in RECORDINGS if c.key == key)(recorded())


@cache
def linear_tests() -> tuple[ScoreTest, ...]:
    """Tests of effects without a search, with sizes that no noise decides: 20 standard deviations each."""
    fit, campaign = fitted(), registered().campaign
    effects = [e for e in catalogue().values() if not e.entry.searched]
    tests, _ = score_tests(campaign, fit, Candidates.of(campaign, effects))
    return tuple(replace(t, theta=20.0 * np.sqrt(np.diag(t.covariance))) for t in tests)


@cache
def apart(first: str, second: str) -> Separation:
    (found,) = separations(registered(), fitted(), linear_tests(), [(first, second)], margin=MARGIN)[0]
    return found


def prospects(separation: Separation) -> dict[str, Prospect]:
    return {p.key: p for p in separation.prospects}


# The expected difference


def test_the_difference_is_the_log_likelihood_that_drawn_scores_lose() -> None:
    """Scores are drawn under an effect of a known size; the likelihood ratio to the best of its rival scatters as expected."""
    campaign, fit = registered().campaign, fitted()
    keys = ("linear_drag", "quadratic_drag", "gravity", "outline_offset", "frame_rate")
    tests, _ = score_tests(campaign, fit, Candidates.of(campaign, [catalogue()[k] for k in keys]))
    rng = np.random.default_rng(8)
    for true, rival, size in ((0, 1, 30.0), (1, 2, 5.0), (2, 0, 6.0)):
        sized = replace(tests[true], theta=size * np.sqrt(np.diag(tests[true].covariance) / len(tests[true].columns)))
        present = _present(registered(), fit, [sized if t is tests[true] else t for t in tests], MARGIN)
        scores, d = present.scores, present.lost(present.scores.information, present.scores.columns, (true, rival))
        signature = scores.whitener @ scores.H
        first, second = (signature[:, [i for i, c in enumerate(scores.columns) if c.effect == e]] for e in (true, rival))
        made = first @ sized.theta
        ratio = []
        for _ in range(400):
            y = made + rng.standard_normal(len(made))
            best, *_ = np.linalg.lstsq(second, made, rcond=1e-10)
            ratio.append(0.5 * (np.sum((y - second @ best) ** 2) - np.sum((y - made) ** 2)))
        assert np.mean(ratio) == pytest.approx(d, abs=4.0 * np.sqrt(2.0 * d / len(ratio)))
        assert np.std(ratio) == pytest.approx(np.sqrt(2.0 * d), rel=0.15)


def test_an_effect_is_not_told_from_itself() -> None:
    present = _present(registered(), fitted(), linear_tests(), MARGIN)
    number = present.number("linear_drag")
    assert present.lost(present.scores.information, present.scores.columns, (number, number)) == pytest.approx(0.0, abs=1e-6)


# Imagined recordings


def test_the_imagined_drop_looks_like_the_recorded_one() -> None:
    like = likeness()
    made, real = silhouettes_of(recorded(), like).task.sightings, like.sequence.task.sightings
    assert len(made) == len(real) == 30
    u = np.column_stack([np.cos(a := np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)), np.sin(a)])
    for i in range(len(real)):
        j = int(np.argmin(np.abs(made.times_s - real.times_s[i])))
        assert made.times_s[j] == pytest.approx(real.times_s[i], abs=1e-9)
        supports = [(s.points_px[s.slice_of(n)] @ u.T).max(axis=0) for s, n in ((made.silhouettes, j), (real.silhouettes, i))]
        assert np.abs(supports[0] - supports[1]).max() < 1.5


def test_the_imagined_drop_says_as_much_as_the_recorded_one() -> None:
    campaign, fit, like = registered().campaign, fitted(), likeness()
    alone = replace(campaign, sequences=(silhouettes_of(recorded(), like),), particle=(0,), camera=(0,))
    made = sequence_equations(alone, 0, replace(fit.state, flights=fit.state.flights[:1], theta=fit.state.theta[:1]), fit.model)
    ratio = np.diag(made.frames.H)[:12] / np.diag(fit.equations[0].frames.H)[:12]
    assert np.all((0.8 < ratio) & (ratio < 1.25)), ratio


def test_a_thinned_sequence_says_as_much_as_the_whole() -> None:
    campaign, fit = registered().campaign, fitted()
    few, times = thinned(campaign.sequences[0], 10)
    assert len(few.task.sightings) == 10
    assert times == 3.0
    alone = replace(campaign, sequences=(few,), particle=(0,), camera=(0,))
    part = counted(sequence_equations(alone, 0, fit.state, fit.model), times)
    ratio = np.diag(part.frames.H)[:12] / np.diag(fit.equations[0].frames.H)[:12]
    assert np.all((0.7 < ratio) & (ratio < 1.4)), ratio


def test_the_second_camera_sees_the_particle_from_the_side() -> None:
    drop = changed("second_camera")
    first, second = drop.cameras
    places = [c.R_cam_world @ drop.flight.x + c.t_cam_world for c in drop.cameras]
    assert places[1] == pytest.approx(FARTHER * places[0], abs=1e-12)
    assert first.R_cam_world[2] @ second.R_cam_world[2] == pytest.approx(0.0, abs=1e-12)
    seen = silhouettes_of(drop, likeness()).task.sightings
    assert set(seen.camera.tolist()) == {0, 1}


def test_a_released_particle_begins_along_gravity_and_is_in_the_picture() -> None:
    drop = changed("released")
    flight = drop.flight
    assert drop.known_start
    assert drop.times_s[0] == flight.time_s
    assert np.linalg.norm(np.cross(flight.v, flight.gravity_world)) < 1e-12
    assert len(silhouettes_of(drop, likeness()).task.sightings) == 30


def test_frames_outside_of_the_picture_are_no_sightings() -> None:
    drop = recorded()
    away = replace(drop, flight=replace(drop.flight, v=np.array([20.0, 0.0, 0.0])))
    assert 0 < len(silhouettes_of(away, likeness()).task.sightings) < 30


def test_more_views_are_like_those_that_there_are() -> None:
    campaign, fit, like = registered().campaign, fitted(), likeness()
    more = with_more_views(like.sequence, registered().particles[0], like.corners)
    views = more.task.views
    assert len(views.silhouettes) == 24
    middles = [views.silhouettes.points_px[views.silhouettes.slice_of(i)].mean(axis=0) for i in range(24)]
    assert np.abs(np.array(middles[:12]) - middles[12:]).max() < 60.0
    alone = replace(campaign, sequences=(more,), particle=(0,), camera=(0,))
    twice = sequence_equations(alone, 0, fit.state, fit.model).frames.H
    ratio = np.diag(twice)[:12] / np.diag(fit.equations[0].frames.H)[:12]
    assert np.all((0.8 < ratio) & (ratio < 1.6)), ratio


# What is advised


def test_scales_are_told_apart_by_a_second_camera_or_a_measurement_only() -> None:
    found = apart("frame_rate", "length_scale")
    assert found.now.difference == pytest.approx(0.0, abs=0.5)
    assert not found.now.separates
    telling = {key for key, p in prospects(found).items() if p.expected.separates}
    assert telling >= {"second_camera", "clock", "calliper"}
    assert telling <= {"second_camera", "clock", "calliper", "released"}
    assert prospects(found)["second_camera"].drops == 1


def test_measurements_of_other_quantities_are_not_offered() -> None:
    assert {k for k, p in prospects(apart("linear_drag", "quadratic_drag")).items() if not p.drops} == set()
    assert {k for k, p in prospects(apart("frame_rate", "length_scale")).items() if not p.drops} == {"clock", "calliper", "views"}
    assert {k for k, p in prospects(apart("radial_distortion", "focal_length")).items() if not p.drops} == {"target"}


def test_more_speed_tells_the_drags_apart_better_than_more_of_the_same() -> None:
    found = prospects(apart("linear_drag", "quadratic_drag"))
    same = replace(found["another"], drops=found["faster"].drops)
    assert found["faster"].expected.probability >= same.expected.probability
    assert found["faster"].expected.difference > same.expected.difference or found["faster"].drops < found["another"].drops


def test_random_effects_and_single_ones_have_no_pairs() -> None:
    tests = diagnose(registered().campaign, fitted(), {k: catalogue()[k] for k in ("trigger_jitter", "gravity")}).findings
    every = [f.test for f in tests]
    assert separations(registered(), fitted(), every, [("gravity", "trigger_jitter")], margin=MARGIN) == [()]
    assert separations(registered(), fitted(), every, [("gravity",)], margin=MARGIN) == [()]
