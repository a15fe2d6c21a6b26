"""Imagined sequences of outline samples are like recorded ones, and say what would distinguish effects."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from estimator.diagnosis.score_tests import Candidates, score_tests
from estimator.diagnosis.separation import separations
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.campaign import SequenceEquations, sequence_equations
from estimator.measurements.outlines.imagined import SampledPictures
from estimator.measurements.outlines.task import OutlineTask
from estimator.measurements.silhouettes.imagined import rows_of
from estimator.motion.flight import N_PARAMETERS
from tests.estimator.measurements.outlines.sampled_campaign import fitted, registered

FEW = 10


@cache
def likeness() -> SampledPictures:
    found = registered()
    like = found.campaign.kind.imagination(found.campaign, 0, fitted(), found.particles)
    assert isinstance(like, SampledPictures)
    return like


@cache
def imagined() -> OutlineTask:
    made = likeness().imagined(likeness().recorded)
    return likeness().thinned(made.sequence, FEW)[0]


def equations_of(sequence: OutlineTask) -> SequenceEquations:
    campaign, fit = registered().campaign, fitted()
    alone = replace(campaign, sequences=(sequence,), particle=(0,), camera=(0,))
    state = replace(fit.state, flights=fit.state.flights[:1], theta=fit.state.theta[:1])
    return sequence_equations(alone, 0, state, fit.model)


def test_the_imagined_drop_says_as_much_as_the_recorded_one() -> None:
    recorded, times = likeness().thinned(registered().campaign.sequences[0], FEW)
    assert times == 3.0
    made, real = equations_of(imagined()), equations_of(recorded)
    ratio = np.diag(made.frames.H)[:12] / np.diag(real.frames.H)[:12]
    assert np.all((0.8 < ratio) & (ratio < 1.25)), ratio


def test_its_samples_lie_where_the_fit_has_them() -> None:
    assert np.abs(equations_of(imagined()).errors.e).max() < 1e-6


def test_fewer_sightings_have_the_residuals_that_they_had() -> None:
    whole = registered().campaign.sequences[0]
    few, _ = likeness().thinned(whole, FEW)
    rows = [int(np.argmin(np.abs(whole.task.sightings.times_s - t))) for t in few.task.sightings.times_s]
    np.testing.assert_allclose(equations_of(few).errors.e, equations_of(whole).errors.e[rows], atol=1e-3)


@pytest.mark.parametrize("most", [FEW, 20, 60])
def test_sightings_that_stand_for_all_are_there_once(most: int) -> None:
    for n in range(1, 4 * most):
        rows = rows_of(n, most)
        assert np.all(np.diff(rows) > 0)
        assert 0.65 * min(n, most) <= len(rows) <= most
        assert 0 <= rows[0] <= rows[-1] < n


def test_some_sightings_have_all_their_samples_and_their_own_blur_of_edges() -> None:
    """Of 30, too, of which most that stand for them are neighbours; pictures have a blur for each sighting."""
    whole = registered().campaign.sequences[0]
    n = len(whole.task.sightings)
    blurred = replace(whole, setting=replace(whole.setting, edge_px=np.linspace(0.5, 1.5, n)))
    few, times = likeness().thinned(blurred, 20)
    assert len(few.contacts.sighting) == sum(map(len, few.task.sightings.outlines_px))
    assert times == n / len(few.task.sightings)
    rows = np.searchsorted(whole.task.sightings.frame, few.task.sightings.frame)
    np.testing.assert_array_equal(few.setting.edge_px, np.linspace(0.5, 1.5, n)[rows])
    assert whole.take(rows).setting.edge_px == whole.setting.edge_px == 0.0


def test_more_views_halve_the_variance_of_the_surface() -> None:
    """Its moves and what they do to mass properties are smaller, its best value stays."""
    whole = registered().campaign.sequences[0]
    more, best = likeness().more_views(whole, registered().particles[0]), whole.contacts.amplitude
    now, before = (fitted().model.body(best, each.setting) for each in (more, whole))
    np.testing.assert_allclose(now.com, before.com, atol=1e-12)
    np.testing.assert_allclose(now.inertia, before.inertia, atol=1e-9)
    smaller, moves = (equations_of(each).errors.J[..., N_PARAMETERS:] for each in (more, whole))
    np.testing.assert_allclose(smaller, np.sqrt(0.5) * moves, atol=1e-5 * np.abs(moves).max())


PAIRS = (("linear_drag", "gravity"), ("outline_offset", "view_outline_offset"))


@cache
def apart() -> tuple[dict[str, float], ...]:
    """Expected differences of pairs of effects, now and by what would change them."""
    effects = [catalogue()[key] for pair in PAIRS for key in pair]
    tests, _ = score_tests(registered().campaign, fitted(), Candidates.of(registered().campaign, effects))
    sized = [replace(t, theta=20.0 * np.sqrt(np.diag(t.covariance))) for t in tests]
    found = separations(registered(), fitted(), sized, PAIRS, margin=3.0)
    return tuple({"now": s.now.difference, **{p.key: p.expected.difference for p in s.prospects}} for (s,) in found)


def test_designs_are_offered() -> None:
    drag = apart()[0]
    assert {"now", "longer", "another", "second_camera", "nearer"} <= set(drag)
    assert drag["longer"] > drag["now"]


def test_only_a_nearer_flight_tells_outlines_of_pictures_from_those_of_views() -> None:
    offsets = apart()[1]
    assert offsets["now"] < 3.0
    assert offsets["nearer"] > 3.0
    assert offsets["views"] == pytest.approx(offsets["now"], abs=1.0)
