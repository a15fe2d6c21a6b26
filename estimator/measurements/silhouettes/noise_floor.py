"""Is there anything to explain in a campaign of silhouettes? Tangency errors against what changes from frame to frame.

An outline's own noise is new in every frame, so half the mean square of the change of one view's tangency is noise whatever the model
[von Neumann 1941]. The calibrated views' noise and the body-fixed error repeat over many frames and add their share: ``allowed`` is what
they may bring. The noise that neighbouring samples of the outlines let expect is a second judge: it is about 20% too large in recordings
where nothing is missing, and where frames change by more than that, whole frames jump (a trigger that jitters), which successive
differences cannot tell from noise.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from estimator.appearance.model_errors import SequenceTask
from estimator.diagnosis.noise_floor import LAGS, NoiseFloor, Sums, floor_of
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, SequenceEquations
from estimator.likelihood.noise_model import measured_noise

Array = NDArray[np.float64]
OWN_TOO_LARGE = 0.8
"""Standard deviation found over the one that neighbouring samples let expect, in recordings where nothing is missing."""
JUMPS = 0.95
"""Above this ratio of standard deviations frames change by more than their outlines' noise."""


def silhouette_floor(campaign: Campaign, fit: CampaignFit, rng: np.random.Generator) -> NoiseFloor:
    """Judge the residuals of a fit to silhouettes."""
    floor = floor_between_frames(campaign, fit, rng)
    own = _own(campaign, fit)
    neighbours, repeated = float(np.sqrt(own)), floor.repeated_px
    along, expected = _along(campaign, fit)
    return replace(
        floor,
        neighbours_px=neighbours,
        floor_px=min(repeated, OWN_TOO_LARGE * neighbours),
        jumps=repeated > JUMPS * neighbours,
        allowed=1.0 + (max(_expected(fit) - own, 0.0) + campaign.body_noise_px**2) / max(repeated**2, 1e-12),
        along_outline_rad=along,
        expected_along_rad=expected,
    )


def floor_between_frames(campaign: Campaign, fit: CampaignFit, rng: np.random.Generator, *, alike: float = 1.0) -> NoiseFloor:
    """The floor of residuals at places of outlines, whichever they are, whose noise is ``alike`` over so many frames, new in every one."""
    new = 2.0 / (alike + 1.0)  # 1 - rho, share of the variance that changes from one frame to the next
    sums = [_sums(sequence, each) for sequence, each in zip(campaign.sequences, fit.equations, strict=True)]
    sums = [replace(each, change=each.change / new) for each in sums]
    return floor_of(sums, _autocorrelation(campaign, fit), rng)


def _own(campaign: Campaign, fit: CampaignFit) -> float:
    """Mean variance (px²) that neighbouring samples of the outlines let expect."""
    found = []
    for sequence, each in zip(campaign.sequences, fit.equations, strict=True):
        silhouettes = sequence.task.sightings.silhouettes
        vertex = np.maximum(silhouettes.offsets[:-1, None, None] + each.errors.tangency.tangency[:, :, :2], 0)
        found.append(silhouettes.sigma_px[np.minimum(vertex, len(silhouettes.sigma_px) - 1)][each.errors.seen] ** 2)
    return float(np.mean(np.concatenate(found)))


def _expected(fit: CampaignFit) -> float:
    """Mean variance (px²) of the residuals that outlines and calibrated views let expect."""
    return float(np.mean(np.concatenate([each.errors.tangency.variance[:, :, :2][each.errors.seen] for each in fit.equations])))


def _ordered(sequence: SequenceTask, step: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Sightings of one camera that are ``step`` frames apart: the earlier and the later ones."""
    sightings = sequence.task.sightings
    number = {(int(c), int(f)): i for i, (c, f) in enumerate(zip(sightings.camera, sightings.frame, strict=True))}
    pairs = [(i, number[c, f + step]) for (c, f), i in number.items() if (c, f + step) in number]
    rows = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    return rows[:, 0], rows[:, 1]


def _sums(sequence: SequenceTask, each: SequenceEquations) -> Sums:
    e, seen = (values.reshape(len(values), -1) for values in (each.errors.e, each.errors.seen))
    first, second = _ordered(sequence, 1)
    both = seen[first] & seen[second]

    def summed(pairs: Array) -> Array:
        return np.bincount(first, np.where(both, pairs, 0.0).sum(axis=1), len(e)).astype(np.float64)

    change, product = summed(0.5 * (e[second] - e[first]) ** 2), summed(e[second] * e[first])
    return Sums((e**2).sum(axis=1), seen.sum(axis=1).astype(np.float64), change, product, summed(np.ones(both.shape)))


def _autocorrelation(campaign: Campaign, fit: CampaignFit) -> Array:
    """Correlation (l,) of the residuals of one place with those ``LAGS`` frames later."""
    result = np.full(len(LAGS), np.nan)
    square = sum(float((each.errors.e**2).sum()) for each in fit.equations) / max(sum(int(e.errors.seen.sum()) for e in fit.equations), 1)
    for k, lag in enumerate(LAGS):
        product, pairs = 0.0, 0
        for sequence, each in zip(campaign.sequences, fit.equations, strict=True):
            first, second = _ordered(sequence, int(lag))
            both = each.errors.seen[first] & each.errors.seen[second]
            product += float((each.errors.e[first] * each.errors.e[second])[both].sum())
            pairs += int(both.sum())
        if pairs:
            result[k] = product / pairs / max(square, 1e-12)
    return result


def _along(campaign: Campaign, fit: CampaignFit) -> tuple[float, float]:
    """Turn of the tangent over which residuals, and the noise of the outlines, are alike (rad)."""
    found, expected = [], []
    for sequence, each in zip(campaign.sequences, fit.equations, strict=True):
        tangency = each.errors.tangency
        error = np.concatenate([each.errors.e, tangency.error[:, :, 2:]], axis=2)
        found.append(measured_noise(replace(tangency, error=error)).correlation_rad)
        expected.append(float(np.median(sequence.task.sightings.silhouettes.correlation_rad)))
    return float(np.median(found)), float(np.median(expected))
