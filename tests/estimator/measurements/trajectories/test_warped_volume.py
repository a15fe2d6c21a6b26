"""A volume that a tracker twists: told as something unknown in the tracking, and what it does to flights is not called drag."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.special import chdtri

from datasets.trajectory import Trajectory
from datasets.vocabulary.effects import Stage
from estimator.diagnosis.explain import Explanation, explain
from estimator.diagnosis.selection.names import possible_names
from estimator.effects.choosing import catalogue
from estimator.effects.empirical.families import VolumeWarp
from estimator.effects.link import Setting
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.motion.flight import V
from tests.estimator.made_trajectories import GRAVITY, RATE_HZ, Hidden, Tracker, measured

Array = np.ndarray
TRIED = ("linear_drag", "quadratic_drag", "position_distortion", "length_scale", "uniform_acceleration", "steady_wind")
TRACKER = Tracker(rows=16, sigma_x=2.5e-5, orientation=False)
TOSSES, SPEED, FROM = 30, 1.15, 0.28
STRETCH, TWIST, DRAG = 0.002, -0.005, 0.2
WANDER = 0.02
"""Size of an integrated Wiener process, m/s^1.5: 0.4 mm in a tenth of a second."""


def velocity(v: Array, drag: float, time_s: float) -> Array:
    """Of a toss that begins with ``v`` m/s."""
    return v + GRAVITY * time_s if drag == 0.0 else GRAVITY / drag + (v - GRAVITY / drag) * np.exp(-drag * time_s)


def towards_the_middle(rng: np.random.Generator, name: str, drag: float) -> tuple[Trajectory, Array]:
    """A toss from anywhere about a board on to its middle, with a drag (1/s) along the velocity, and how fast it begins."""
    angle = rng.uniform(0.0, 2.0 * np.pi)
    aim = angle + np.pi + rng.normal(0.0, 0.2)
    x = np.array([FROM * np.cos(angle), FROM * np.sin(angle), rng.uniform(0.12, 0.16)])
    v = np.array([SPEED * np.cos(aim), SPEED * np.sin(aim), rng.uniform(-0.3, 0.3)])
    t = np.arange(TRACKER.rows)[:, None] / RATE_HZ
    flown = x + v * t + GRAVITY * t**2 / 2.0
    if drag > 0.0:
        fallen, left = GRAVITY / drag, -np.expm1(-drag * t) / drag
        flown = x + fallen * t + (v - fallen) * left
    seen = flown + rng.normal(0.0, TRACKER.sigma_x, flown.shape)
    return replace(measured(name, rng, Hidden(), TRACKER), x_world=seen), v


def warped(trajectories: list[Trajectory], stretch: float, twist: float) -> list[Trajectory]:
    """What a tracker reports that stretches the volume, and turns it about the vertical, the more the further from its middle."""
    places = np.concatenate([t.x_world for t in trajectories])
    middle = places.mean(axis=0)
    squares = np.mean(np.sum((places - middle) ** 2, axis=1))

    def seen(x: Array) -> Array:
        away = x - middle
        turned = np.cross([0.0, 0.0, twist], away)
        return x + np.sum(away**2, axis=1, keepdims=True) / squares * (stretch * away + turned)

    return [replace(t, x_world=seen(t.x_world)) for t in trajectories]


@cache
def tosses(drag: float) -> list[tuple[Trajectory, Array]]:
    rng = np.random.default_rng(3)
    return [towards_the_middle(rng, f"toss_{i}", drag) for i in range(TOSSES)]


@cache
def explained(twist: float, drag: float) -> Explanation:
    made = [trajectory for trajectory, _ in tosses(drag)]
    registered = register_trajectories(warped(made, STRETCH * bool(twist), twist))
    return explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})


def test_a_twisted_volume_is_told_as_the_trackers_and_not_called_drag() -> None:
    found = explained(TWIST, 0.0)
    assert not {"linear_drag", "quadratic_drag"} & set(found.found)
    assert found.left is not None
    assert found.left.present
    assert found.left.stage is Stage.TRACKING


def test_what_the_warp_has_in_every_toss_stays_in_the_model_as_the_tosses_own() -> None:
    assert "uniform_acceleration" in explained(TWIST, 0.0).found
    assert explained(TWIST, 0.0).in_place == ("uniform_acceleration",)
    assert explained(0.0, DRAG).in_place == ()


def test_what_is_told_as_unknown_is_no_second_name_of_what_is_told_beside_it() -> None:
    assert not [name.key for group in explained(TWIST, 0.0).groups for name in group if name.unknown]


def test_effects_are_as_probable_as_beside_what_is_unknown() -> None:
    """Without the warp a distortion and a drag would stand for parts of it."""
    found = explained(TWIST, 0.0)
    best = found.path[-1]
    told = {each.key: each.probability for each in found.diagnosis.findings}
    assert {"linear_drag", "quadratic_drag", "position_distortion"} <= set(told)
    assert told == {key: best.posterior.probability(best.trial.evidence.of.keys.index(key)) for key in told}
    assert max(told["linear_drag"], told["quadratic_drag"]) < 0.5


@pytest.mark.parametrize("drag", [0.0, DRAG])
def test_velocities_are_right_beside_the_warp_and_wrong_without(drag: float) -> None:
    """Its own accelerations stand for parts of it, and so do the tosses' velocities."""
    found = explained(TWIST, drag)
    pulls = []
    for at in (found.path[-1], found.last):
        covariance = campaign_covariance(at.campaign, at.fit)
        off = [flight.v - velocity(v, drag, flight.time_s) for flight, (_, v) in zip(at.fit.state.flights, tosses(drag), strict=True)]
        pulls.append([float(d @ np.linalg.solve(covariance.of(i, np.arange(V.start, V.stop)), d)) for i, d in enumerate(off)])
    beside, without = (float(np.mean(np.array(each) < chdtri(3, 0.05))) for each in pulls)
    assert beside > 0.8
    assert without < beside - 0.2


