"""What a campaign has to know of its measurements, whatever they are: the one place where silhouettes and trajectories differ.

A campaign is of one kind. Its sequences are data of a type that only the kind knows; solver, tests and judgements work on what the kind
makes of them: linear equations in the parameters of the flight and the effects, with the noise in them.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from estimator.effects.link import EffectModel
from estimator.effects.model import Model
from estimator.motion.flight import Flight

if TYPE_CHECKING:
    from estimator.fitting.campaign import Campaign, SequenceEquations
    from estimator.fitting.time_shifts import TimeShifts

Array = NDArray[np.float64]


class MeasurementKind(Protocol):
    """What one kind of measurement makes of its sequences."""

    @property
    def unit(self) -> str:
        """The unit of residuals."""
        ...

    @property
    def base(self) -> Model:
        """Free flight with what is known of the instrument."""
        ...

    def equations(self, campaign: "Campaign", number: int, flight: Flight, model: Model, theta: Array) -> "SequenceEquations":
        """Sequence ``number`` linearised in its 21 + q parameters."""
        ...

    def precision(self, sequence: Any) -> Array:
        """Information (21,) that is there of the flight's parameters beside the measurement."""
        ...

    def cost(self, sequence: Any, equations: "SequenceEquations") -> float:
        """Robust cost on the scale of minus the logarithm of a likelihood."""
        ...

    def repeated_noise(self, campaign: "Campaign", errors: Sequence[Any], weighted: Sequence[Array]) -> Array:
        """Covariance (p, p) of ``sum weightedᵀ e`` from noise that enters more than one sighting."""
        ...

    def sightings(self, sequence: Any) -> int:
        """Number of sightings, the rows of residuals."""
        ...

    def only(self, sequence: Any, kept: NDArray[np.bool_]) -> Any:
        """The sequence with the sightings ``kept`` (n,) alone carrying weight."""
        ...

    def time_shifts(self, campaign: "Campaign", number: int, equations: "SequenceEquations") -> "TimeShifts":
        """Shifts of the sightings' times, in the order of time."""
        ...

    def independent(self, campaign: "Campaign") -> float:
        """Roughly how many independent numbers were measured, for penalties."""
        ...

    def why_not(self, campaign: "Campaign", effect: EffectModel) -> str | None:
        """Why an effect does not apply to such measurements; ``None``: it does."""
        ...

    def adapted(self, effect: EffectModel) -> EffectModel:
        """The effect with the values that are plausible for such measurements."""
        ...
