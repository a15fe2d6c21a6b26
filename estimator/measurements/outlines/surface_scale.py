"""A campaign with the surfaces of its particles as uncertain as its frames show them to be (:mod:`estimator.surface.surface_scale`)."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState
from estimator.fitting.campaigns.campaign_covariance import campaign_covariance
from estimator.measurements.outlines.task import amplitudes_in
from estimator.motion.flight import N_PARAMETERS
from estimator.surface.surface_scale import scale_of

Array = NDArray[np.float64]


def with_surface_scale(campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignState]:
    """The campaign with the amplitudes of each particle's surface as large as they most probably are, and a fit's state in them."""
    part = amplitudes_in(fit.model)
    covariance = campaign_covariance(campaign, fit)
    columns = N_PARAMETERS + np.arange(part.start, part.stop)
    sequences, thetas = list(campaign.sequences), list(fit.state.theta)
    for number in sorted(set(campaign.particle)):
        rows = [i for i, p in enumerate(campaign.particle) if p == number]
        amplitude = thetas[rows[0]][part]
        precision = np.linalg.inv(covariance.of(rows[0], columns))
        scale = scale_of(precision - np.eye(len(amplitude)), precision @ amplitude)
        amplitudes = sequences[rows[0]].amplitudes.scaled(scale)
        for i in rows:
            task, theta = sequences[i], thetas[i].copy()
            contacts = task.contacts
            theta[part] /= scale
            contacts = replace(contacts, by_amplitude=contacts.by_amplitude * scale, amplitude=contacts.amplitude / scale)
            setting = replace(task.setting, mass=amplitudes.mass)
            sequences[i], thetas[i] = replace(task, amplitudes=amplitudes, contacts=contacts, setting=setting), theta
    return replace(campaign, sequences=tuple(sequences)), CampaignState(fit.state.flights, tuple(thetas))
