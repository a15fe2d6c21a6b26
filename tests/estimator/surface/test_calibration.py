"""What a stated calibration adds to the uncertainty of a flight by all samples."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from datasets.estimate import Estimate
from datasets.observation import Observation
from estimator.data.configuration import Configuration
from estimator.measuring.free_flight import estimate
from estimator.surface import joint as joint_module
from synth.sequence import build_silhouette_sequence
from tests.estimator.fitting.test_calibration_share import RECIPE, larger, lens_errors

pytestmark = pytest.mark.long

SAMPLES = Configuration(surface_fit=2)
"""For there are twelve views."""
GRAVITY = np.array([1.2, 0.0, 0.0])


@pytest.fixture(scope="module", autouse=True)
def settled() -> Iterator[None]:
    """Steps are small where fits end, beside what is asked of them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_module, "SETTLED", 0.1)
        yield


@pytest.fixture(scope="module")
def seen() -> Observation:
    return build_silhouette_sequence(RECIPE, 0)[0]


@pytest.fixture(scope="module")
def plain(seen: Observation) -> Estimate:
    found = estimate(seen, SAMPLES)
    assert "surface" in found.statistics
    return found


def test_it_is_as_much_as_a_wrong_gravity_moves_the_estimate(seen: Observation, plain: Estimate) -> None:
    """At the start, where fits again end within some tenths of a standard deviation, and in the middle, where it moves next to nothing."""
    stated = estimate(replace(seen, gravity_covariance=np.outer(GRAVITY, GRAVITY)), SAMPLES)
    high, low = (estimate(replace(seen, gravity_world=seen.gravity_world + sign * GRAVITY), SAMPLES) for sign in (1.0, -1.0))
    for name in ("start", "middle"):
        with_it, without, above, below = (getattr(each, name) for each in (stated, plain, high, low))
        added = np.sqrt((with_it.covariance - without.covariance)[0, 0])
        moved = abs(above.v_world[0] - below.v_world[0]) / 2.0
        assert bool(added > 0.5 * np.sqrt(without.covariance[0, 0])) is (name == "start")
        assert added == pytest.approx(moved, abs=0.4 * np.sqrt(without.covariance[0, 0]))


def test_a_lens_that_is_not_known_widens_what_it_moves_most(seen: Observation, plain: Estimate) -> None:
    error = lens_errors(seen)
    stated = estimate(replace(seen, cameras=(replace(seen.cameras[0], lens_covariance=np.outer(error, error)),)), SAMPLES)
    assert stated.start is not None
    assert plain.start is not None
    np.testing.assert_array_equal(stated.values, plain.values)
    added = np.sqrt(np.diag(stated.start.covariance - plain.start.covariance))
    assert added[1] > 2.0 * added[0]
    assert added[1] > 1.5 * np.sqrt(plain.start.covariance[1, 1])


def test_it_is_as_much_as_a_larger_particle_moves_the_estimate(seen: Observation, plain: Estimate) -> None:
    sigma = 0.02
    stated = estimate(replace(seen, sigma_length_scale=sigma), SAMPLES)
    high, low = (estimate(larger(seen, 1.0 + sign * sigma), SAMPLES) for sign in (1.0, -1.0))
    assert stated.middle is not None
    assert plain.middle is not None
    assert high.middle is not None
    assert low.middle is not None
    added = np.sqrt(np.diag(stated.middle.covariance - plain.middle.covariance)[:3])
    moved = np.abs(high.middle.v_world - low.middle.v_world) / 2.0
    noise = np.sqrt(np.diag(plain.middle.covariance)[:3])
    assert np.any(moved > 5.0 * noise)
    np.testing.assert_allclose(added, moved, atol=0.4 * noise.max(), rtol=0.05)
