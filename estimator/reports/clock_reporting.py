"""What is told of the clocks of further cameras that were fitted with a flight."""

from dataclasses import replace
from typing import Any

import numpy as np

from datasets.estimate import Estimate
from datasets.observation import Observation
from estimator.effects.instrument.uncertain_clock import UncertainClock
from estimator.fitting.campaigns.campaign import CampaignFit
from estimator.fitting.campaigns.campaign_covariance import CampaignCovariance
from estimator.fitting.refinement import Refined
from estimator.motion.clocked import OFFSET_S, RATE, named
from estimator.motion.flight import Motion

KEYS = {"offset": "offset_s", "rate": "rate"}


def clock_statistics(refined: Refined[Motion], observation: Observation) -> dict[str, dict[str, float]]:
    """By camera, what its clock is off by: offset (s), rate, the standard deviation of each, and that stated beforehand."""
    labels, values = refined.flight.layout.labels, refined.flight.values
    told: dict[str, dict[str, float]] = {}
    for camera, clock in zip(observation.cameras, observation.clocks, strict=True):
        for what, key, stated in ((OFFSET_S, "offset_s", clock.offset_sigma_s), (RATE, "rate", clock.rate_sigma)):
            if named(camera.name, what) in labels:
                k = labels.index(named(camera.name, what))
                sigma = float(np.sqrt(refined.covariance[k, k]))
                told.setdefault(camera.name, {}).update({key: float(values[k]), f"{key}_sigma": sigma, f"{key}_stated_sigma": stated})
    return told


def clocks_of_campaign(fit: CampaignFit, number: int, covariance: CampaignCovariance) -> dict[str, dict[str, float]]:
    """The same of the recording of sequence ``number`` of a campaign."""
    told: dict[str, dict[str, float]] = {}
    for effect, part in zip(fit.model.effects, fit.model.slices, strict=True):
        if isinstance(effect, UncertainClock):
            sigmas = np.sqrt(np.diag(covariance.of(number, fit.model.layout.columns([effect.entry.key]))))
            told[effect.name] = {}
            for name, value, sigma, stated in zip(effect.entry.names, fit.state.theta[number][part], sigmas, effect.held, strict=True):
                key = KEYS[name]
                told[effect.name] |= {key: float(value), f"{key}_sigma": float(sigma), f"{key}_stated_sigma": stated}
    return told


def clock_sentences(told: dict[str, dict[str, Any]]) -> list[str]:
    """The same in words."""
    return [_sentence(name, each) for name, each in told.items()]


def _sentence(name: str, told: dict[str, Any]) -> str:
    parts = []
    if "offset_s" in told:
        parts.append(f"{1e6 * told['offset_s']:.2f} ± {1e6 * told['offset_s_sigma']:.2f} µs later than stamped")
    if "rate" in told:
        parts.append(f"at intervals longer by {1e6 * told['rate']:.1f} ± {1e6 * told['rate_sigma']:.1f} parts in a million")
    return f"Frames of {name} were taken {' and '.join(parts)}, by the clock of the first camera."


def with_clocks_as_stamped(estimate: Estimate, observation: Observation) -> Estimate:
    """The estimate; where it has impacts, with which clocks are not fitted, and some are not known, its message says so."""
    names = [camera.name for camera, clock in zip(observation.cameras, observation.clocks, strict=True) if not clock.known]
    if not names or not estimate.impacts:
        return estimate
    said = f"The stamps of {', '.join(names)} were taken as they are: with impacts the offset of a clock is not fitted."
    return replace(estimate, message=f"{estimate.message} {said}".strip())
