"""What kinds have in common whose rows have noise of their own, each sequence's known up to a factor: :mod:`estimator.likelihood.rows`."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations
from estimator.fitting.system import Arrangement
from estimator.likelihood.composite_likelihood import Weighted
from estimator.likelihood.rows import Density, Noisy, density, far_off, freedoms, marginal_squares, misfits, noise_scales

Array = NDArray[np.float64]


class OwnNoise:
    """Those parts of a :class:`estimator.fitting.campaigns.measurement_kind.MeasurementKind` that rest on such noise alone."""

    unit = "σ"

    def ended(self, campaign: Campaign, fit: CampaignFit) -> tuple[Campaign, CampaignState]:
        """Nothing is made of it."""
        return campaign, fit.state

    def repeated_noise(
        self, campaign: Campaign, errors: Sequence[Any], frames: Sequence[Weighted], at: Arrangement, like: Sequence[Any] | None = None
    ) -> Array:
        """None: what repeats is among the parameters."""
        del campaign, errors, frames, like
        return np.zeros((at.p, at.p))

    def only(self, sequence: Any, kept: NDArray[np.bool_]) -> Any:
        """Other sightings have no residuals."""
        return replace(sequence, kept=sequence.kept & kept)

    def noise_scales(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> Array | None:
        """Where a sequence's residuals are larger than all others', as of a hand or a bad track, its noise is larger, not the effects."""
        return noise_scales(misfits(campaign.sequences, equations), freedoms(campaign.sequences, equations))

    def noise_of(self, sequence: Noisy) -> float:
        """As it is in the sequence's standard deviations."""
        return sequence.noise

    def density(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> Density:
        """Each sequence's noise integrated."""
        of = campaign.sequences, equations
        return density(equations, misfits(*of), freedoms(*of), far_off(*of))

    def squares(self, equations: Sequence[SequenceEquations]) -> float:
        """Of what random shifts of the sightings' times do not explain."""
        return sum(marginal_squares(each) for each in equations)

    def noise_ratio(self, campaign: Campaign, equations: Sequence[SequenceEquations]) -> float:
        """One: the noise is stated, estimated from the rows themselves or found with the fit."""
        del campaign, equations
        return 1.0
