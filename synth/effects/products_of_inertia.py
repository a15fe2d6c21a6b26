"""The particle is not homogeneous: its principal axes are not those of the uniform body.

The inertia matrix about the uniform body's axes has ``Iij = eij sqrt(Ii Ij)`` beside its diagonal, ``Ii`` the moments of the uniform body
[Goldstein, Classical Mechanics (1980), ch. 5]; its eigenvectors are the principal axes of the body that flies, its eigenvalues the moments
about them.

Valid for rigid bodies; matrices that no body has are refused.
"""

from dataclasses import replace

import numpy as np

from datasets.errors import InputError
from datasets.vocabulary.body import signed_axes
from synth.effects.links import FlyingBody, Values


def change(body: FlyingBody, values: Values) -> FlyingBody:
    """The body with other principal axes and the moments about them.

    Raises
    ------
    InputError
        Where no body has such an inertia matrix.
    """
    e12, e13, e23 = (values[name] for name in ("e12", "e13", "e23"))
    root = np.sqrt(body.inertia_kgm2 if body.uniform_kgm2 is None else body.uniform_kgm2)
    products = root[:, None] * np.array([[0.0, e12, e13], [e12, 0.0, e23], [e13, e23, 0.0]]) * root
    moments, axes = np.linalg.eigh(np.diag(body.inertia_kgm2) + products)
    if moments.min() <= 0 or moments.sum() < 2 * moments.max():
        raise InputError(
            f"products_of_inertia: expected products with which no moment exceeds the sum of the others, got e12 {e12:g}, e13 {e13:g} and "
            f"e23 {e23:g}, which make them {np.array2string(moments / moments.max(), precision=3)} of the largest."
        )
    turned = replace(body.body, R_particle_body=signed_axes(body.body.R_particle_body @ axes), inertia_ratios=moments / moments.max())
    return replace(body, body=turned, inertia_kgm2=moments)
