"""Held-out errors judge by everything that is known without the frame, and by no more than that."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.diagnosis.adding import with_effect
from estimator.diagnosis.diagnose import ALPHA
from estimator.diagnosis.score_tests import Candidates, score_tests
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns import held_out as module
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.held_out import HeldOut, held_out
from estimator.fitting.campaigns.registered import Registered
from estimator.fitting.campaigns.wald import wald_p
from estimator.measurements.trajectories.registering import register_trajectories
from tests.estimator.made_trajectories import Hidden, Tracker, measured

OFF_CENTRE = Hidden(com=(0.02, 0.0, -0.015))


def of_spins(*spins_rads: float) -> Registered:
    """A thing whose centre of mass lies beside the tracked point, tossed with these spins."""
    rng = np.random.default_rng(0)
    return register_trajectories(
        [measured(f"toss_{i}", rng, replace(OFF_CENTRE, spin_rads=spin), Tracker(rows=40)) for i, spin in enumerate(spins_rads)]
    )


def before_and_after(registered: Registered, effect: str) -> tuple[np.ndarray, np.ndarray]:
    """Held-out errors per sequence of free flight, and with one effect more."""
    campaign = registered.campaign
    base = base_fit(campaign, registered.start)
    campaign, fit = with_effect(campaign, base, catalogue()[effect])
    return tuple(held_out(campaign, f.state, f.model).per_sequence_px for f in (base, fit))  # type: ignore[return-value]


def test_an_effect_that_one_sequence_alone_shows_lowers_its_errors() -> None:
    """Without a spin there is nothing to tell where the centre of mass is: the other says nothing of it."""
    before, after = before_and_after(of_spins(8.0, 1e-3), "centre_of_mass")
    assert after[0] < 0.2 * before[0]


def test_what_others_tell_of_an_effect_is_used() -> None:
    before, after = before_and_after(of_spins(8.0, 8.0, 8.0, 8.0), "centre_of_mass")
    assert np.all(after < 1.2)
    assert np.mean(before) > 2.0


def test_an_effect_that_is_not_there_lowers_nothing() -> None:
    before, after = before_and_after(of_spins(8.0, 1e-3), "quadratic_drag")
    assert np.all(after > 0.97 * before)


def of_two_bodies() -> Registered:
    """Bodies in turn: of the first the point that is followed is the centre of mass, of the second it is not."""
    rng = np.random.default_rng(3)
    bodies = (Hidden(spin_rads=8.0), replace(OFF_CENTRE, spin_rads=8.0))
    registered = register_trajectories([measured(f"toss_{i}", rng, bodies[i % 2], Tracker(rows=40)) for i in range(4)])
    return replace(registered, campaign=replace(registered.campaign, particle=(0, 1, 0, 1)))


def test_every_body_is_judged_by_what_is_known_of_itself() -> None:
    registered = of_two_bodies()
    before, after = before_and_after(registered, "centre_of_mass")
    assert np.all(after < 1.3)
    assert np.all(before[1::2] > 2.0)


def test_what_one_of_two_bodies_has_is_no_superfluous_effect() -> None:
    registered = of_two_bodies()
    campaign = registered.campaign
    campaign, fit = with_effect(campaign, base_fit(campaign, registered.start), catalogue()["centre_of_mass"])
    assert [np.linalg.norm(theta) > 0.01 for theta in fit.state.theta] == [False, True, False, True]
    assert wald_p(campaign, fit, campaign_covariance(campaign, fit), 0) < 1e-9
    tests, _ = score_tests(campaign, base_fit(campaign, registered.start), Candidates.of(campaign, (catalogue()["centre_of_mass"],)))
    assert sorted({column.sequence for column in tests[0].columns}) == [0, 1]


def test_a_model_under_which_nothing_can_be_predicted_has_an_infinite_error(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither a flight that runs away nor a matrix without eigenvalues ends the work on a campaign."""
    registered = of_spins(8.0, 8.0)
    base = base_fit(registered.campaign, registered.start)

    def fails(*_: object, **__: object) -> None:
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    for name in ("_settled", "fit_campaign"):
        with monkeypatch.context() as patch:
            patch.setattr(module, name, fails)
            judged = held_out(registered.campaign, base.state, base.model)
        assert np.all(np.isinf(judged.per_sequence_px))
        assert np.isinf(judged.rms_px)


ROWS, CHANNELS = 40, 6


def _noise(*scales: float, seed: int = 1) -> list[np.ndarray]:
    """Errors (ROWS, CHANNELS) of sequences, so many times as large as noise."""
    rng = np.random.default_rng(seed)
    return [scale * rng.normal(size=(ROWS, CHANNELS)) for scale in scales]


def _judged(errors: list[np.ndarray]) -> HeldOut:
    return HeldOut(tuple(np.sum(e**2, axis=1) for e in errors), tuple(np.full(len(e), float(CHANNELS)) for e in errors))


def _off(errors: list[np.ndarray], *off: float) -> HeldOut:
    """The errors of predictions that are off by so much more in every sequence, slowly changing."""
    slow = np.sin(np.linspace(0.0, 3.0, ROWS))[:, None] * np.ones(CHANNELS)
    return _judged([e + by * slow for e, by in zip(errors, off, strict=True)])


def test_a_model_that_is_ruined_in_one_sequence_is_not_as_good() -> None:
    """Though it is better in all others, and better or worse by chance alone as far as scatter between sequences says."""
    noise = _noise(1.0, 1.0, 1.0, 1.0)
    other = _off(noise, 0.2, 0.2, 0.2, 0.2)
    assert _off(noise, 0.0, 0.0, 0.0, 0.0).worse_by_chance(other) >= ALPHA
    assert _off(noise, 0.0, 0.0, 0.0, 2.0).worse_by_chance(other) < ALPHA
    assert _off([*noise, *noise, *noise], *[0.1] * 11, 0.8).worse_by_chance(_off([*noise, *noise, *noise], *[0.2] * 12)) < ALPHA


def test_a_model_that_is_a_little_worse_everywhere_is_not_as_good() -> None:
    noise = _noise(*[1.0] * 8)
    assert _off(noise, *[0.3] * 8).worse_by_chance(_off(noise, *[0.0] * 8)) < ALPHA


def test_a_model_that_is_worse_by_chance_alone_is_as_good() -> None:
    """Both predict what happens but for errors of their own, a tenth of the noise; one of ten sequences is the worst by chance."""
    kept = 0
    for seed in range(100):
        noise, mine, others = (_noise(*[scale] * 10, seed=10 * seed + i) for i, scale in enumerate((1.0, 0.1, 0.1)))
        one, other = (_judged([e + own for e, own in zip(noise, each, strict=True)]) for each in (mine, others))
        kept += one.worse_by_chance(other) >= ALPHA
    assert kept >= 97


def test_of_one_sequence_its_rows_say_what_is_chance() -> None:
    noise = _noise(1.0)
    other = _judged(noise)
    assert _off(noise, 1.0).worse_by_chance(other) < ALPHA
    assert other.worse_by_chance(other) >= ALPHA


def test_a_flight_that_runs_away_in_one_model_alone_is_worse_there() -> None:
    both = _judged(_noise(1.0, 1.0))
    gone = replace(both, squares=(np.full(ROWS, np.inf), both.squares[1]))
    assert gone.worse_by_chance(both) < ALPHA
    assert both.worse_by_chance(gone) >= ALPHA
    assert gone.worse_by_chance(gone) >= ALPHA
