"""The particle is not homogeneous: its principal moments differ from the uniform body's, its principal axes do not.

``I1 (1 + e1), I2 (1 + e2), I3`` about the axes of the uniform body, in their order [Goldstein, Classical Mechanics (1980), ch. 5]. No body
has a moment larger than the sum of the other two; such sizes are refused.

``I = (I1 (1 + e1), I2 (1 + e2), I3)``. Valid for rigid bodies.
"""

from dataclasses import replace

import numpy as np

from datasets.errors import InputError
from synth.effects.links import FlyingBody, Values


def change(body: FlyingBody, values: Values) -> FlyingBody:
    """The body with other moments.

    Raises
    ------
    InputError
        Where no body has such moments.
    """
    moments = body.inertia_kgm2 * [1 + values["e1"], 1 + values["e2"], 1.0]
    ratios = moments / moments.max()
    if moments.min() <= 0 or ratios.sum() < 2 * ratios.max():
        raise InputError(
            f"inertia_ratios: expected e1 and e2 with which no moment exceeds the sum of the others, got {values['e1']:g} and "
            f"{values['e2']:g}, which make them {np.array2string(ratios, precision=3)} of the largest."
        )
    return replace(body, body=replace(body.body, inertia_ratios=ratios), inertia_kgm2=moments, uniform_kgm2=body.inertia_kgm2)
