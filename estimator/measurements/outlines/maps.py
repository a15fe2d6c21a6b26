"""Where a model of outlines fails sample by sample: the mean residuals of sectors, as tangency errors are looked at.

Noise is new in each sector, alike over a few frames, and its size is known. Whole frames may scatter by more, as under a trigger that
jitters, so standard errors are clustered by frame; a bin of few frames says little of that, so its clusters count beside the mean of all
bins [Pan, Biometrika 88 (2001) 901].
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from estimator.diagnosis.residual_maps import Axis, ResidualMap
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit
from estimator.measurements.silhouettes.map_axes import outline_axes
from estimator.measurements.silhouettes.residual_maps import Mapped, frames_of, summed

Array = NDArray[np.float64]
Index = NDArray[np.int64]
LIKE_ALL = 30.0
"""Frames whose scatter is taken to be that of all bins, beside a bin's own: clusters of ten frames alone made maps of noise show something
in a third of campaigns."""


def outline_maps(campaign: Campaign, fit: CampaignFit) -> tuple[ResidualMap, ...]:
    """All maps of a fit, in pixels, those that show most first."""
    errors = [each.errors for each in fit.equations]
    e = np.concatenate([(each.e * np.sqrt(each.variance))[each.seen] for each in errors])
    u = np.concatenate([each.places.normal[:, :, 0][each.seen] for each in errors])
    alike = [np.full(int(each.seen.sum()), sequence.alike) for each, sequence in zip(errors, campaign.sequences, strict=True)]
    shared = _Frames(frames_of(fit), np.concatenate([each.variance[each.seen] for each in errors]), np.concatenate(alike))
    return Mapped(e, u, outline_axes(campaign, fit), shared).maps


@dataclass(frozen=True)
class _Frames:
    """Residuals (r,) with noise of their own of ``variance`` (r,) px², ``alike`` (r,) over so many frames, that share their ``frame``.

    What comes back in several frames is the body's, whose surface is fitted.
    """

    frame: Index
    variance: Array
    alike: Array

    def covariance(self, influence: Array, residual: Array, axis: Axis) -> Array:
        """Covariance (b, b) of means; ``influence`` (b, r) on them of what is left of each ``residual`` (r,) px."""
        del axis
        felt = influence * np.sqrt(self.alike)
        own, noise = summed(felt * residual, self.frame), summed(felt**2 * self.variance, self.frame)
        there = noise > 0.0
        scatter = max(float(np.mean(own[there] ** 2 / noise[there])), 1.0)
        share = there.sum(axis=1) / (there.sum(axis=1) + LIKE_ALL)
        own *= np.sqrt(share)[:, None]
        return np.asarray(own @ own.T + np.diag((1.0 - share) * scatter * noise.sum(axis=1)))
