"""From observation and settings to the task of a fit, and the last refinement as the settings ask for it."""

import math

import numpy as np

from datasets.observation import Frames, Observation
from estimator.appearance.predicted_bias import with_predicted_bias
from estimator.data.configuration import Configuration
from estimator.data.fit_task import FitTask, Prior, Sightings
from estimator.data.views import Views
from estimator.fitting.focal_flight import FocalFlight
from estimator.fitting.refinement import Refined, refine
from estimator.fitting.viewing_angles import with_clear_angles
from estimator.fitting.weighed_tangencies import Refinement
from estimator.motion.flight import Motion
from estimator.outlines.pictures.pictured import Pictures
from estimator.outlines.sightings import bias_pairs
from estimator.particle.particle import Particle

HOLLOW_MOMENTS, HOLLOW_PRODUCTS = 0.2, 0.08
"""Relative errors of the visual hull's moments and products of inertia over the empty share of its outlines' convex hulls.

Of 14 jagged bodies, 0.03 to 0.12 of it empty, moments were off by 0.019 and products by 0.0056; of 12 convex ones by 0.006 and 0.0023
(notebook 28)."""
HULL_COM, HULL_MOMENTS, HULL_PRODUCTS, HULL_VIEWS = 0.0039, 0.019, 0.012, 6
"""Errors of the visual hull of six views: centre of mass (share of the extent), moments and products (relative); k views: (6 / k)^(2/3).

RMS of 12 cut stones, where 12 views gave 0.0026, 0.0123, 0.0078 and 24 gave 0.0016, 0.0091, 0.0039. Priors are no narrower."""


def biased_task(
    observation: Observation,
    task: FitTask,
    particle: Particle,
    motion: Motion,
    configuration: Configuration,
    *,
    pictures: Pictures | None = None,
) -> FitTask:
    """The task with the outlines' bias predicted under a first fit; ``pictures``: how those of the sightings show outlines."""
    pairs, rng = bias_pairs(observation, configuration), np.random.default_rng(configuration.seed)
    return with_predicted_bias(task, particle, motion, pairs=pairs, rng=rng, pictures=pictures)


def refined_flight(task: FitTask, motion: Motion, configuration: Configuration) -> Refined[Motion]:
    """The last refinement, with the focal length among the parameters where the configuration says that it is not known.

    The noise is then read again once the focal length is about right.
    """
    settings = refinement_settings(configuration)
    task = with_clear_angles(task, motion)
    if configuration.focal_prior == 0.0:
        return refine(task, motion, settings)
    start = FocalFlight(motion.first, 0.0, configuration.focal_prior)
    return refine(task, refine(task, start, settings).flight, settings)


def refinement_settings(configuration: Configuration) -> Refinement:
    """What the last refinement needs of the configuration."""
    return Refinement(floor_px=configuration.floor_px, body_noise_px=configuration.body_noise_px, within_pairs=configuration.within_pairs)


def fit_task(observation: Observation, particle: Particle, sightings: Sightings, views: Views, configuration: Configuration) -> FitTask:
    """The fit's task: silhouettes, views and what holds the body and the outline offset."""
    measured = any(isinstance(r, Frames) for r in observation.recordings)
    fewer = (HULL_VIEWS / len(views.silhouettes)) ** (2.0 / 3.0)
    prior = Prior(
        com_m=max(configuration.com_prior, HULL_COM * fewer) * particle.extent_m,
        inertia=math.hypot(max(configuration.inertia_prior, HULL_MOMENTS * fewer), HOLLOW_MOMENTS * particle.hollow),
        inertia_products=math.hypot(max(configuration.inertia_products_prior, HULL_PRODUCTS * fewer), HOLLOW_PRODUCTS * particle.hollow),
        offset_px=configuration.frame_offset_prior_px if measured else configuration.offset_prior_px,
    )
    weight = np.ones((len(sightings), len(views.silhouettes)))
    return FitTask(sightings, views, prior, configuration.huber, weight)
