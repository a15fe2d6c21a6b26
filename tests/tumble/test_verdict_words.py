"""The verdict does not say of an effect both that it is what is in the model by another name and that it is too little seen."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from estimator.diagnosis.diagnose import Diagnosis
from estimator.diagnosis.noise_floor import LAGS, NoiseFloor
from estimator.measurements.trajectories.kind import TRAJECTORIES
from tests.estimator.made_trajectories import GRAVITY, Hidden, Tracker
from tests.estimator.made_trajectories import campaign as made_up
from tumble.campaigning import Prepared
from tumble.cli.campaign_options import _floor_sentence, _raised
from tumble.diagnosing import _below, _beyond_noise
from tumble.implausible import fall_words
from tumble.reports import verdict
from tumble.reports.noise_floor_words import floor_sentence
from tumble.reports.verdict import RECORD_MORE, TOO_SHORT, Verdict, likely_more, verdict_of


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
    likely = Verdict("judged", "Nothing is established. Suspected, though not established: spin damping.", (), ())
    assert _beyond_noise(likely, floor, campaign, at).sentence == (
        "There is something to explain, and no known effect is established for it. Suspected, though not established: spin damping."
    )
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


def test_one_candidate_is_suspected() -> None:
    one = SimpleNamespace(key="spin_damping", probability=0.497)
    none, other = SimpleNamespace(key="gravity", probability=0.01), SimpleNamespace(key="magnus_lift", probability=0.3)
    told = likely_more(cast(Diagnosis, SimpleNamespace(findings=(one, none), probability=0.493)))
    assert told == "Suspected, though not established: spin damping or something in its place (50.7%)."
    told = likely_more(cast(Diagnosis, SimpleNamespace(findings=(one, other), probability=0.493)))
    assert told.endswith("and the data do not tell what: spin damping or magnus lift.")


def test_residuals_below_the_noise_are_not_called_so_many_times_it() -> None:
    nan, numbers = float("nan"), np.zeros(0)
    floor = NoiseFloor(0.87, 0.2, 1.0, 0.2, False, 19.0, (17.0, 21.0), 1.0, numbers, LAGS, numbers, (0.0, 0.1), nan, nan)
    assert floor_sentence(floor, "σ", (1.0, 0.01)).endswith(
        "There is something to explain: about 0.85 of those 0.87 is alike in neighbouring rows or frames, as noise that is new is not."
    )


def test_a_fall_that_air_may_make_says_so() -> None:
    (toss,) = made_up(8, Hidden(), Tracker(rows=30), sequences=1)
    drifting = replace(toss, x_world=toss.x_world - 0.2 * GRAVITY * toss.times_s[:, None] ** 2)
    assert next(fall_words({"toss": toss})).endswith("sequences).")
    assert next(fall_words({"toss": drifting})).endswith("Lift, drag or wind make that, too.")


def test_errors_on_what_was_not_fitted_are_told_in_words() -> None:
    def rung(added: str, rms: float) -> dict[str, Any]:
        return {"added": added, "held_out": {"rms_px": rms}}

    ladder = [rung("", 2.667), rung("stamp_scatter", 1.2467), rung("quadratic_drag", 1.2638)]
    steps = [{"added": "stamp_scatter", "established": True}, {"added": "quadratic_drag", "established": True}]
    document = {"unit": "σ", "ladder": ladder, "steps": steps, "noise_floor": {"floor_px": 1.753}}
    assert _floor_sentence(document) == (
        "Noise alone would leave 1.7530 σ, judged by how much neighbouring rows or frames differ; the last model leaves 27.9% less on what "
        "was not fitted: no more than noise, by that measure."
    )
    (told,) = _raised(document)
    assert told.startswith("Quadratic drag is in the model by the evidence of the rows that were fitted; on what was not fitted")
    assert told.endswith("the error is 1.4% larger with it.")
