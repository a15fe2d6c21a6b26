"""The verdict does not say of an effect both that it is what is in the model by another name and that it is too little seen."""

from typing import Any, cast

import numpy as np
import pytest

from estimator.diagnosis.diagnose import Diagnosis
from estimator.diagnosis.noise_floor import LAGS, NoiseFloor
from tumble.diagnosing import _below
from tumble.reports import verdict
from tumble.reports.verdict import Verdict, verdict_of


class Nothing:
    """A diagnosis that finds nothing missing."""

    findings: tuple[Any, ...] = (None,) * 9
    missing: tuple[str, ...] = ()
    superfluous: tuple[str, ...] = ()
    probability = 0.99


@pytest.mark.parametrize(("named", "left"), [((), "length scale, steady wind"), (("frame_rate", "length_scale"), "steady wind")])
def test_another_name_of_what_is_in_the_model_is_not_too_little_seen(
    named: tuple[str, ...], left: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(verdict, "blind_to", lambda _diagnosis: ("length_scale", "steady_wind"))
    monkeypatch.setattr(verdict, "says_nothing", lambda _diagnosis: False)
    told: Verdict = verdict_of(cast(Diagnosis, Nothing()), named=named)
    assert told.remarks == (f"Too little data for these, however large within reason: {left}.",)


def test_the_floor_is_no_higher_than_beside_what_is_unknown() -> None:
    nan = float("nan")
    numbers = np.zeros(0)
    floor = NoiseFloor(0.9, 0.8, 1.0, 0.8, False, 1.27, (1.1, 1.4), 1.0, numbers, LAGS, numbers, (0.0, 0.1), nan, nan)
    assert _below(floor, None) == floor
    assert _below(floor, {"floor_px": 0.9}).floor_px == 0.8
    lower = _below(floor, {"floor_px": 0.4})
    assert (lower.floor_px, lower.repeated_px, lower.reduced) == pytest.approx((0.4, 0.4, 4 * 1.27))
    assert lower.interval == pytest.approx((4.4, 5.6))
