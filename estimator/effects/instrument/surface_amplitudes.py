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
FURTHER_OFF = 1.75
"""How many times further than its covariance says, with the scale that frames show it to have, the surface moves what is fitted: faces
bulge out where no view sees it, all alike (notebook 66). Of 48 campaigns with nothing hidden 93.8 % of v and 95.3 % of omega were then
inside their 95 % ellipsoids, 88.0 and 91.7 % without, 97.9 and 98.4 % with 3."""


class SurfaceAmplitudes(EffectModel):
    """So many amplitudes."""

    instrument = True
    further_off = FURTHER_OFF

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
