"""The surface's own uncertainty: moves of a particle's surface that are shared by all its sequences, with a prior of one each.

Not an effect of nature but an unknown of the instrument, always in the model of outlines that are fitted sample by sample. What a move does
to the outlines stands with them (:mod:`estimator.measurements.outlines.contacts`); here is what it does to the body's mass properties.
"""

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import Array, BodyChange, EffectModel, Setting

STEP = 1e-2
"""Of derivatives, which are those of something linear."""
WIDEST = 6.0
"""Standard deviations that are plausible."""
SURFACE_OFF = 3.0
"""How many times further than its covariance says the surface moves a motion: edges are drawn by noise, too, and faces bulge out as far as
no view sees it, which no covariance about the end tells. Over 24 trial flights of 20 to 40 frames with 18 to 60 views it was 3.1 (smooth
2.5, stones 3.0, cut 4.3, jagged 2.4)."""


class SurfaceAmplitudes(EffectModel):
    """So many amplitudes."""

    instrument = True
    further_off = SURFACE_OFF

    def __init__(self, count: int) -> None:
        parameters = (Parameter(f"a{i}", "1", (-WIDEST, WIDEST), STEP, "amplitude of a move of the surface") for i in range(count))
        self.entry = EffectEntry(
            "surface_amplitudes",
            Stage.BODY,
            Scope.PARTICLE,
            tuple(parameters),
            "corners of the surface = those that the views show + moves times amplitudes",
            "Triggs et al., Bundle adjustment, 2000, section 6",
        )
        self.held = (1.0,) * count

    def body(self, theta: Array, setting: Setting) -> BodyChange:
        """Mass properties of the surface, where it is known."""
        if setting.mass is None:
            return super().body(theta, setting)
        change = setting.mass[:, 0] + setting.mass[:, 1:] @ theta
        return BodyChange(change[:3], change[3:])

    def body_by(self, theta: Array, setting: Setting) -> Array:
        """Of the surface's mass properties."""
        return super().body_by(theta, setting) if setting.mass is None else setting.mass[:, 1:]
