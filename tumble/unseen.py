"""What v and omega take for granted: effects that a campaign cannot show, and what velocities would be off by where they were there.

Each effect on trial that is not in the model is considered alone (:mod:`estimator.fitting.campaigns.considered`): as large as these
data would show it in 95% of cases, or as the end of its plausible range, whichever is less. A standard deviation of a velocity says
nothing of it, since an effect that the evidence does not ask for counts as none.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import in_words
from estimator.diagnosis.diagnose import Finding, tested_values
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.campaigns.considered import Possible, Uncertain, considered
from estimator.fitting.campaigns.impacts import impacts
from tumble.limiting import SETTLED_BY

Array = NDArray[np.float64]
MOST_NAMED = 3
"""Effects in a sentence; a document has them all."""


@dataclass(frozen=True)
class Unseen:
    """An effect whose ``sizes`` (q,), in its parameters' units, no test would notice, and what v and omega would be off by.

    ``v_ms``, ``omega_rads``: root mean square over flights; NaN where none was measured.
    """

    effect: EffectModel
    sizes: tuple[float, ...]
    v_ms: float
    omega_rads: float


def unseen(campaign: Campaign, of: Uncertain, findings: Sequence[Finding]) -> tuple[Unseen, ...]:
    """What a fit with its uncertainty takes for granted, of effects that were ``findings`` and are neither in it nor possible."""
    sizes = {f.key: _largest(f) for f in findings if f.key not in of.at.model.keys and _has_a_size(f.test.effect)}
    effects = {f.key: f.test.effect for f in findings if f.key in sizes}
    possible = [Possible(effect.held_by(None), np.diag(sizes[key] ** 2)) for key, effect in effects.items()]
    things = impacts(campaign, of.fit, considered(campaign, of.fit, of.at.plain, possible)).things
    found = {thing.name: thing for thing in things if thing.name in effects}
    return tuple(Unseen(effects[key], tuple(sizes[key].tolist()), thing.v_ms, thing.omega_rads) for key, thing in found.items())


def _has_a_size(effect: EffectModel) -> bool:
    """Whether an effect is a known shift of what is seen, not noise, nor of a place or a frequency that is searched for."""
    return not (effect.random or effect.noise or effect.entry.searched)


def _largest(finding: Finding) -> Array:
    """The size (q,) of every parameter from which on it would be seen, or the end of what is plausible."""
    parameters = finding.test.effect.entry.parameters
    limit = {p.name: max(map(abs, p.plausible)) for p in parameters}
    seen = {
        p.name: [v.seen_from for v in tested_values(finding.test) if v.parameter.name == p.name and v.seen_from > 0.0] for p in parameters
    }
    return np.array([min([limit[p.name], max(seen[p.name], default=np.inf)]) for p in parameters])


def unseen_entry(found: Sequence[Unseen], total: dict[str, float]) -> dict[str, Any]:
    """All of them, those that matter most for v first, and a sentence of those that matter more than ``total``, what is stated."""
    ranked = sorted(found, key=lambda each: -np.nan_to_num(each.v_ms) if np.isfinite(each.v_ms) else -each.omega_rads)
    things = [
        {"name": each.effect.entry.key, "size": _size_words(each), "v_ms": each.v_ms, "omega_rads": each.omega_rads} for each in ranked
    ]
    return {"things": things, "sentence": unseen_sentence(found, (total["v_ms"], total["omega_rads"]))}


def unseen_sentence(found: Sequence[Unseen], total: tuple[float, float]) -> str:
    """What v and omega take for granted, where it matters more than their standard deviations ``total`` (m/s, rad/s)."""
    told, named = [], dict[str, None]()
    for i, (letter, unit) in enumerate((("v", "m/s"), ("ω", "rad/s"))):
        matter = [(each, (each.v_ms, each.omega_rads)[i]) for each in found if (each.v_ms, each.omega_rads)[i] > total[i]]
        most = sorted(matter, key=lambda each: -each[1])[:MOST_NAMED]
        if most:
            named |= dict.fromkeys(each.effect.entry.key for each, _ in most)
            told.append(f"{letter} would be off by {', '.join(f'{off:.2g} {unit} with {_size_words(each)}' for each, off in most)}")
    if not told:
        return ""
    stated = " or ".join(["--possible EFFECT=±SIGMA has it in the error bars", *_checks(list(named))])
    return f"That takes for granted what these data would not show: {'; '.join(told)}. {stated}."


def _checks(named: Sequence[str]) -> list[str]:
    """How to state what is known of effects, where there is a way of its own."""
    ways = [SETTLED_BY[key] for key in named if key in SETTLED_BY]
    return [f"--known says what was checked: {', '.join(ways)}"] if ways else []


def _size_words(each: Unseen) -> str:
    """An effect with the largest of its sizes, where all of these have one unit."""
    name, units = in_words(each.effect.entry.key), {p.unit for p in each.effect.entry.parameters}
    if len(units) > 1:
        return name
    size, (unit,) = max(each.sizes), units
    if each.effect.entry.names == ("relative",):
        return f"{name} of {100.0 * size:.2g}%"
    return f"{name} of {size:.2g}{'' if unit == '1' else ' ' + unit}"
