"""Tables of outlines follow the flight, and only where it has left the one they were made at."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from estimator.appearance.outline_tables import with_tables
from estimator.effects.model import Model
from estimator.fitting.campaigns import following as module
from estimator.fitting.campaigns.following import POOR, ROUNDS, following
from estimator.motion.flight import N_PARAMETERS, OMEGA, moved
from tests.estimator.small_campaign import fitted, registered

NOTHING = np.zeros(0)


def spun_up(relative: float) -> np.ndarray:
    """A step of a flight that spins it up by so much."""
    step = np.zeros(N_PARAMETERS)
    step[OMEGA] = relative * registered().start.flights[0].omega
    return step


def test_tables_stay_where_the_flight_has_hardly_moved() -> None:
    sequence, flight = registered().campaign.sequences[0], registered().start.flights[0]
    assert with_tables(sequence, flight, Model(), NOTHING) is sequence
    assert with_tables(sequence, moved(flight, spun_up(1e-3)), Model(), NOTHING) is sequence


def test_tables_of_another_flight_are_those_made_there_at_once() -> None:
    """And back again: what the tables are does not depend on where they were before."""
    sequence, flight = registered().campaign.sequences[0], registered().start.flights[0]
    away = with_tables(sequence, moved(flight, spun_up(0.1)), Model(), NOTHING)
    assert away is not sequence
    assert not np.allclose(away.shape.recession, sequence.shape.recession)
    assert sequence.task.bias is not None
    assert away.task.bias is not None
    assert not np.allclose(away.task.bias.own, sequence.task.bias.own)
    back = with_tables(away, flight, Model(), NOTHING)
    np.testing.assert_array_equal(back.shape.recession, sequence.shape.recession)
    np.testing.assert_array_equal(back.shape.smear, sequence.shape.smear)
    assert back.task.bias is not None
    np.testing.assert_array_equal(back.task.bias.own, sequence.task.bias.own)


def test_a_sequence_without_a_maker_stays_as_it_is() -> None:
    sequence, flight = replace(registered().campaign.sequences[0], tables=None), registered().start.flights[0]
    assert with_tables(sequence, moved(flight, spun_up(0.1)), Model(), NOTHING) is sequence


def test_a_campaign_follows_a_fit_that_has_left_its_tables() -> None:
    campaign, fit = registered().campaign, fitted()
    assert following(campaign, fit)[0] is campaign
    elsewhere = registered().start.flights
    stale = tuple(
        with_tables(sequence, moved(flight, spun_up(0.1)), Model(), NOTHING)
        for sequence, flight in zip(campaign.sequences, elsewhere, strict=True)
    )
    followed, new = following(replace(campaign, sequences=stale), fit)
    for one, other in zip(followed.sequences, campaign.sequences, strict=True):
        np.testing.assert_allclose(one.made_at, other.made_at, atol=0.01)
    np.testing.assert_allclose(new.state.flights[0].omega, fit.state.flights[0].omega, atol=0.2)


@pytest.mark.parametrize(("mean_square", "rounds"), [(0.5 * POOR, ROUNDS), (2.0 * POOR, 1)])
def test_a_poor_fit_is_followed_once(mean_square: float, rounds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """What it misses outweighs what tables can be wrong by."""
    fit = replace(fitted(), equations=tuple(_with_mean_square(e, mean_square) for e in fitted().equations))
    campaign: Any = replace(registered().campaign, kind=SimpleNamespace(followed=lambda sequence, *_: replace(sequence)))
    refits = []
    monkeypatch.setattr(module, "fit_campaign", lambda *_: refits.append(1) or fit)
    following(campaign, fit)
    assert len(refits) == rounds


def _with_mean_square(equations: Any, mean_square: float) -> Any:
    return replace(equations, frames=replace(equations.frames, chi2=mean_square * equations.frames.count))
