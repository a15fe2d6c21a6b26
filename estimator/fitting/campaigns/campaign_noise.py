"""Noise that enters many sightings of a campaign at once: of the calibrated views, and of the body-fixed error."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.model_errors import ModelErrors
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.system import Arrangement, Index
from estimator.likelihood.body_fixed_error import BodyPlaces, body_places, field_product, measured_variance, on_body
from estimator.likelihood.composite_likelihood import Weighted, noise_of_views
from estimator.likelihood.correlated_sums import AlongOutlines

Array = NDArray[np.float64]
PARTS = 5
"""Of a sequence whose errors are compared with one another."""
TAKEN_UP = 1.5
"""True size of the body-fixed error over the measured one: the fit takes up part of it. From campaigns with nothing hidden (notebook 9)."""
LEAST_PX, MOST_PX = 0.03, 0.15
"""Between them campaigns with nothing hidden lie (notebook 9)."""
INEXACT = 0.1
"""Share of a displacement of the outline that its reduced model may leave, at corners and on spikes, and that counts as body-fixed.

See notebook 10."""


def repeated_noise(
    campaign: Campaign,
    errors: Sequence[ModelErrors],
    frames: Sequence[Weighted],
    at: Arrangement,
    like: Sequence[ModelErrors] | None = None,
) -> Array:
    """What views and the body add to the covariance (p, p) of ``sum weightedᵀ e`` of ``frames`` (s,), whose columns lie ``at`` places.

    ``like`` [sequence]: errors of another fit, of which the body-fixed part is measured; these ``errors`` if ``None``.
    """
    total = np.zeros((at.p, at.p))
    for particle in sorted(set(campaign.particle)):
        rows = [i for i, p in enumerate(campaign.particle) if p == particle]
        noise = _of_particle(campaign, [errors[i] for i in rows], rows[0], None if like is None else [like[i] for i in rows])
        flat, places = [_flat(frames[i].weighted) for i in rows], [at.places[i] for i in rows]
        if all(np.array_equal(place, places[0]) for place in places):
            flat, places = [np.concatenate(flat)], places[:1]
        noise.add(total, flat, places)
    return total + total.T


def _flat(weighted: Array) -> Array:
    """Of (n, k, 2, c), (2 n k, c)."""
    return weighted.reshape(-1, weighted.shape[-1])


@dataclass(frozen=True)
class _Noise:
    """Noise of the errors (r,) of one particle: along the outlines of its ``views``, and of ``sigma_px`` where errors lie on the body."""

    views: AlongOutlines
    body: BodyPlaces
    sigma_px: float

    def add(self, total: Array, weighted: Sequence[Array], places: Sequence[Index]) -> None:
        """Add half of what it makes of ``sum weightedᵀ e``, in parts that follow one another, whose columns lie at their ``places``.

        A part's ``weighted`` (r, c) has none of the others' errors and columns: no array is as long and as wide as those of all.
        """
        ends = np.cumsum([0, *(len(each) for each in weighted)]).tolist()
        spans, cells = [slice(*span) for span in pairwise(ends)], self.body.cell.ravel()
        field = np.zeros((self.body.grid.normals, self.body.grid.viewing, len(total)))
        for span, each, place in zip(spans, weighted, places, strict=True):
            field[..., place] += on_body(cells[span], each)
            alone = np.zeros((ends[-1], each.shape[1]))
            alone[span] = each
            moved = self.views.half(alone)
            for others, other, there in zip(spans, weighted, places, strict=True):
                total[np.ix_(there, place)] += other.T @ moved[others]
        total += 0.5 * self.sigma_px**2 * field_product(field)


def _of_particle(campaign: Campaign, errors: Sequence[ModelErrors], first: int, like: Sequence[ModelErrors] | None) -> _Noise:
    """That of one particle; ``first``: its first sequence, whose views all of it share."""
    joined = replace(
        errors[0].tangency,
        valid=np.concatenate([e.tangency.valid for e in errors]),
        tangency=np.concatenate([e.tangency.tangency for e in errors]),
        direction=np.concatenate([e.tangency.direction for e in errors]),
        jacobian=np.concatenate([e.tangency.jacobian for e in errors]),
    )
    places = places_of(errors)
    sigma_px = _of_body(campaign, errors, places) if like is None else _of_body(campaign, like, places_of(like))
    return _Noise(noise_of_views(joined, campaign.sequences[first].task.views.silhouettes), places, sigma_px)


def places_of(errors: Sequence[ModelErrors]) -> BodyPlaces:
    """Places on the body of the errors of sequences of one particle, one sequence after the other."""
    return body_places(np.concatenate([e.normals for e in errors]), np.concatenate([e.viewing for e in errors]))


def body_noise_px(campaign: Campaign, errors: Sequence[ModelErrors]) -> Array:
    """Body-fixed error (px) of every sequence's particle; ``errors`` [sequence]."""
    sigma = np.zeros(len(errors))
    for particle in sorted(set(campaign.particle)):
        rows = [i for i, p in enumerate(campaign.particle) if p == particle]
        own = [errors[i] for i in rows]
        sigma[rows] = _of_body(campaign, own, places_of(own))
    return sigma


def _of_body(campaign: Campaign, errors: Sequence[ModelErrors], places: BodyPlaces) -> float:
    """Body-fixed error (px) of one particle at ``places``: as the campaign is told, or measured where several sequences show it.

    A misfit makes errors of one sequence alike or unlike; between sequences it has no common place on the body. Both are tried and the
    larger counts: few sequences show the same places.
    """
    if len(errors) < 2:
        return campaign.body_noise_px
    valid, e = np.concatenate([x.tangency.valid for x in errors]), np.concatenate([x.e for x in errors])
    weight = np.concatenate([1.0 / (x.tangency.variance[:, :, :2] + campaign.floor_px**2) for x in errors])
    sequence = np.repeat(np.arange(len(errors)), [len(x.e) for x in errors])
    part = np.concatenate([np.arange(len(x.e)) * PARTS // len(x.e) for x in errors])
    variance = max(measured_variance((valid, e, weight), places, block) for block in (sequence, sequence * PARTS + part))
    shift = np.concatenate([x.shift[x.seen] for x in errors])
    most = np.hypot(MOST_PX, INEXACT * np.sqrt(np.mean(shift**2)) if len(shift) else 0.0)
    return float(np.clip(TAKEN_UP * np.sqrt(max(variance, 0.0)), LEAST_PX, most))
