"""From the observations of a campaign to its task and the free flights it starts from.

Sequences with the same calibrated views show one particle; its hull, start catalogue and the views' likeness are made once. A sequence that
cannot be measured is left out and named, the rest goes on.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import CalibratedView, Observation
from estimator.configuration import Configuration
from estimator.effects.link import Setting
from estimator.effects.model import Model
from estimator.fitting.campaign import Campaign, CampaignState
from estimator.fitting.model_errors import SequenceTask
from estimator.fitting.pose_refinement import Views
from estimator.fitting.rim import rim_of
from estimator.fitting.time_gaps import longest_stretch
from estimator.fitting.trajectory import FitTask, restricted
from estimator.geometry.outline_shape import outline_shape
from estimator.measurements.silhouettes import SILHOUETTES
from estimator.motion.flight import Flight
from estimator.outline_tables import OutlineTables, with_tables
from estimator.particle import Particle, views_like
from estimator.pipeline import (
    NoMeasurement,
    bias_pairs,
    candidate_flights,
    first_pose,
    fit_task,
    observed_particle,
    pictures_of,
    tracks_of,
    usable_sightings,
)

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LeftOut:
    """A sequence that is not part of the campaign, and why."""

    name: str
    reason: str


@dataclass(frozen=True)
class Registered:
    """A campaign, where its fits start, its particles, and the sequences left out."""

    campaign: Campaign
    start: CampaignState
    particles: tuple[Particle, ...]
    left_out: tuple[LeftOut, ...]


def register(
    observations: Sequence[Observation], configuration: Configuration, *, told: Callable[[int, int], None] = lambda _done, _all: None
) -> Registered:
    """Find the particle in every sequence and fit free flights, one by one.

    ``told`` is called with the number of sequences done and of all.
    """
    particles: dict[str, tuple[int, Particle, Views | None]] = {}
    cameras: dict[str, int] = {}
    tasks: list[SequenceTask] = []
    flights: list[Flight] = []
    groups: list[tuple[int, int]] = []
    left_out: list[LeftOut] = []
    for number, observation in enumerate(observations):
        key = _digest(observation.views)
        try:
            if key not in particles:
                particles[key] = (len(particles), observed_particle(observation, configuration), None)
            which, particle, views = particles[key]
            task, flight, views = _one(observation, particle, views, configuration)
        except (NoMeasurement, InputError) as failure:
            left_out.append(LeftOut(observation.name, str(failure)))
            continue
        finally:
            told(number + 1, len(observations))
        particles[key] = (which, particle, views)
        tasks.append(task)
        flights.append(flight)
        groups.append((which, cameras.setdefault(repr(observation.cameras[0]), len(cameras))))
    campaign = Campaign(
        sequences=tuple(tasks),
        particle=tuple(p for p, _ in groups),
        camera=tuple(c for _, c in groups),
        floor_px=configuration.floor_px,
        body_noise_px=configuration.body_noise_px,
        kind=SILHOUETTES,
    )
    start = CampaignState(tuple(flights), tuple(np.zeros(0) for _ in flights))
    return Registered(campaign, start, tuple(p for _, p, _ in particles.values()), tuple(left_out))


def _one(
    observation: Observation, particle: Particle, views: Views | None, configuration: Configuration
) -> tuple[SequenceTask, Flight, Views]:
    tracks = tracks_of(observation)
    sightings = usable_sightings(observation, tracks, configuration)
    pictures = pictures_of(observation, tracks, sightings)
    if views is None:
        views = views_like(particle, sightings.silhouettes, np.random.default_rng(configuration.seed), pictures)
    task = fit_task(observation, particle, sightings, views, configuration)
    stretch = _without_jump(task)
    candidates = candidate_flights(observation, stretch, particle, first_pose(stretch, particle, configuration), configuration)
    setting = Setting(
        times_s=observation.clock.times_s,
        exposure_s=observation.clock.exposure_s,
        gravity_world=np.asarray(observation.gravity_world, dtype=np.float64),
        inertia_ratios=particle.body.inertia_ratios,
        edge_px=pictures.edge_px if pictures is not None else 0.0,
    )
    vertices = (particle.hull.vertices - particle.body.com_particle) @ particle.body.R_particle_body
    flight = candidates[0].solution.state
    tables = OutlineTables(particle, views, bias_pairs(observation, configuration), configuration.seed, pictures)
    sequence = SequenceTask(observation.name, task, setting, rim_of(vertices), outline_shape([]), tables)
    return with_tables(sequence, flight, Model(), np.zeros(0)), flight, views


def _without_jump(task: FitTask) -> FitTask:
    """The task without the sightings beyond a jump; those of several cameras are left as they are."""
    sightings = task.sightings
    if len(sightings.cameras) > 1:
        return task
    silhouettes = sightings.silhouettes
    centres = np.array([_centre_px(silhouettes.points_px[silhouettes.slice_of(i)]) for i in range(len(sightings))])
    rows = longest_stretch(centres, sightings.times_s)
    return task if rows == slice(0, len(sightings)) else restricted(task, np.arange(len(sightings))[rows])


def _centre_px(polygon: Array) -> tuple[float, float]:
    centre = shapely.Polygon(polygon).centroid
    return float(centre.x), float(centre.y)


def _digest(views: Sequence[CalibratedView]) -> str:
    digest = hashlib.sha256()
    for view in views:
        digest.update(repr(view.intrinsics).encode())
        digest.update(np.ascontiguousarray(view.R_cam_particle).tobytes())
        digest.update(np.ascontiguousarray(view.t_cam_particle).tobytes())
    return digest.hexdigest()
