"""The contact models on trial, each with its free parameters, and the physics that the ladder adds to the rigid impulse, step by step.

A model predicts v and omega after impacts from the state measured before them. Models never see what was measured after.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from estimator.contact.sphere_equivalent import SphereEquivalent
from estimator.contact_validation.laws.point_contact import point_contact
from estimator.contact_validation.measured import MeasuredImpact

Array = NDArray[np.float64]
Predict = Callable[[Sequence[MeasuredImpact], Array], Array]


@dataclass(frozen=True)
class FreeParameter:
    """A number that is fitted: where the search starts, within which bounds, and the ``step`` of differences; ``unit`` "1" has none.

    ``scan``: values among which another minimum is looked for where a fit has ended.
    """

    name: str
    starts: tuple[float, ...]
    bounds: tuple[float, float]
    step: float = 1e-3
    unit: str = "1"
    scan: tuple[float, ...] = ()


RESTITUTION = FreeParameter("restitution", (0.6,), (0.02, 1.0))
FRICTION = FreeParameter("friction", (0.15, 0.5), (0.0, 2.0), scan=tuple(np.arange(0.01, 1.6, 0.02).tolist()))
"""Contacts that stick say nothing of friction but that it is larger; one that slips late may say it to a hundredth, in a narrow minimum."""


@dataclass(frozen=True)
class ContactModel:
    """``key`` on the command line, ``title`` for people, free parameters, and what it predicts at values of them."""

    key: str
    title: str
    parameters: tuple[FreeParameter, ...]
    predict: Predict

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(p.name for p in self.parameters)


@dataclass(frozen=True)
class Physics:
    """One addition to the rigid impulse: the ``key`` of the physics (as in ``datasets/vocabulary/contact_physics.py``) and its numbers."""

    key: str
    title: str
    parameters: tuple[FreeParameter, ...]
    meaning: str = field(default="", compare=False)


ADDITIONS: tuple[Physics, ...] = (
    Physics(
        "tangential_compliance",
        "tangential compliance",
        (FreeParameter("compliance", (0.3, 1.2), (0.0, 6.0), 1e-2),),
        "the contact gives way along the plate before it slips",
    ),
    Physics(
        "velocity_dependent_restitution",
        "restitution that falls with speed",
        (FreeParameter("slowing", (0.1,), (0.0, 0.6)),),
        "the contact flows: e falls with the speed of compression",
    ),
    Physics(
        "adhesion",
        "adhesion",
        (FreeParameter("adhesion", (0.02,), (0.0, 1.0), 1e-4, "m²/s²"),),
        "parting costs energy, most noticed in slow impacts",
    ),
    Physics(
        "plate_tilt",
        "a plate that stands otherwise than stated",
        (FreeParameter("tilt", (0.0,), (-0.15, 0.15), 2e-4, "rad"), FreeParameter("tilt_across", (0.0,), (-0.15, 0.15), 2e-4, "rad")),
        "impulses act along another normal than the stated one",
    ),
    Physics(
        "yielding_plate",
        "a plate that gives way",
        (FreeParameter("recoil", (0.1,), (0.0, 5.0)),),
        "the plate recoils as a free mass",
    ),
)
"""What may be missing, each a limit of the rigid impulse at 0."""


def impulse_model(added: Sequence[str] = ()) -> ContactModel:
    """The Mirtich–Stronge impulse with the physics ``added`` by key."""
    physics = [p for p in ADDITIONS if p.key in added]
    parameters = (RESTITUTION, FRICTION, *(q for p in physics for q in p.parameters))
    title = " + ".join(["Mirtich–Stronge impulse", *(p.title for p in physics)])
    return _point_model("+".join(["stronge_impulse", *(p.key for p in physics)]), title, parameters)


def _point_model(key: str, title: str, parameters: tuple[FreeParameter, ...]) -> ContactModel:
    names = tuple(p.name for p in parameters)

    def predict(impacts: Sequence[MeasuredImpact], values: Array) -> Float[NDArray[np.float64], "impact 6"]:
        return point_contact(dict(zip(names, values.tolist(), strict=True))).after(impacts)

    return ContactModel(key, title, parameters, predict)


def sphere_model() -> ContactModel:
    """The sphere of the particle's volume."""

    def predict(impacts: Sequence[MeasuredImpact], values: Array) -> Array:
        law = SphereEquivalent(float(values[0]), float(values[1]))
        rows = []
        for impact in impacts:
            if float((impact.state.v_world - impact.plate.velocity_world) @ impact.plate.normal_world) >= 0.0:
                rows.append(np.concatenate([impact.state.v_world, impact.state.omega_world]))
                continue
            after = law.strike(impact.state, impact.particle.solid, impact.state.x_world, impact.plate).after
            rows.append(np.concatenate([after.v_world, after.omega_world]))
        return np.array(rows)

    return ContactModel("sphere_equivalent", "sphere of the same volume", (RESTITUTION, FRICTION), predict)


FRICTIONLESS = _point_model("frictionless", "frictionless impulse", (RESTITUTION,))
RIGID = impulse_model()
SPHERE = sphere_model()
