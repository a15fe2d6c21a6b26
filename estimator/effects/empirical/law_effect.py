"""A law found by regression as an effect like any other: the sum of its terms."""

from typing import Any

import numpy as np

from datasets.vocabulary.effects import EffectEntry, Scope, Stage
from estimator.effects.empirical.law_terms import Term
from estimator.effects.link import Array, EffectModel, Moment

REFERENCE = "Found by sparse regression: Brunton, Proctor and Kutz, PNAS 113 (2016) 3932"


def law_effect(key: str, terms: tuple[Term, ...], shapes: tuple[Array, ...]) -> EffectModel:
    """The effect of ``terms`` with ``shapes`` (k,) of each, from which a fit starts; exponents stay as they are."""
    start = np.concatenate([np.concatenate([np.zeros(t.amplitudes), shape]) for t, shape in zip(terms, shapes, strict=True)])
    ends = np.cumsum([0, *(len(t.parameters) for t in terms)])
    parts = [(t, slice(int(a), int(b))) for t, a, b in zip(terms, ends[:-1], ends[1:], strict=True)]

    def total(theta: Array, moment: Moment, link: str) -> Array:
        return np.sum([t.function(theta[:, part], moment) for t, part in parts if t.link == link], axis=0)

    methods: dict[str, Any] = {
        "__doc__": "A law found by regression.",
        "entry": law_entry(key, terms),
        "frozen": tuple(t.power for t in terms if t.power is not None),
        "starts": lambda _self, _setting: start[None].copy(),
    }
    if any(t.link == "acceleration" for t in terms):
        methods["acceleration"] = lambda _self, theta, moment, _setting: total(theta, moment, "acceleration")
    if any(t.link == "torque" for t in terms):
        methods["torque"] = lambda _self, theta, moment, _setting: total(theta, moment, "torque")
    return type("LawEffect", (EffectModel,), methods)()


def law_entry(key: str, terms: tuple[Term, ...]) -> EffectEntry:
    """What the effect of ``terms`` is called and what its parameters mean."""
    return EffectEntry(
        key,
        Stage.DYNAMICS,
        Scope.PARTICLE,
        tuple(p for t in terms for p in t.parameters),
        law_formula(terms),
        REFERENCE,
        searched=tuple(p.name for t in terms for p in t.shapes),
    )


def law_formula(terms: tuple[Term, ...]) -> str:
    """The equations of motion with the terms."""
    force = " + ".join(t.formula for t in terms if t.link == "acceleration")
    torque = " + ".join(t.formula for t in terms if t.link == "torque")
    sides = ([f"dv/dt = g + {force}"] if force else []) + ([f"dL/dt = {torque}"] if torque else [])
    return "; ".join(sides).replace("+ -", "- ")
