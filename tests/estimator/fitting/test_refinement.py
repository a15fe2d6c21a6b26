"""The last refinement: the same flight from far and near, and a status where the steps run out."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from estimator.data.fit_task import FitTask
from estimator.fitting import refinement
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.refinement import Refined, refine, stepped
from estimator.fitting.system import Arrangement, System
from estimator.fitting.trajectory import cost, fit
from estimator.fitting.viewing_angles import with_clear_angles
from estimator.fitting.weighed_tangencies import Refinement
from estimator.motion.flight import N_PARAMETERS, OMEGA, THETA, Flight, V, X, moved, poses
from estimator.motion.rigid_body import RanAway
from tests.estimator.fitting.test_within_sequence import seen_by_two, spinning

Array = NDArray[np.float64]
SETTINGS = Refinement(floor_px=0.04, body_noise_px=0.05, within_pairs=600)
FLIGHT = np.r_[X, THETA, V, OMEGA]


@pytest.fixture(scope="module")
def task() -> FitTask:
    return replace(with_clear_angles(seen_by_two(spinning()), spinning()), huber=4.0)


@pytest.fixture(scope="module")
def near(task: FitTask) -> Refined[Flight]:
    return refine(task, spinning(), SETTINGS)


def away(near: Refined[Flight], sigmas: float) -> Array:
    """A step of the flight's twelve parameters, each by ``sigmas`` error bars, up or down."""
    step = np.zeros(N_PARAMETERS)
    signs = np.random.default_rng(2).choice([-1.0, 1.0], size=len(FLIGHT))
    step[FLIGHT] = sigmas * signs * np.sqrt(np.diag(near.covariance))[FLIGHT]
    return step


def test_many_error_bars_away_the_same_flight_is_found(task: FitTask, near: Refined[Flight]) -> None:
    far = refine(task, moved(spinning(), away(near, 40.0)), SETTINGS)
    assert near.settled
    assert far.settled
    sigma = np.sqrt(np.diag(near.covariance))
    assert np.all(np.abs(far.flight.x - near.flight.x) < 0.2 * sigma[X])
    assert np.all(np.abs(far.flight.v - near.flight.v) < 0.2 * sigma[V])
    assert np.all(np.abs(far.flight.omega - near.flight.omega) < 0.2 * sigma[OMEGA])


def test_steps_that_run_out_are_told(task: FitTask, near: Refined[Flight], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(refinement, "MOST_STEPS", 1)
    assert not refine(task, moved(spinning(), away(near, 40.0)), SETTINGS).settled


def test_after_the_fine_steps_a_steady_one_is_enough(task: FitTask, near: Refined[Flight], monkeypatch: pytest.MonkeyPatch) -> None:
    """Tangencies that change places may keep steps above the fine limit for ever."""
    taken: list[float] = []
    step_by = Flight.moved

    def counted(flight: Flight, step: Array) -> Flight:
        taken.append(1.0)
        return step_by(flight, step)

    monkeypatch.setattr(Flight, "moved", counted)
    monkeypatch.setattr(refinement, "SETTLED", 0.0)
    refine(task, near.flight, SETTINGS)
    assert len(taken) == refinement.FINE_STEPS


@dataclass(frozen=True)
class Overshooting:
    """A problem and its state in one: a number whose steps go twice as far as they should."""

    x: float
    taken: list[float]

    def at(self, there: "Overshooting") -> System[NormalEquations]:
        told, none = NormalEquations(np.eye(1), np.array([2.0 * there.x]), 0.0), NormalEquations(np.zeros((1, 1)), np.zeros(1), 0.0)
        return System((told,), Arrangement((np.arange(1),), 1), none, 0.0)

    def moved(self, step: Array) -> "Overshooting":
        self.taken.append(float(step[0]))
        return replace(self, x=self.x + float(step[0]))


def test_steps_that_turn_back_for_ever_are_halved() -> None:
    """Weights that change with the state throw it from one side of its end to the other."""
    start = Overshooting(5.0, [])
    end, _, settled = stepped(start, start)  # type: ignore[arg-type]
    assert settled
    assert end.x == pytest.approx(0.0, abs=1e-12)
    assert [abs(step) for step in start.taken] == [10.0] * refinement.FINE_STEPS + [5.0, 0.0]


def test_a_flight_that_cannot_be_flown_costs_more_than_any_other(task: FitTask) -> None:
    """Its spin overflows: a step that leads there is refused instead of ending the fit."""
    runaway = replace(spinning(), omega=np.full(3, 1e300))
    with np.errstate(over="ignore", invalid="ignore"):
        with pytest.raises(RanAway):
            poses(runaway, np.zeros((1, N_PARAMETERS)), task.sightings.times_s)
        assert cost(task, runaway) == np.inf
    assert np.isfinite(cost(task, spinning()))


def test_a_fit_that_starts_where_nothing_can_be_flown_ends_with_infinite_cost(task: FitTask) -> None:
    """So that any other start is better; spins beyond what a camera follows count as run away before they overflow."""
    with np.errstate(over="ignore", invalid="ignore"):
        for spin in (1e300, 1e7):
            assert fit(task, replace(spinning(), omega=np.full(3, spin))).equations.cost == np.inf


def test_a_refinement_whose_step_runs_away_stays_where_it_is(task: FitTask, near: Refined[Flight], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Flight, "moved", lambda flight, _step: replace(flight, omega=np.full(3, 1e7)))
    stayed = refine(task, near.flight, SETTINGS)
    assert not stayed.settled
    np.testing.assert_array_equal(stayed.flight.omega, near.flight.omega)
