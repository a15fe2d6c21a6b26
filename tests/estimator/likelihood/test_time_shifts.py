"""Whether frames' times jitter, judged from one-step shifts of every sighting."""

from dataclasses import replace

import numpy as np
import pytest

from estimator.geometry.robust_scale import robust_sigma
from estimator.likelihood.time_shifts import (
    FAR_OFF,
    TimeShifts,
    from_neighbours,
    jitter_found_with,
    jitter_test,
    likeness,
    noise_ratio,
    without_outliers,
)

NOISE_S = 2e-6


def shifts(jitter_s: float, seed: int = 5, n: int = 200, noise_s: float = NOISE_S) -> TimeShifts:
    """Shifts on a smooth misfit ten times their noise, with errors of the measurement and jitter of their own."""
    rng = np.random.default_rng(seed)
    smooth = 10 * noise_s * np.sin(np.linspace(0.0, 3.0, n))
    return TimeShifts(smooth + rng.normal(0.0, np.hypot(noise_s, jitter_s), n), np.full(n, noise_s**-2), np.full(n, noise_s**2))


def test_a_smooth_misfit_is_no_jitter() -> None:
    assert jitter_test([shifts(0.0), shifts(0.0, 6)]).p > 0.05


def test_jitter_is_seen_through_a_smooth_misfit() -> None:
    assert jitter_test([shifts(5e-6), shifts(5e-6, 6)]).p < 1e-6


def test_slow_sequences_do_not_hide_the_jitter_that_a_fast_one_shows() -> None:
    def campaign(jitter_s: float, seed: int) -> list[TimeShifts]:
        return [shifts(jitter_s, seed, 80), *(shifts(jitter_s, seed + k, 80, noise_s=10 * NOISE_S) for k in (1, 2, 3))]

    assert np.median([jitter_test(campaign(3e-6, 10 * seed)).p for seed in range(10)]) < 1e-6
    small = [jitter_test(campaign(0.0, 10 * seed)).p for seed in range(200)]
    assert 0.01 < np.mean(np.array(small) < 0.05) < 0.1


def test_a_smooth_misfit_is_nothing_that_jitter_explains() -> None:
    """However small the jitter beside it, the misfit alone must not let it lead."""
    rng = np.random.default_rng(9)
    n, misfit = 320, 1e-3 * np.sin(np.linspace(0.0, 3.0, 320))

    def found(smooth: float) -> float:
        return jitter_test([TimeShifts(smooth * misfit + noise, np.full(n, NOISE_S**-2), np.full(n, NOISE_S**2))]).gain

    noise = rng.normal(0.0, np.hypot(NOISE_S, 1.5e-6), n)
    assert 1.0 < found(1.0) < 100.0
    assert found(1.0) == pytest.approx(found(0.0), rel=0.02)


def test_size_of_jitter_without_misfit() -> None:
    rng = np.random.default_rng(8)
    each = TimeShifts(rng.normal(0.0, np.hypot(NOISE_S, 5e-6), 400), np.full(400, NOISE_S**-2), np.full(400, NOISE_S**2))
    found = jitter_test([each])
    assert found.sigma_s == pytest.approx(5e-6, abs=3 * found.sigma_error_s)
    assert found.sigma_error_s < 5e-7


def test_sightings_without_weight_have_no_part() -> None:
    whole = shifts(0.0)
    blind = np.zeros(len(whole.noise), dtype=bool)
    blind[[0, 50, 51, 52, 120]] = True
    partly = TimeShifts(np.where(blind, 0.0, whole.tau_s), np.where(blind, 1e-150, whole.h), np.where(blind, 0.0, whole.noise))
    assert jitter_test([partly]).p == pytest.approx(jitter_test([whole]).p, abs=0.2)
    nothing = TimeShifts(np.zeros(9), np.full(9, 1e-150), np.zeros(9))
    assert jitter_test([nothing]).p == 1.0


def beside_movements(jitter_s: float, seed: int, stated: float) -> TimeShifts:
    """Shifts with ``stated`` times the variance that they have, and six movements of the same sightings that show it."""
    found = shifts(jitter_s, seed)
    still = np.random.default_rng([seed, 1]).normal(0.0, stated**-0.5, (len(found.tau_s), 6))
    return TimeShifts(found.tau_s, found.h / stated, found.noise * stated, still)


@pytest.mark.parametrize("stated", [0.6, 1.5])
def test_other_movements_tell_how_large_noise_is(stated: float) -> None:
    """Overstated noise would hide jitter, understated one would be taken for it."""
    found = [jitter_test([beside_movements(0.0, seed, stated)]).p for seed in range(200)]
    assert np.mean(np.array(found) < 0.05) < 0.05
    assert 0.5 < np.median(found) < 0.95
    assert np.median([jitter_test([beside_movements(1.5e-6, seed, stated)]).p for seed in range(20)]) < 0.02
    assert noise_ratio([beside_movements(0.0, 3, stated)]) == pytest.approx(max(1.0 / stated, 1.0), rel=0.15)


def blurred_along(jitter_s: float, seed: int) -> TimeShifts:
    """Edges with three times the variance along the motion: of shifts of the time, and of stretches, but not of other movements."""
    rng = np.random.default_rng(seed)
    noisier, n = 3.0, 200
    tau_s = rng.normal(0.0, np.hypot(np.sqrt(noisier) * NOISE_S, jitter_s), n)
    still, stretch = rng.normal(0.0, 1.0, (n, 6)), rng.normal(0.0, np.sqrt(noisier), n)
    return TimeShifts(tau_s, np.full(n, NOISE_S**-2), np.full(n, NOISE_S**2), still, stretch)


