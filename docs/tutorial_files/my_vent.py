"""Vent: a thrust that turns with the particle, as of a comet that gives off gas on one side.

In --effects write ./my_vent.py:Vent
"""

import numpy as np

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import Array, EffectModel, Moment, Setting


class Vent(EffectModel):
    """A thrust that is fixed to the body."""

    entry = EffectEntry(
        "vent",
        Stage.DYNAMICS,
        Scope.PARTICLE,
        (
            Parameter("a1", "m/s2", (-50.0, 50.0), 1e-2, "thrust over mass along body axis 1"),
            Parameter("a2", "m/s2", (-50.0, 50.0), 1e-2, "thrust over mass along body axis 2"),
            Parameter("a3", "m/s2", (-50.0, 50.0), 1e-2, "thrust over mass along body axis 3"),
        ),
        "dv/dt = g + R_world_body a",
        "Marsden, Sekanina and Yeomans, Astron. J. 78 (1973) 211",
    )

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """Acceleration (m, 3) m/s², world frame, of m flights; moment.R turns body axes into the world's."""
        del setting
        return np.einsum("mij,mj->mi", moment.R, theta)
