"""A centre of mass that is not that of the uniform body: its free flight makes the body's middle wobble [Goldstein 1980, ch. 5].

Moments about the displaced centre are taken as those of the uniform body, since a density that displaces the centre is not known
further.

``com = com_uniform + c``, body axes. Valid for displacements well below the body's size.
"""

import numpy as np

from datasets.vocabulary.effects import EFFECTS
from estimator.effects.link import Array, BodyChange, EffectModel, Setting


class CentreOfMass(EffectModel):
    """Displacement of the centre of mass along the principal axes."""

    entry = EFFECTS["centre_of_mass"]

    def body(self, theta: Array, setting: Setting) -> BodyChange:
        """The displacement itself."""
        del setting
        return BodyChange(np.asarray(theta), np.zeros(5))
