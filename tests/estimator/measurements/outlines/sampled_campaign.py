"""The small campaign with every outline sample in use, its surface coarse: residuals are those of noise."""

from functools import cache

from estimator.data.configuration import Configuration
from estimator.effects.choosing import catalogue
from estimator.fitting.campaigns.base_model import base_fit
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.registered import Registered
from estimator.measurements.outlines.registration import by_samples
from tests.estimator import small_campaign

COARSE = 4


@cache
def registered() -> Registered:
    effects = [catalogue()[key] for key in ("linear_drag", "quadratic_drag", "outline_offset", "frame_rate", "radial_distortion")]
    return by_samples(small_campaign.registered(), effects, Configuration(campaign_surface_fit=2), subdivisions=COARSE)


@cache
def fitted() -> CampaignFit:
    return base_fit(registered().campaign, registered().start)
