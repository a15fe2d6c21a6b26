"""The scale of what a surface is off by: found where the data tell it, one where they do not; motions are as sure as it lets them."""

import numpy as np
import pytest

from estimator.surface import surface_scale
from estimator.surface.arrow import Eliminated, Noise, Whole, eliminated, weighed
from estimator.surface.evenness import believed
from estimator.surface.samples import Samples
from estimator.surface.star_surface import Surface, sphere
from estimator.surface.surface_scale import scale_of, scaled_step
from tests.estimator.surface.made_samples import by_corner

MOTIONS = 4


@pytest.mark.parametrize("scale", [1.0, 3.0])
def test_the_scale_of_amplitudes_is_found(scale: float) -> None:
    found = []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        information = np.diag(10.0 ** rng.uniform(-2, 2, size=150))
        pull = information @ (scale * rng.normal(size=150)) + np.sqrt(information) @ rng.normal(size=150)
        found.append(scale_of(information, pull))
    assert np.mean(found) == pytest.approx(scale, rel=0.1)


def test_without_information_the_scale_is_one() -> None:
    assert scale_of(np.zeros((20, 20)), np.zeros(20)) == pytest.approx(1.0)


@pytest.fixture(scope="module")
def equations() -> tuple[Eliminated, Whole]:
    rng = np.random.default_rng(3)
    surface = Surface(sphere(2), np.zeros(3), 3e-3 * sphere(2).directions)
    n = 3 * len(surface.vertices)
    views, frames = (
        Samples(
            0.1 * rng.normal(size=300),
            np.array([0, 120, 300]),
            by_corner(surface.sphere, 300, rng),
            rng.normal(size=(300, count)),
        )
        for count in (0, MOTIONS)
    )
    whole = Whole(rng.normal(size=3), rng.normal(size=(3, MOTIONS)), 1e2 * rng.normal(size=(n, 3)))
    prior = believed(surface, 0.05)
    groups = [weighed(views, prior, Noise.white(0.2), 4.0), weighed(frames, prior, Noise.white(0.2), 4.0)]
    return eliminated(groups, prior, whole), whole


def test_a_surface_as_sure_as_it_says_gives_the_step_without_it(
    equations: tuple[Eliminated, Whole], monkeypatch: pytest.MonkeyPatch
) -> None:
    fitted, whole = equations
    known, pull = 0.3 * np.eye(MOTIONS), np.arange(1.0, 5.0)
    monkeypatch.setattr(surface_scale, "scale_of", lambda _information, _pull: 1.0)
    found = scaled_step(fitted, whole, known, pull)
    covariance = np.linalg.inv(fitted.H + known)
    np.testing.assert_allclose(found.covariance, covariance, rtol=1e-6)
    np.testing.assert_allclose(found.step, -covariance @ (fitted.g + pull), rtol=1e-6)


def test_motions_are_less_sure_where_the_surface_is(equations: tuple[Eliminated, Whole], monkeypatch: pytest.MonkeyPatch) -> None:
    fitted, whole = equations
    spread = []
    for scale in (1.0, 3.0):
        monkeypatch.setattr(surface_scale, "scale_of", lambda _information, _pull, scale=scale: scale)
        spread.append(np.diag(scaled_step(fitted, whole, 0.3 * np.eye(MOTIONS), np.zeros(MOTIONS)).covariance))
    assert np.all(spread[1] > spread[0])
