"""The columns that fits use are the derivatives of the whole chain, at the true state and size of every effect.

Central differences of the tangency errors themselves, at tangencies that stay at their vertex. The contracts in
``tests/estimator/appearance/test_effect_contracts.py`` hold every effect to 2% on smoothed outlines; on exact ones the columns are exact.
"""

import numpy as np
import pytest

from datasets.vocabulary.effects import EFFECTS, PICTURED
from estimator.appearance.model_errors import ModelErrors, model_errors
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.likelihood.time_shifts import time_derivative
from estimator.motion.flight import COM, N_PARAMETERS, STEPS, Flight, moved
from tests.agreement.exact_sequences import Array, errors_at, made, task_of, theta_of, true_flight
from tests.agreement.sizes import SIZES

AGREE = 2e-3
"""Of a column's RMS."""
AT_CORNERS = {"rolling_shutter": 2e-2}
"""Where another of the outline's points takes over within a step; elsewhere these are as good."""
FEWEST = 0.5
SMOOTH = [(key, name) for key, entry in PICTURED.items() for name in entry.names if name not in (*MODELS[key].frozen, "sigma")]
THROUGH_MOTION = [key for key in PICTURED if EFFECTS[key].stage in ("clock", "body", "dynamics")]


def errors(key: str, flight: Flight, theta: Array) -> ModelErrors:
    return model_errors(task_of(made(key, SIZES[key])), flight, Model((MODELS[key],)), theta)


def agrees(column: Array, ends: tuple[ModelErrors, ModelErrors], width: float, agree: float = AGREE) -> None:
    high, low = ends
    stays = (high.tangency.tangency == low.tangency.tangency)[:, :, :2] & high.seen & low.seen
    assert stays.mean() > FEWEST
    slope = (high.e - low.e)[stays] / width
    size = float(np.sqrt(np.mean(slope**2)))
    assert size > 0.0
    apart = np.abs(column[stays] - slope)
    assert apart.max() <= agree * size
    assert np.quantile(apart, 0.95) <= AGREE * size


@pytest.mark.parametrize(("key", "name"), SMOOTH)
def test_columns_of_an_effect(key: str, name: str) -> None:
    entry, flight, theta = EFFECTS[key], true_flight(made(key, SIZES[key]), 0.0), theta_of(key, SIZES[key])
    number = entry.names.index(name)
    step = np.zeros(len(theta))
    step[number] = 0.1 * entry.parameters[number].step
    there = errors_at(made(key, SIZES[key]), key, SIZES[key])
    ends = errors(key, flight, theta + step), errors(key, flight, theta - step)
    agrees(there.J[..., N_PARAMETERS + number], ends, 2.0 * step[number], AT_CORNERS.get(key, AGREE))


@pytest.mark.parametrize("key", THROUGH_MOTION)
def test_columns_of_the_flight_beside_an_effect(key: str) -> None:
    """All twelve at once, along one direction: each with a weight of its own."""
    flight, theta = true_flight(made(key, SIZES[key]), 0.0), theta_of(key, SIZES[key])
    step = np.zeros(N_PARAMETERS)
    step[: COM.start] = STEPS[: COM.start] * np.random.default_rng(7).normal(size=COM.start)
    there = errors_at(made(key, SIZES[key]), key, SIZES[key])
    agrees(there.J[..., :N_PARAMETERS] @ step, (errors(key, moved(flight, step), theta), errors(key, moved(flight, -step), theta)), 2.0)


def test_derivative_by_a_frames_time() -> None:
    """All frames later by a step: a gap before the first one."""
    key, step = "trigger_jitter", 1e-7
    sequence = made(key, SIZES[key])
    flight, there = true_flight(sequence, 0.0), errors_at(sequence, key, SIZES[key])
    gap = Model((MODELS["dropped_frames"],))
    interval = float(np.median(np.diff(sequence.plan.clock.times_s)))
    early, late = (model_errors(task_of(sequence), flight, gap, np.array([sign * step / interval, -1.0])) for sign in (-1.0, 1.0))
    agrees(time_derivative(there), (late, early), 2.0 * step)
