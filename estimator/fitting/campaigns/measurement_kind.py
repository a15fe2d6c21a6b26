"""What a campaign has to know of its measurements, whatever they are: the one place where silhouettes and trajectories differ.

A campaign is of one kind. Its sequences are data of a type that only the kind knows; solver, tests and judgements work on what the kind
makes of them: linear equations in the parameters of the flight and the effects, with the noise in them.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from datasets.estimate import FrameReport
from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.fitting.system import Arrangement
from estimator.likelihood.composite_likelihood import Weighted
from estimator.likelihood.rows import Density
from estimator.motion.flight import Flight

if TYPE_CHECKING:
    from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations
    from estimator.likelihood.time_shifts import TimeShifts

Array = NDArray[np.float64]


class MeasurementKind(Protocol):
    """What one kind of measurement makes of its sequences.

    ``theta`` (q,) are the model's parameters, ``weighted`` (n, ..., p) the weighed derivatives of each sequence.
    """

    @property
    def unit(self) -> str:
        """The unit of residuals."""

    @property
    def base(self) -> Model:
        """Free flight with what is known of the instrument."""

    def residuals(self, campaign: "Campaign", number: int, flight: Flight, model: Model, theta: Array) -> Any:
        """What is left of sequence ``number`` under a model: ``e`` (n, ...), zero where there is none, and ``seen`` (n, ...)."""

    def equations(self, campaign: "Campaign", number: int, residuals: Any, model: Model, theta: Array) -> "SequenceEquations":
        """Sequence ``number`` linearised in its 21 + q parameters, where it has these ``residuals``."""

    def precision(self, sequence: Any) -> Array:
        """Information (21,) that is there of the flight's parameters beside the measurement."""

    def cost(self, sequence: Any, residuals: Any) -> float:
        """Robust cost on the scale of minus the logarithm of a likelihood, not negative."""

    def repeated_noise(
        self, campaign: "Campaign", errors: Sequence[Any], frames: Sequence[Weighted], at: Arrangement, like: Sequence[Any] | None = None
    ) -> Array:
        """Covariance (p, p) of ``sum weightedᵀ e`` from noise that enters more than one sighting; as large as in ``like``, if given.

        ``frames`` (s,) of the sequences, in parameters that lie ``at`` their places among p.
        """

    def sightings(self, sequence: Any) -> int:
        """Number of sightings, the rows of residuals."""

    def only(self, sequence: Any, kept: NDArray[np.bool_]) -> Any:
        """The sequence with the sightings ``kept`` (n,) alone carrying weight."""

    def followed(self, sequence: Any, flight: Flight, model: Model, theta: Array) -> Any:
        """The sequence with all that was made of it at an earlier flight made at this one; itself where nothing changes."""

    def relinearised(self, campaign: "Campaign", fit: "CampaignFit") -> "tuple[Campaign, CampaignState]":
        """The campaign with what its sequences share and no parameter says made at a fit whose model lacks nothing; itself if nothing."""

    def ended(self, campaign: "Campaign", fit: "CampaignFit") -> "tuple[Campaign, CampaignState]":
        """The campaign with what its sequences have of errors of their own beside all that a search has found; itself if nothing."""

    def noise_scales(self, campaign: "Campaign", equations: Sequence["SequenceEquations"]) -> Array | None:
        """Noise of every sequence (s,) over what its model says, most probable given its residuals; ``None``: one for all, by scores."""

    def noise_of(self, sequence: Any) -> float:
        """The sequence's noise over what its model says."""

    def misses(self, sequence: Any, mean_square: float) -> float:
        """How many times the noise that measurements show without a fit the residuals are, of whose whitened squares this is the mean."""

    def with_noise(self, sequence: Any, noise: float) -> Any:
        """The sequence with noise ``noise`` times what its model says."""

    def density(self, campaign: "Campaign", equations: Sequence["SequenceEquations"]) -> Density:
        """The density of all residuals, each sequence's noise integrated."""

    def squares(self, equations: Sequence["SequenceEquations"]) -> float:
        """Weighted sum of squares of all errors, what is drawn anew in every frame integrated."""

    def hollow(self, sequence: Any) -> float:
        """How much of the convex hulls of a body's outlines is empty, 0 where there are none."""

    def time_shifts(self, campaign: "Campaign", number: int, equations: "SequenceEquations") -> "tuple[TimeShifts, ...]":
        """Shifts of the sightings' times, those of each camera in the order of time."""

    def noise_ratio(self, campaign: "Campaign", equations: Sequence["SequenceEquations"]) -> float:
        """Noise of the sightings over what its model says, 1 at least."""

    def why_not(self, campaign: "Campaign", effect: EffectModel) -> str | None:
        """Why an effect does not apply to such measurements; ``None``: it does."""

    def noise_floor(self, campaign: "Campaign", fit: "CampaignFit", rng: np.random.Generator) -> Any:
        """Whether residuals are larger than noise: a :class:`estimator.diagnosis.noise_floor.NoiseFloor`."""

    def residual_maps(self, campaign: "Campaign", fit: "CampaignFit") -> Any:
        """Where they are: a tuple of :class:`estimator.diagnosis.residual_maps.ResidualMap`, those that show most first."""

    def imagination(self, campaign: "Campaign", number: int, fit: "CampaignFit", particles: Sequence[Any]) -> Any:
        """How sequences like ``number`` are imagined: an :class:`estimator.diagnosis.imagined_sequences.Imagination`."""

    def statistics(self, equations: "SequenceEquations") -> dict[str, Any]:
        """Figures of one sequence's residuals, for its estimate."""

    def frame_reports(self, sequence: Any, observation: Any, equations: "SequenceEquations") -> tuple[FrameReport, ...]:
        """What became of every frame of what the sequence was made from."""

    def unmeasured(self, sequence: Any) -> NDArray[np.int64]:
        """The flight's parameters that the sequence says nothing of and nobody states."""

    def adapted(self, effect: EffectModel) -> EffectModel:
        """The effect with the values that are plausible for such measurements."""
