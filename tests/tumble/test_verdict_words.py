"""The verdict does not say of an effect both that it is what is in the model by another name and that it is too little seen."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimator.diagnosis.diagnose import Diagnosis
from estimator.diagnosis.noise_floor import LAGS, NoiseFloor
from estimator.measurements.trajectories.kind import TRAJECTORIES
from tumble.campaigning import Prepared
from tumble.diagnosing import _below, _beyond_noise
from tumble.reports import verdict
from tumble.reports.verdict import RECORD_MORE, TOO_SHORT, Verdict, verdict_of


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


def test_what_is_hidden_by_the_model_is_not_said_to_lack_data(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lengths show in falling things until gravity is in the model."""
    monkeypatch.setattr(verdict, "blind_to", lambda _diagnosis: ("length_scale", "steady_wind"))
    monkeypatch.setattr(verdict, "says_nothing", lambda _diagnosis: False)
    told = verdict_of(cast(Diagnosis, Nothing()), seen=("length_scale",))
    assert told.remarks == (
        "Too little data for these, however large within reason: steady wind.",
        "These data cannot show these beside what is in the model, however large within reason: length scale.",
    )


def test_the_floor_is_no_higher_than_beside_what_is_unknown() -> None:
    nan = float("nan")
    numbers = np.zeros(0)
    floor = NoiseFloor(0.9, 0.8, 1.0, 0.8, False, 1.27, (1.1, 1.4), 1.0, numbers, LAGS, numbers, (0.0, 0.1), nan, nan)
    assert _below(floor, None) == floor
    assert _below(floor, {"floor_px": 0.9}).floor_px == 0.8
    lower = _below(floor, {"floor_px": 0.4})
    assert (lower.floor_px, lower.repeated_px, lower.reduced) == pytest.approx((0.4, 0.4, 4 * 1.27))
    assert lower.interval == pytest.approx((4.4, 5.6))


def test_what_is_beyond_noise_is_not_called_nothing() -> None:
    """Residuals of a stated noise that no effect of the catalogue is behind: a wobble that dies away, and its like."""
    nan, numbers = float("nan"), np.zeros(0)
    floor = NoiseFloor(1.0, 0.2, 1.0, 0.2, False, 25.0, (17.0, 37.0), 1.0, numbers, LAGS, numbers, (0.0, 0.1), nan, nan)
    quiet = NoiseFloor(1.0, 0.9, 1.0, 0.9, False, 1.1, (0.8, 1.4), 1.0, numbers, LAGS, numbers, (0.0, 0.1), nan, nan)
    registered = SimpleNamespace(campaign=SimpleNamespace(kind=TRAJECTORIES))
    campaign = cast(Prepared, SimpleNamespace(registered=registered, observations={}, shape_stated=False))
    at, nothing = (1.0, 0.05), Verdict("nothing missing", "Nothing is missing (probability 93.1%).", ("a remark",), ())
    assert _beyond_noise(nothing, quiet, campaign, at) is nothing
    told = _beyond_noise(nothing, floor, campaign, at)
    assert told.sentence == "There is something to explain, and no known effect does."
    assert told.remarks[0].endswith("There is something to explain: about 0.98 times the noise, alike in neighbouring rows or frames.")
    short = _beyond_noise(Verdict("says nothing", f"{TOO_SHORT}: 3 of 4.", ("a remark", RECORD_MORE), ()), floor, campaign, at)
    assert (short.kind, short.sentence) == ("says nothing", "The model misses something, and beside that nothing can be said: 3 of 4.")
    assert [remark[:5] for remark in short.remarks] == ["The r", "Check", "a rem"]
    unknown = Verdict("found", "Explained with drag. Something is missing that no effect of the catalogue explains.", (), ("linear_drag",))
    assert _beyond_noise(unknown, floor, campaign, at) is unknown
    found = Verdict("found", "The campaign is explained with drag. Then nothing more is missing.", (), ("linear_drag",))
    assert _beyond_noise(found, quiet, campaign, at) is found
    assert _beyond_noise(found, floor, campaign, at).sentence == (
        "Part of what the campaign shows is explained with drag. Residuals are still 5.0 times the noise, and no known effect is behind "
        "it: a name may stand in for something that the catalogue lacks."
    )
