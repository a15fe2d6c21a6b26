"""A force that points one way everywhere and depends on the place along that way: a wall's, whatever law it falls off by.

Seven parameters say more of such a force than the nine of a field that is linear in the place, and far more of a strong one.
"""

import numpy as np
from numpy.polynomial import legendre

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.empirical.families import REFERENCE
from estimator.effects.link import Array, EffectModel, Moment, Setting

DEGREES = range(5)
"""Of the polynomial along the direction: enough for the field of a strong wall (notebook 17)."""
_ANY = (-np.inf, np.inf)


class PlaneField(EffectModel):
    """The force about ``middle`` (3,) m, near the direction ``along`` (3,), at places up to ``reach`` (m) from the middle; world frame."""

    entry = EffectEntry(
        "plane_field",
        Stage.DYNAMICS,
        Scope.CAMPAIGN,
        (
            *(Parameter(f"n_{i}", "1", _ANY, 1e-4, f"slope of the direction towards the axis {i} across it") for i in (1, 2)),
            *(Parameter(f"a{j}", "m/s2", _ANY, 1e-3, f"coefficient of P_{j}") for j in DEGREES),
        ),
        "dv/dt = g + n sum a_j P_j(n . (x - x0) / reach)",
        REFERENCE,
    )

    def __init__(self, middle: Array, along: Array, reach: float) -> None:
        self.middle, self.reach = middle, reach
        self.axes = np.linalg.svd(along[None])[2] * np.sign(np.linalg.svd(along[None])[0][0, 0])
        """The direction and two across it (3, 3), rows."""

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The force where the bodies are."""
        del setting
        n = self.axes[0] + theta[:, :2] @ self.axes[1:]
        n /= np.linalg.norm(n, axis=1, keepdims=True)
        place = np.sum(n * (moment.x - self.middle), axis=1) / self.reach
        return np.asarray(n * np.sum(theta[:, 2:] * legendre.legvander(place, DEGREES[-1]), axis=1)[:, None])


def plane_field_like(force: Array, place: Array) -> tuple[PlaneField, Array]:
    """The plane field that is nearest to ``force`` (n, 3) m/s² at ``place`` (n, 3) m, world frame, and its parameters (7,)."""
    middle = place.mean(axis=0)
    along = np.linalg.eigh(force.T @ force)[1][:, -1]
    reach = max(float(np.linalg.norm(place - middle, axis=1).max()), 1e-6)
    effect = PlaneField(middle, along, reach)
    basis = legendre.legvander((place - middle) @ effect.axes[0] / reach, DEGREES[-1])
    amplitudes, *_ = np.linalg.lstsq(basis, force @ effect.axes[0], rcond=1e-6)
    return effect, np.concatenate([np.zeros(2), amplitudes])