@pytest.mark.parametrize("twist", [0.0, TWIST], ids=["alone", "beside a twist"])
def test_drag_is_called_drag_and_its_interval_holds_it(twist: float) -> None:
    found = explained(twist, DRAG)
    (step,) = [step for step in found.steps if {"linear_drag", "quadratic_drag"} & {step.added, *step.group}]
    (drag,) = [name for name in step.names if name.key == "linear_drag"]
    assert abs(drag.parts[0].mean[0] - DRAG) < 1.96 * drag.parts[0].sigma[0]
    assert drag.parts[0].sigma[0] < 0.25 * DRAG


def test_what_the_set_has_is_not_possible_beside_it() -> None:
    found = explained(TWIST, 0.0)
    assert not {each.effect.entry.key for each in possible_names(found.path[-1], found.groups)} & set(found.path[-1].keys)


def test_the_warp_stays_unknown_beside_what_the_tracker_wanders_by_in_every_toss() -> None:
    """The search goes on from where it had ended, with the warp; by how much it is worth is said of one noise."""
    rng, drag = np.random.default_rng(7), DRAG
    step, shape = 0.1 / RATE_HZ, (10 * TRACKER.rows, 3)
    off = [WANDER * step**1.5 * np.cumsum(np.cumsum(rng.normal(size=shape), axis=0), axis=0)[::10] for _ in tosses(drag)]
    made = warped([trajectory for trajectory, _ in tosses(drag)], STRETCH, TWIST)
    registered = register_trajectories([replace(t, x_world=t.x_world + more) for t, more in zip(made, off, strict=True)])
    found = explain(registered.campaign, registered.start, {key: catalogue()[key] for key in TRIED})
    assert [at.campaign.kind.slow is not None for at in found.path[-2:]] == [False, True]
    assert all("volume_warp" in at.keys for at in found.path[-2:])
    assert found.left is not None
    assert found.left.sure > 0.99


def test_where_nothing_is_nothing_is_found() -> None:
    found = explained(0.0, 0.0)
    assert found.found == ()
    assert found.left is None or not found.left.present


def test_a_warp_is_of_second_and_third_order() -> None:
    setting = replace(Setting(np.zeros(1), 0.0, GRAVITY, np.ones(3)), middle_world=np.array([0.1, -0.2, 0.3]), reach_m=0.5)
    x, family = setting.middle_world + np.array([[0.5, 0.0, -0.25]]), VolumeWarp()
    names = family.entry.names

    def by(**values: float) -> Array:
        return family.tracked(np.array([values.get(name, 0.0) for name in names]), x, setting) - x

    np.testing.assert_allclose(by(), 0.0)
    np.testing.assert_allclose(by(y_xz=0.01), [[0.0, -0.0025, 0.0]])
    np.testing.assert_allclose(by(stretch=0.01), 0.0125 * (x - setting.middle_world))
    np.testing.assert_allclose(by(twist_z=0.01), [[0.0, 0.01 * 1.25 * 0.5, 0.0]])
