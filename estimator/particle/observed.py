"""The particle of an observation."""

from datasets.observation import Observation
from estimator.data.configuration import Configuration
from estimator.outlines.recording import view_outlines_of
from estimator.particle.particle import Particle, particle_of


def observed_particle(observation: Observation, configuration: Configuration) -> Particle:
    """The particle as the calibrated views show it."""
    seen = view_outlines_of(observation.view_recording, observation.views, name=f"{observation.name}, calibrated views")
    return particle_of(seen.outlines, observation.views, configuration, observation.made)
