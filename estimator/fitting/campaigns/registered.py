"""A campaign that is ready to be fitted: where fits start, its particles, and what was left out."""

from dataclasses import dataclass

from estimator.fitting.campaigns.campaign import Campaign, CampaignState
from estimator.particle.particle import Particle


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
