"""Air that moves: drag and lift depend on the velocity through the air, ``u = v - w`` [Hoerner 1965, ch. 1].

It acts through the drag and the lift that are in the model and does nothing alone. Valid for a wind that is the same everywhere and steady
over a campaign.
"""

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, EffectModel


class SteadyWind(EffectModel):
    """A constant velocity of the air."""

    entry = EFFECTS["steady_wind"]

    def air(self, theta: Array) -> Array | None:
        """The wind itself."""
        return theta
