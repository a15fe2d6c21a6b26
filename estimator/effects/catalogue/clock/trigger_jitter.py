"""Frames taken at random times about their stamps: a random effect with standard deviation sigma [Laird and Ware 1982].

It shifts every outline along the particle's motion; as a model it gives each sighting a time shift of its own, held near zero by sigma. It
touches no link: the fit knows it as variance (:mod:`estimator.likelihood.time_shifts`).

``t_i = t_nominal_i + sigma N(0, 1)``. Valid for times that are independent from frame to frame and short against a turn.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import EffectModel


class TriggerJitter(EffectModel):
    """Independent random errors of the time stamps."""

    entry = EFFECTS["trigger_jitter"]
    random = True
