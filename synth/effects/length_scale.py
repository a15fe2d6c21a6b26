"""The lengths of the calibration are wrong: the particle in flight is larger than the calibrated views say.

Every point lies ``1 + relative`` times as far from the uniform body's centre of mass, density kept: mass grows with the third power,
moments with the fifth; their ratios stay [Hartley and Zisserman, Multiple View Geometry (2004), ch. 10]. The views, outlines and stated
poses alike, are those of the particle at its stated size. Evaluated before a displacement of the centre of mass, which is in true metres.

``X_true = (1 + relative) X_stated``. Valid for one factor in all directions.
"""

from dataclasses import replace

from synth.effects.links import FlyingBody, Values


def change(body: FlyingBody, values: Values) -> FlyingBody:
    """The larger body."""
    factor, centre = 1 + values["relative"], body.body.com_particle
    return replace(
        body,
        vertices=centre + factor * (body.vertices - centre),
        mass_kg=body.mass_kg * factor**3,
        inertia_kgm2=body.inertia_kgm2 * factor**5,
    )
