"""The particle is not homogeneous: its centre of mass lies elsewhere.

``com = com_uniform + R_particle_body c``, ``c`` along the principal axes of the uniform body. Moments about the new centre are taken to be
those of the uniform body about the old one [the catalogue's meaning; Goldstein, Classical Mechanics (1980), ch. 5]. The flight is that of
the new centre: gravity acts there, and the shape turns about it.

Valid for any displacement inside the body.
"""

from dataclasses import replace

import numpy as np

from synth.effects.links import FlyingBody, Values


def change(body: FlyingBody, values: Values) -> FlyingBody:
    """The body with its centre of mass displaced."""
    offset_body = np.array([values["c1"], values["c2"], values["c3"]])
    com = body.body.com_particle + body.body.R_particle_body @ offset_body
    return replace(body, body=replace(body.body, com_particle=com))
