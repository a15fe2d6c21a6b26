"""The verdict does not say of an effect both that it is what is in the model by another name and that it is too little seen."""

from typing import Any, cast

import pytest

from estimator.diagnosis.diagnose import Diagnosis
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
