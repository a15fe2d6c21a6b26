"""Noise that enters many sightings of a campaign at once: of the calibrated views, and of the body-fixed error."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.campaign import Campaign
from estimator.fitting.composite_likelihood import body_cells, body_noise, shared_view_noise
from estimator.fitting.model_errors import ModelErrors

Array = NDArray[np.float64]


def repeated_noise(campaign: Campaign, errors: Sequence[ModelErrors], weighted: Sequence[Array]) -> Array:
    """What views and the body add to the covariance (p, p) of ``sum weightedᵀ e``; ``weighted`` [sequence] (n, k, 2, p)."""
    total = np.zeros((weighted[0].shape[-1],) * 2)
    for particle in sorted(set(campaign.particle)):
        rows = [i for i, p in enumerate(campaign.particle) if p == particle]
        total += _of_particle(campaign, rows, [errors[i] for i in rows], [weighted[i] for i in rows])
    return total


def _of_particle(campaign: Campaign, rows: Sequence[int], errors: Sequence[ModelErrors], weighted: Sequence[Array]) -> Array:
    joined = replace(
        errors[0].tangency,
        valid=np.concatenate([e.tangency.valid for e in errors]),
        tangency=np.concatenate([e.tangency.tangency for e in errors]),
        direction=np.concatenate([e.tangency.direction for e in errors]),
        jacobian=np.concatenate([e.tangency.jacobian for e in errors]),
    )
    W = np.concatenate(weighted)
    cells = body_cells(np.concatenate([e.normals for e in errors]), np.concatenate([e.viewing for e in errors]))
    views = campaign.sequences[rows[0]].task.views.silhouettes
    return shared_view_noise(joined, W, views) + body_noise(joined, W, cells, sigma_px=campaign.body_noise_px)
