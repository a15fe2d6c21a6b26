"""The cases of the golden corpus: small observations from fixed seeds through each of the instrument's doors.

One free flight in outlines, by tangents and by samples, and one in pictures rendered once (:mod:`tests.reference.golden_pictures`),
drops on to a plate, two particles that collide, a campaign of silhouettes and campaigns of trajectories (poses, positions, a gyroscope),
each with an effect hidden in it, tosses with an impact, and contact models judged by the drops. All is made by the project's own ``synth``.
The settings are as small as a result allows: this is no measure of accuracy, only of change.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.estimate import Estimate
from datasets.observation import Observation
from datasets.recipes.recipe import (
    ContactRecipe,
    DropperRecipe,
    EffectRecipe,
    MotionRecipe,
    PairRecipe,
    ParticleRecipe,
    PlateRecipe,
    Recipe,
    RigRecipe,
)
from datasets.trajectory import Surroundings, Trajectory
from datasets.truth import Truth
from estimator.contact_validation.validate import Question, validate
from estimator.data.configuration import Configuration
from estimator.diagnosis.explain import explain
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.considered import uncertain
from estimator.fitting.campaigns.registered import Registered
from estimator.measure import measure
from estimator.measurements.silhouettes.registration import register
from estimator.measurements.trajectories.impacts import measure_impacts
from estimator.measurements.trajectories.registering import register_trajectories
from estimator.reports.campaign_reporting import campaign_estimates
from synth.sequence import build_silhouette_sequence
from tests.reference.golden_pictures import committed
from tests.reference.golden_records import Record, joined, of_estimate, of_explanation, of_validation
from tumble.challenge.field_case import Effects, FieldCase, FlightPlan, Measured, Noise
from tumble.challenge.field_flights import measured as tracked
from tumble.contact_validating import Known, collected_from

Array = NDArray[np.float64]
QUICK = Configuration(hull_resolution=32, directions=200, pose_starts=24, momentum_starts=0, bias_pairs=2, surface_fit=0)
STONE = ParticleRecipe(irregularity=0.6, size_mm=(6.0, 6.0))
FLIGHT = Recipe(
    seed=5, particle=STONE, motion=MotionRecipe(frames=20, speed_ms=(1.5, 2.5), spin_rads=(120.0, 200.0)), rig=RigRecipe(drops=3)
)
DROPS = Recipe(
    seed=9,
    sequences=4,
    particle=STONE,
    rig=RigRecipe(drops=3),
    plate=PlateRecipe(tilt_deg=(15.0, 25.0)),
    dropper=DropperRecipe(runs=4, height_mm=(80.0, 100.0), frames_before=(16, 16), frames_after=(16, 16)),
)
PAIR = Recipe(
    seed=7,
    particle=ParticleRecipe(irregularity=0.5, size_mm=(4.5, 6.5)),
    motion=MotionRecipe(spin_rads=(40.0, 120.0)),
    rig=RigRecipe(drops=4),
    pair=PairRecipe(closing_ms=(0.8, 1.5), out_of_plane_deg=(0.0, 10.0), frames_before=(16, 16), frames_after=(16, 16)),
    contact=ContactRecipe(restitution=0.7, friction=0.2),
)
CAMPAIGN = Recipe(
    seed=5,
    sequences=2,
    particle=STONE,
    motion=MotionRecipe(frames=30, speed_ms=(1.0, 2.0), spin_rads=(100.0, 200.0)),
    rig=RigRecipe(drops=2),
    same_particle=True,
    effects=(EffectRecipe("quadratic_drag", {"per_length": 4.0}),),
)
NOISE = {"x": 5e-4, "theta": 3e-3, "omega": 0.05, "gyro": 0.01}
TRACKED = Noise(NOISE, repeats=1, outliers=0.02, rounded=False, stated=False)
FLIGHTS, ROWS, RATE_HZ = 3, 40, 150.0
DRAG: Effects = {"quadratic_drag": {"per_length": (0.3,) * FLIGHTS}}
DAMPING: Effects = {"spin_damping": {"rate": (0.2,) * FLIGHTS}}
TOSS_SIGMA_M, TOSS_SIGMA_RAD = 2e-6, 1e-3
TOSSED = replace(DROPS, dropper=replace(DROPS.dropper, frames_before=(60, 60), frames_after=(60, 60)))
"""As drops, long enough for gravity to show in a trajectory."""
TOSSES = 2


def _flight() -> Record:
    return of_estimate(measure(build_silhouette_sequence(FLIGHT, 0)[0], QUICK))


def _samples() -> Record:
    found = measure(build_silhouette_sequence(FLIGHT, 0)[0], replace(QUICK, surface_fit=1))
    assert found.surface is not None, found.message
    return of_estimate(found)


def _pictures() -> Record:
    with committed() as observation:
        return of_estimate(measure(observation, QUICK))


@cache
def _dropped() -> tuple[tuple[Observation, Estimate], ...]:
    seen = [build_silhouette_sequence(DROPS, number)[0] for number in range(DROPS.sequences)]
    return tuple((each, measure(each, QUICK)) for each in seen)


def _plate() -> Record:
    return joined({each.name: of_estimate(each) for _, each in _dropped()[:TOSSES]})


def _contact() -> Record:
    by_name = {observation.name: observation for observation, _ in _dropped()}
    found = collected_from([(estimate, by_name.get) for _, estimate in _dropped()], Known())
    return of_validation(validate(found.impacts, Question(models=("stronge_impulse", "frictionless")), lambda _: None))


def _pair() -> Record:
    return of_estimate(measure(build_silhouette_sequence(PAIR, 0)[0], QUICK))


def _silhouettes() -> Record:
    observations = [build_silhouette_sequence(CAMPAIGN, number)[0] for number in range(CAMPAIGN.sequences)]
    return _explained(register(observations, QUICK), {each.name: each for each in observations})


def _trajectories(measured: Measured, hidden: Effects) -> Callable[[], Record]:
    def made() -> Record:
        case = _case(measured, hidden)
        flights = [tracked(case, number) for number in range(FLIGHTS)]
        return _explained(register_trajectories(flights), {each.name: each for each in flights})

    return made


def _case(measured: Measured, hidden: Effects) -> FieldCase:
    """Flights of a body without symmetry, thrown as by hand."""
    rng = np.random.default_rng(6)
    plans = tuple(
        FlightPlan(
            f"flight-{number}",
            ROWS,
            RATE_HZ,
            tuple(rng.uniform([-2.0, -2.0, 0.5], 2.0).tolist()),
            tuple(rng.normal(0.0, 5.0, 3).tolist()),
            tuple(Rotation.random(rng=rng).as_quat().tolist()),
        )
        for number in range(FLIGHTS)
    )
    return FieldCase("golden", 6, measured, (0.6, 0.8, 1.0), plans, TRACKED, hidden, {}, {}, {}, {})


def _explained(registered: Registered, observations: Mapping[str, Observation | Trajectory]) -> Record:
    effects = catalogue()
    found = explain(registered.campaign, registered.start, effects)
    at = replace(registered, campaign=found.campaign)
    of = uncertain(at.campaign, found.fit, effects)
    estimates = campaign_estimates(at, observations, of.fit, of.at, QUICK)
    return of_explanation(at, found, of, estimates)


def _tosses() -> Record:
    """Drops as a tracker would measure them."""
    rng = np.random.default_rng(3)
    flights = [_toss(build_silhouette_sequence(TOSSED, number)[1], rng) for number in range(TOSSES)]
    return joined({each.name: of_estimate(each) for each in measure_impacts(flights)})


def _toss(truth: Truth, rng: np.random.Generator) -> Trajectory:
    motion = truth.motion
    x = motion.x_world + rng.normal(0.0, TOSS_SIGMA_M, motion.x_world.shape)
    turned = Rotation.from_rotvec(rng.normal(0.0, TOSS_SIGMA_RAD, x.shape)) * Rotation.from_quat(motion.q_world_body)
    body = replace(truth.body, com_particle=np.zeros(3), R_particle_body=np.eye(3))
    where = Surroundings(np.array(DROPS.motion.gravity_ms2), body)
    return Trajectory(truth.name, motion.times_s, x, turned.as_quat(), None, None, None, None, where)


CASES: Mapping[str, Callable[[], Record]] = {
    "flight": _flight,
    "samples": _samples,
    "pictures": _pictures,
    "plate": _plate,
    "contact": _contact,
    "pair": _pair,
    "silhouettes": _silhouettes,
    "poses": _trajectories("poses", DRAG),
    "positions": _trajectories("positions", DRAG),
    "gyroscope": _trajectories("gyroscope", DAMPING),
    "tosses": _tosses,
}
"""What makes the record of every case, by its name."""
