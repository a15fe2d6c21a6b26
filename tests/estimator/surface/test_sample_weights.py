"""Huber's weights of samples: bounded by the samples' own spread, and normal noise is found as large as it is."""

import numpy as np
import pytest
from scipy.sparse import csr_array

from estimator.motion.flight import N_PARAMETERS
from estimator.surface.joint import SAMPLE_HUBER, _noise_of, _weights
from estimator.surface.samples import Samples

NOISE_PX, OUTLINES, LENGTH = 0.07, 100, 120


def samples(gap: np.ndarray) -> Samples:
    starts = LENGTH * np.arange(OUTLINES + 1)
    return Samples(gap, starts, csr_array((len(gap), 3)), np.zeros((len(gap), N_PARAMETERS)))


@pytest.fixture
def gap() -> np.ndarray:
    return NOISE_PX * np.random.default_rng(6).normal(size=OUTLINES * LENGTH)


@pytest.mark.parametrize("huber", [SAMPLE_HUBER, 4.0])
def test_normal_noise_is_found_whatever_the_threshold(gap: np.ndarray, huber: float) -> None:
    group = samples(gap)
    found = _noise_of(group, gap * _weights(group, NOISE_PX, huber), 0.0, huber)
    assert found == pytest.approx(1.0, rel=0.03)


def test_a_sample_far_off_is_held_even_where_the_effective_noise_is_large(gap: np.ndarray) -> None:
    gap[5] = -10.0 * NOISE_PX
    weights = _weights(samples(gap), 3.0 * NOISE_PX, SAMPLE_HUBER)
    assert (weights[5] / weights.max()) ** 2 == pytest.approx(SAMPLE_HUBER / 10.0, rel=0.05)
