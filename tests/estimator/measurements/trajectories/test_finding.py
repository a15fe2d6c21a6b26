"""What is hidden in trajectories made by an independent method is found, and nothing where there is nothing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.trajectory import Trajectory
from estimator.diagnosis.adding import fit_with, with_effect
from estimator.diagnosis.diagnose import ALPHA, Diagnosis, diagnose
from estimator.diagnosis.explain import explain
from estimator.diagnosis.noise_floor import noise_floor
from estimator.diagnosis.residual_maps import residual_maps
from estimator.diagnosis.score_tests import Candidates, Column, EfficientScores, p_of
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.trajectories.registering import particles_of, register_trajectories
from estimator.motion.flight import N_PARAMETERS
from tests.estimator.made_trajectories import Hidden, Tracker, campaign, measured

pytestmark = pytest.mark.long

CONTROLS, MOST_ALARMS = 40, 3
SMALL = Tracker(rows=16)


def diagnosed(registered: Registered) -> Diagnosis:
    campaign, fit = fit_with(registered.campaign, registered.start, ())
    return diagnose(campaign, fit, catalogue())


@pytest.mark.parametrize(
    ("hidden", "tracker", "effect", "value"),
    [
        (Hidden(drag=0.15), Tracker(), "quadratic_drag", 0.15),
        (Hidden(drag=0.15), Tracker(orientation=False), "quadratic_drag", 0.15),
        (Hidden(more_gravity=0.2), Tracker(), "frame_rate", -0.0100),
        (Hidden(com=(0.003, 0.0, -0.002)), Tracker(), "centre_of_mass", 0.003),
    ],
    ids=["drag", "drag, positions alone", "gravity", "centre of mass"],
)
def test_what_is_hidden_is_found_with_its_size(hidden: Hidden, tracker: Tracker, effect: str, value: float) -> None:
    registered = register_trajectories(campaign(11, hidden, tracker))
    found = diagnosed(registered)
    assert found.p < ALPHA
    assert effect in found.group
    assert found.probability < ALPHA
    base = base_fit(registered.campaign, registered.start)
    followed, fit = with_effect(registered.campaign, base, catalogue()[effect])
    sigma = np.sqrt(campaign_covariance(followed, fit).of(0, np.array([N_PARAMETERS]))[0, 0])
    assert abs(fit.state.theta[0][0] - value) < 4.0 * sigma
    assert sigma < 0.25 * abs(value)


def test_gravity_frame_rate_and_lengths_are_one_number() -> None:
    registered = register_trajectories(campaign(11, Hidden(more_gravity=0.2), Tracker()))
    found = diagnosed(registered)
    explained = {f.key: f.test.statistic for f in found.findings}
    assert {"frame_rate", "length_scale"} <= set(found.group)
    assert explained["frame_rate"] == pytest.approx(explained["length_scale"], abs=1.0)
    assert explained["gravity"] > explained["frame_rate"] - 1.0


def test_controls_are_clean() -> None:
    found = {seed: diagnosed(register_trajectories(campaign(seed, Hidden(), SMALL, sequences=3))) for seed in range(CONTROLS)}
    alarms = [seed for seed, each in found.items() if each.p < ALPHA]
    named = {seed: each.missing for seed, each in found.items() if each.missing}
    assert len(alarms) <= MOST_ALARMS, alarms
    assert len(named) <= MOST_ALARMS, named


def test_stated_noise_is_believed() -> None:
    registered = register_trajectories(campaign(2, Hidden(), Tracker(stated=True)))
    task = registered.campaign.sequences[0]
    assert task.sigma[0].tolist() == [5e-4] * 3 + [3e-3] * 3
    assert task.repeats.mean() < 1.2  # rows are independent; what is left is chance


def shaken(*, stated: bool) -> Registered:
    """Trajectories of a scene that shakes by 5 mm twice in every flight."""
    made = campaign(2, Hidden(), Tracker(stated=stated))
    shake = [0.005 * np.sin(2.0 * np.pi * t.times_s / 0.1)[:, None] * [1.0, 0.0, 0.0] for t in made]
    return register_trajectories([replace(t, x_world=t.x_world + s) for t, s in zip(made, shake, strict=True)])


def test_what_shakes_fast_is_told_from_noise_only_where_noise_is_stated() -> None:
    explainable = []
    for stated in (True, False):
        registered = shaken(stated=stated)
        fit = base_fit(registered.campaign, registered.start)
        floor = noise_floor(registered.campaign, fit, np.random.default_rng(0))
        explainable.append((floor.explainable(1.0, ALPHA), floor.rms_px > 2.0))
    assert explainable[0] == (True, True)
    assert not explainable[1][1]


def test_the_floor_and_the_maps_tell_drag_from_nothing() -> None:
    clean, dragged = (register_trajectories(campaign(4, Hidden(drag=d), Tracker())) for d in (0.0, 0.3))
    judged = []
    for registered in (clean, dragged):
        fit = base_fit(registered.campaign, registered.start)
        floor = noise_floor(registered.campaign, fit, np.random.default_rng(0))
        judged.append((floor, [m for m in residual_maps(registered.campaign, fit) if m.significant]))
    (quiet, none), (loud, maps) = judged
    assert not quiet.explainable(1.0, ALPHA)
    assert none == []
    assert quiet.rms_px == pytest.approx(1.0, abs=0.15)
    assert loud.explainable(1.0, ALPHA)
    assert {"position_along"} <= {m.kind for m in maps}
    assert {m.unit for m in maps} == {"σ"}


def test_explaining_adds_the_drag_and_stops() -> None:
    registered = register_trajectories(campaign(6, Hidden(drag=0.3), Tracker(rows=24)))
    told = explain(registered.campaign, registered.start, catalogue())
    assert told.found == ("quadratic_drag",)
    assert told.steps[0].after.rms_px < 0.9 * told.steps[0].before.rms_px


def test_places_are_looked_for_in_the_longest_flight_whichever_comes_first() -> None:
    """The first flight is too short for a gap; what the others show is found all the same."""
    made = campaign(11, Hidden(drag=0.3), Tracker(), sequences=3)
    short = measured("short", np.random.default_rng(3), Hidden(drag=0.3), Tracker(rows=5))
    found = []
    for order in ((short, *made), (*made, short)):
        registered = register_trajectories(order)
        candidates = Candidates.of(registered.campaign, catalogue().values())
        assert all(len(starts) for starts in candidates.starts)
        found.append((explain(registered.campaign, registered.start, catalogue()).found, [len(s) for s in candidates.starts]))
    assert found[0] == found[1]
    assert found[0][0] == ("quadratic_drag",)


def test_one_gap_among_many_flights_is_not_drowned_by_all_places_of_all_flights() -> None:
    """Twenty flights of eighty frames: the one that shows a gap by ten standard deviations counts for itself, and never overflows."""
    columns = tuple(Column(0, 3, 1, i) for i in range(20))
    silent, gap = np.full(20, 3.0) ** 0.5, np.zeros(20)
    gap[7] = 10.0
    for seen, found in ((silent, False), (np.maximum(silent, gap), True)):
        p = p_of(EfficientScores(columns, seen, np.eye(20), np.eye(20)), 78)
        assert (p < 1e-15) == found
        assert p <= 1.0
    many = EfficientScores(tuple(Column(0, 3, 1, i) for i in range(300)), np.ones(300), np.eye(300), np.eye(300))
    assert p_of(many, 78) == 1.0


def test_every_particle_has_its_own_drag() -> None:
    """Trajectories of one name share it; without names the two would be one particle of neither drag."""
    wood, cork = campaign(11, Hidden(drag=0.10), Tracker()), campaign(12, Hidden(drag=0.25), Tracker())
    named = [replace(t, surroundings=replace(t.surroundings, particle=name)) for name, ts in (("wood", wood), ("cork", cork)) for t in ts]
    assert particles_of([*wood, *cork]) == (0,) * len(named)
    assert particles_of(named) == (0,) * len(wood) + (1,) * len(cork)
    registered = register_trajectories(named)
    followed, fit = with_effect(registered.campaign, base_fit(registered.campaign, registered.start), catalogue()["quadratic_drag"])
    covariance = campaign_covariance(followed, fit)
    for number, drag in ((0, 0.10), (len(wood), 0.25)):
        sigma = np.sqrt(covariance.of(number, np.array([N_PARAMETERS]))[0, 0])
        assert abs(fit.state.theta[number][0] - drag) < 4.0 * sigma
        assert sigma < 0.2 * drag


def test_without_a_name_other_inertia_ratios_are_another_particle() -> None:
    """A tag elsewhere on the same body is not; and one name is one particle."""
    one, other = campaign(11, Hidden(), Tracker())[:2]
    slimmer = with_body(other, inertia_ratios=np.array([0.2, 0.9, 1.0]))
    moved = with_body(other, com_particle=np.array([0.0, 1e-3, -0.0]))
    assert particles_of([one, slimmer, other, moved]) == (0, 1, 0, 0)
    named = [replace(t, surroundings=replace(t.surroundings, particle="cork")) for t in (one, slimmer)]
    with pytest.raises(InputError, match="expected the inertia ratios of particle 'cork' as toss_0"):
        particles_of(named)


def test_a_stated_calibration_is_a_fact_of_all_trajectories() -> None:
    made = campaign(2, Hidden(), SMALL, sequences=2)
    stated = [replace(t, surroundings=replace(t.surroundings, sigma_length_scale=1e-3)) for t in made]
    (fact,) = register_trajectories(stated).campaign.facts
    assert (fact.effects, fact.value, fact.sigma) == (("length_scale",), 0.0, 1e-3)
    with pytest.raises(InputError, match=r"expected one sigma_length_scale for all trajectories of a campaign, got nothing, 0\.001"):
        register_trajectories([made[0], stated[1]])


def with_body(trajectory: Trajectory, **changes: Any) -> Trajectory:
    surroundings = trajectory.surroundings
    return replace(trajectory, surroundings=replace(surroundings, body=replace(surroundings.body, **changes)))
