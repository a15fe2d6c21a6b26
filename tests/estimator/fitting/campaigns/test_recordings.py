"""What flights of one recording share, and what each has for itself."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from datasets.vocabulary.effects import Scope
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.fitting.campaigns.campaign import Campaign, _own_shares, layout_of
from estimator.fitting.campaigns.held_out import _parts

MODEL = Model((MODELS["uniform_acceleration"], MODELS["unmeasured_lift"], MODELS["quadratic_drag"]))
PUSH, LIFT, DRAG = (MODEL.layout.columns([key]) for key in MODEL.keys)


def campaign(*recording: str) -> Campaign:
    nothing: Any = None
    sequences = tuple(SimpleNamespace(name=f"flight {k}") for k in range(4))
    return Campaign(sequences, (0,) * 4, (0,) * 4, 0.0, 0.0, nothing, recording=recording)


def test_flights_of_a_recording_share_its_values_and_have_states_of_their_own() -> None:
    place = layout_of(campaign("a", "a", "b", "c"), MODEL).places
    parts = (np.arange(12), PUSH, LIFT, DRAG)
    same = [[set(place[i][columns]) == set(place[j][columns]) for columns in parts] for i, j in ((0, 1), (1, 2))]
    assert same == [[False, True, False, True], [False, False, False, True]]


def test_every_sequence_being_a_recording_changes_nothing() -> None:
    said, silent = (layout_of(campaign(*names), MODEL) for names in (("a", "b", "c", "d"), ()))
    np.testing.assert_array_equal(said.local, silent.local)
    np.testing.assert_array_equal(said.places, silent.places)
    assert set(PUSH) <= set(silent.local)


@pytest.mark.parametrize(("recording", "shares"), [((), [1.0, 1.0, 0.0]), (("a", "a", "b", "c"), [0.5, 1.0, 0.0])])
def test_flights_divide_the_prior_of_their_recording(recording: tuple[str, ...], shares: list[float]) -> None:
    np.testing.assert_allclose(_own_shares(campaign(*recording), 0, MODEL), shares)


def test_flights_of_a_recording_are_judged_together_unless_there_is_no_other() -> None:
    assert [part.tolist() for part in _parts(campaign("a", "a", "b", "b"))] == [[0, 1], [2, 3]]
    assert [part.tolist() for part in _parts(campaign("a", "a", "a", "a"))] == [[0], [1], [2], [3]]
    assert [part.tolist() for part in _parts(campaign())] == [[0], [1], [2], [3]]


def test_a_part_keeps_the_names_of_recordings() -> None:
    some = campaign("a", "a", "b", "c").part([1, 3])
    assert some.recordings == ("a", "c")
    assert some.sharing(Scope.RECORDING) == (0, 1)
    assert campaign().part([2]).recordings == ("flight 2",)
