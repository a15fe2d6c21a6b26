"""Nature's side of the catalogue of effects: each realised as it happens, not as an instrument would model it."""

from datasets.recipes.synth_only import SYNTH_ONLY
from synth.effects.in_force import EffectsInForce, effects_in_force
from synth.effects.links import FlightState, FlyingBody
from synth.effects.registry import REALISATIONS

__all__ = ["REALISATIONS", "SYNTH_ONLY", "EffectsInForce", "FlightState", "FlyingBody", "effects_in_force"]
