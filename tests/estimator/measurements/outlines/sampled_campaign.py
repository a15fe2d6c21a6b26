"""The small campaign with every outline sample in use, its surface coarse: residuals are those of noise."""

from functools import cache
from typing import Any

import pytest

from estimator.data.configuration import Configuration
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.outlines import registration
from estimator.particle.particle import Particle
from estimator.surface.shape import Shape, shape_of
from tests.estimator import small_campaign

COARSE = 4


@cache
def registered() -> Registered:
    def coarse(particle: Particle, **named: Any) -> Shape:
        return shape_of(particle, **named, subdivisions=COARSE)

    effects = [catalogue()[key] for key in ("linear_drag", "quadratic_drag", "outline_offset", "frame_rate", "radial_distortion")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(registration, "made_shape", coarse)
        return registration.by_samples(small_campaign.registered(), effects, Configuration(campaign_surface_fit=1))


@cache
def fitted() -> CampaignFit:
    return base_fit(registered().campaign, registered().start)