def test_edges_noisier_along_the_motion_are_no_jitter() -> None:
    p = np.array([jitter_test([blurred_along(0.0, seed)]).p for seed in range(200)])
    assert np.mean(p < 0.05) < 0.05
    unstretched = [jitter_test([replace(blurred_along(0.0, seed), stretch=None)]).p for seed in range(20)]
    assert np.median(unstretched) < 1e-4
    assert np.median([jitter_test([blurred_along(6e-6, seed)]).p for seed in range(20)]) < 1e-4


@pytest.mark.parametrize("spread", [0.0, 0.6])
@pytest.mark.parametrize("probability", [0.5, 0.95])
def test_a_jitter_is_found_as_often_as_its_limit_says(spread: float, probability: float) -> None:
    """In four sequences, of which some may be noisier than others."""
    rng, level = np.random.default_rng(3), 4e-4
    noises = [NOISE_S**2 * np.exp(spread * rng.normal()) * np.ones(80) for _ in range(4)]

    def drawn(jitter_s: float) -> list[TimeShifts]:
        return [TimeShifts(rng.normal(0.0, np.sqrt(noise + jitter_s**2)), 1.0 / noise, noise) for noise in noises]

    limit = jitter_found_with(drawn(0.0), level, probability)
    found = [jitter_test(drawn(limit)).p < level for _ in range(600)]
    assert np.mean(found) == pytest.approx(probability, abs=0.06)


def test_shifts_that_say_nothing_have_no_limit() -> None:
    assert jitter_found_with([TimeShifts(np.zeros(2), np.full(2, 1e-150), np.zeros(2))], 1e-3, 0.95) == np.inf


def outlier(jitter_s: float, *, off: float) -> TimeShifts:
    """100 sightings of which one is ``off`` as a whole, in standard deviations along the motion and across it."""
    rng = np.random.default_rng(12)
    tau, still = rng.normal(0.0, np.hypot(NOISE_S, jitter_s), 100), rng.normal(size=(100, 6))
    tau[40], still[40, 1] = tau[40] + off * NOISE_S, off
    return TimeShifts(tau, np.full(100, NOISE_S**-2), np.full(100, NOISE_S**2), still)


def test_an_outline_that_is_off_as_a_whole_is_no_jitter() -> None:
    assert jitter_test([outlier(0.0, off=30.0)]).p > 0.01
    assert jitter_test([outlier(0.0, off=30.0)]).gain < 3.0
    assert jitter_test([outlier(4.0 * NOISE_S, off=30.0)]).sigma_s == pytest.approx(4.0 * NOISE_S, rel=0.2)


@pytest.mark.parametrize("number", [0, 1, 40, 98, 99])
@pytest.mark.parametrize("off", [30.0, -30.0])
def test_an_outline_is_off_to_either_side_and_at_the_ends(number: int, off: float) -> None:
    """One next to an end may take that with it, which has few beside it."""
    each = outlier(0.0, off=0.0)
    assert each.still is not None
    still = each.still.copy()
    still[number, 2] += off
    dropped = set(np.flatnonzero(without_outliers(replace(each, still=still)).noise == 0.0).tolist())
    assert {number} <= dropped <= {number} | ({0} if number == 1 else {99} if number == 98 else set())


@pytest.mark.parametrize(("outlines", "share"), [(8, 0.012), (30, 1e-3), (100, 1e-4)])
def test_few_outlines_with_normal_errors_are_far_off(outlines: int, share: float) -> None:
    rng, flights, far = np.random.default_rng(1), 1000, 0
    for _ in range(flights):
        off = from_neighbours(rng.normal(size=(outlines, 2)))
        far += int(np.sum((off > FAR_OFF * robust_sigma(off)).any(axis=1)))
    assert far <= share * flights * outlines


def test_a_smooth_misfit_makes_no_outliers() -> None:
    each = outlier(0.0, off=0.0)
    for misfit in (np.linspace(0.0, 200.0, 100), 50.0 * np.sin(np.linspace(0.0, 6.0, 100))):
        assert each.still is not None
        moved = replace(each, still=each.still + misfit[:, None])
        np.testing.assert_array_equal(without_outliers(moved).noise, each.noise)


@pytest.mark.parametrize("width", [1, 2])
def test_movements_that_are_alike_say_over_how_many_frames(width: int) -> None:
    """Moving means of white noise, of the size that is modelled, beside a slow misfit of any size."""
    rng = np.random.default_rng(8)

    def moved(n: int) -> TimeShifts:
        white = rng.normal(size=(n + width - 1, 6))
        alike = sum(white[k : k + n] for k in range(width)) / np.sqrt(width)
        slow = 10.0 * np.linspace(-1.0, 1.0, n)[:, None] ** 2
        return TimeShifts(np.zeros(n), np.ones(n), np.ones(n), still=alike + slow)

    assert likeness([moved(40) for _ in range(6)]) == pytest.approx(width, rel=0.15)


def test_one_flight_among_many_that_say_nothing_has_the_limit_of_its_own() -> None:
    told = TimeShifts(np.zeros(20), np.full(20, NOISE_S**-2), np.full(20, NOISE_S**2))
    silent = [TimeShifts(np.zeros(20), np.full(20, 1e-24), np.full(20, 1e24)) for _ in range(4)]
    assert jitter_found_with([told, *silent], 1e-3, 0.95) == pytest.approx(jitter_found_with([told], 1e-3, 0.95), rel=1e-6)
