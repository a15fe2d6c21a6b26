"""A law found by regression as an effect like any other: the sum of its terms."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from datasets.vocabulary.effects import EffectEntry, Scope, Stage
from estimator.effects.empirical.law_terms import TERMS, Term
from estimator.effects.link import Array, EffectModel, Moment, Setting

REFERENCE = "Found by sparse regression: Brunton, Proctor and Kutz, PNAS 113 (2016) 3932"


@dataclass(frozen=True, eq=False)
class LawEffect(EffectModel):
    """The sum of terms, each with its ``parts`` of the parameters; ``start`` (q,) is where a fit begins, exponents stay as they are."""

    entry: EffectEntry
    parts: tuple[tuple[Term, slice], ...]
    start: Array
    frozen: tuple[str, ...]

    def starts(self, setting: Setting) -> Array:
        """Where a fit begins."""
        del setting
        return self.start[None].copy()

    def touches(self, link: str) -> bool:
        """Whether a term acts at the link."""
        return any(term.link == link for term, _ in self.parts)

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The sum of all forces."""
        del setting
        return self._total(theta, moment, "acceleration")

    def torque(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        """The sum of all torques."""
        del setting
        return self._total(theta, moment, "torque")

    def _total(self, theta: Array, moment: Moment, link: str) -> Array | None:
        terms = [term.function(theta[:, part], moment) for term, part in self.parts if term.link == link]
        return np.sum(terms, axis=0) if terms else None


def law_effect(key: str, terms: tuple[Term, ...], shapes: tuple[Array, ...]) -> LawEffect:
    """The effect of ``terms`` with ``shapes`` (k,) of each, from which a fit starts; exponents stay as they are."""
    start = np.concatenate([np.concatenate([np.zeros(t.amplitudes), shape]) for t, shape in zip(terms, shapes, strict=True)])
    ends = np.cumsum([0, *(len(t.parameters) for t in terms)])
    parts = tuple((t, slice(int(a), int(b))) for t, a, b in zip(terms, ends[:-1], ends[1:], strict=True))
    return LawEffect(law_entry(key, terms), parts, start, tuple(t.power for t in terms if t.power is not None))


def shown_terms(why_not: Callable[[EffectModel], str | None]) -> list[Term]:
    """Terms that measurements can show; ``why_not``: why they cannot show an effect. Body axes: where they tell how a body is turned."""
    laws = ((term, law_effect("law", (term,), (term.places(np.zeros((1, 3)))[0],))) for term in TERMS)
    return [term for term, law in laws if why_not(law) is None]


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
