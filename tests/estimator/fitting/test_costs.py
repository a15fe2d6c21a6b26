"""Costs of two models are compared under one noise."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.measurements.silhouettes.kind import SILHOUETTES

SEQUENCE: Any = SimpleNamespace(task=SimpleNamespace(huber=4.0))


def residuals(error_px: float, sigma_px: float, *, seen: bool = True) -> Any:
    tangency = SimpleNamespace(variance=np.full((3, 5, 4), sigma_px**2))
    return SimpleNamespace(e=np.full((3, 5, 2), error_px), seen=np.full((3, 5, 2), seen), tangency=tangency)


def test_less_noise_for_the_same_errors_is_no_worse_fit() -> None:
    before, after = residuals(0.1, 0.15), residuals(0.099, 0.14)
    assert SILHOUETTES.cost(SEQUENCE, after) > SILHOUETTES.cost(SEQUENCE, before)
    assert SILHOUETTES.cost(SEQUENCE, after, before) == pytest.approx(0.99**2 * SILHOUETTES.cost(SEQUENCE, before))


def test_errors_that_were_not_seen_keep_their_own_noise() -> None:
    new = residuals(0.1, 0.14)
    assert SILHOUETTES.cost(SEQUENCE, new, residuals(9.0, 9.0, seen=False)) == SILHOUETTES.cost(SEQUENCE, new)
