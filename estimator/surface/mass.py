"""Centre of mass and inertia of a uniformly filled surface in a flight's parameters, and their derivatives by its corners."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.vocabulary.body import Body
from estimator.motion.flight import SYMMETRIC
from estimator.surface.star_surface import Surface, crossed

Array = NDArray[np.float64]
N_MASS = 8
"""Three numbers of the centre of mass (m), five of the inertia, as in :mod:`estimator.motion.flight`."""


@dataclass(frozen=True)
class MassResponse:
    """``values`` (8,) about a nominal body, and their derivatives ``by_corner`` (3 n, 8) per m of each corner's three coordinates."""

    values: Float[NDArray[np.float64], "8"]
    by_corner: Float[NDArray[np.float64], "3n 8"]


def mass_response(surface: Surface, nominal: Body) -> MassResponse:
    """Mass properties of a surface as deviations from a ``nominal`` body, in its axes.

    A corner that moves adds a thin layer where it is, along the normals of a third of the area of every face around it [Mirtich, J.
    Graphics Tools 1 (1996) 31, gives the integrals of the solid itself].
    """
    volume, centre, second = _integrals(surface)
    axes, root = nominal.R_particle_body, np.sqrt(nominal.inertia_ratios)
    arms = (surface.vertices - centre) @ axes
    by_com = arms / volume
    whole = axes.T @ (np.trace(second) * np.eye(3) - second) @ axes / np.outer(root, root)
    square = np.sum(arms**2, axis=1)[:, None, None] * np.eye(3) - arms[:, :, None] * arms[:, None, :]
    by_inertia = square / np.outer(root, root)
    scale = whole[2, 2]
    relative = by_inertia / scale - whole * by_inertia[:, 2, 2][:, None, None] / scale**2
    inertia = np.array([(whole / scale - np.eye(3))[i, j] for i, j in SYMMETRIC])
    per_volume = np.column_stack([by_com, *(relative[:, i, j] for i, j in SYMMETRIC)])
    values = np.concatenate([(centre - nominal.com_particle) @ axes, inertia])
    return MassResponse(values, (surface.area_vectors[:, :, None] * per_volume[:, None, :]).reshape(-1, N_MASS))


def _integrals(surface: Surface) -> tuple[float, Array, Array]:
    """Volume (m³), centre of mass (3,) m and second moments (3, 3) m^5 about it of what a surface encloses.

    Of the tetrahedra between its faces and its centre, each as its corners say [Blow and Binstock, How to find the inertia tensor, 2004].
    """
    a, b, c = (surface.vertices[corners] - surface.centre for corners in surface.sphere.mesh.faces.T)
    six, far = np.sum(a * crossed(b, c), axis=1), a + b + c
    volume, middle = float(six.sum()) / 6.0, six @ far / 24.0
    second = sum((each.T @ (six[:, None] * each) for each in (a, b, c)), start=far.T @ (six[:, None] * far)) / 120.0
    offset = middle / volume
    return volume, surface.centre + offset, second - volume * np.outer(offset, offset)
