"""A fit of the effect's reduced model to nature's exact outlines finds the effect's sizes again, the flight being free.

A few Gauss-Newton steps of the chain's own derivatives, from no effect and the true state of the first frame; so they also say that these
derivatives lead there. Sizes are found to the share of them that the reduced model leaves out.
"""

import numpy as np
import pytest

from datasets.vocabulary.effects import PICTURED
from estimator.appearance.model_errors import ModelErrors, model_errors
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.motion.flight import COM, N_PARAMETERS, moved
from tests.agreement.exact_sequences import made, task_of, theta_of, true_flight
from tests.agreement.sizes import SIZES

STEPS = 8
EXACT = 5e-3
REDUCED = {"motion_blur_threshold": 0.06, "rolling_shutter": 0.03, "blooming": 0.02, "rim_light_leak": 0.06, "defocus_growth": 0.1}


def solved(key: str) -> np.ndarray:
    """Parameters found; what is searched for elsewhere begins, and stays, at its place."""
    sequence, model = made(key, SIZES[key]), MODELS[key]
    entry = model.entry
    searched = {name: v if name not in entry.sizes else 0.0 for name, v in SIZES[key].items()}
    flight, theta = true_flight(sequence, 0.0), theta_of(key, searched)
    free = np.array([name in entry.sizes for name in entry.names])
    columns = np.concatenate([np.arange(COM.start), N_PARAMETERS + np.flatnonzero(free)])
    guessed = not np.array_equal(model.slope_at(theta), theta)
    for _ in range(STEPS):
        step = least_squares_step(model_errors(task_of(sequence), flight, Model((model,)), theta), columns)
        whole = np.zeros(N_PARAMETERS)
        whole[: COM.start] = step[: COM.start]
        flight = moved(flight, whole)
        theta[free] += step[COM.start :]
        theta, guessed = (model.first_guess(theta), False) if guessed else (theta, False)
    return theta


def least_squares_step(errors: ModelErrors, columns: np.ndarray) -> np.ndarray:
    J = errors.J[errors.seen][:, columns]
    size = np.linalg.norm(J, axis=0)
    return -np.linalg.lstsq(J / size, errors.e[errors.seen], rcond=1e-10)[0] / size


@pytest.mark.parametrize("key", [key for key in PICTURED if key != "trigger_jitter"])
def test_sizes_are_found_again(key: str) -> None:
    np.testing.assert_allclose(solved(key), theta_of(key, SIZES[key]), rtol=REDUCED.get(key, EXACT))
