"""What v and omega take for granted: effects that a campaign cannot show, and what velocities would be off by where they were there.

Each effect on trial that is not in the model is considered alone (:mod:`estimator.fitting.campaigns.considered`): as large as these
data would show it in 95% of cases, and no larger than is plausible. A standard deviation of a velocity says
nothing of it, since an effect that the evidence does not ask for counts as none.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import in_words
from estimator.diagnosis.diagnose import SEEN_IN_95_PERCENT, Finding
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.campaigns.considered import Possible, Uncertain, considered
from estimator.fitting.campaigns.impacts import impacts
from estimator.fitting.stable_inverse import stable_inverse
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
    tested = [f.test for f in findings if f.key not in of.at.model.keys and _is_shared(f.test.effect)]
    possible = {test.effect.entry.key: Possible(test.effect.held_by(None), _covariance(test)) for test in tested}
    things = impacts(campaign, of.fit, considered(campaign, of.fit, of.at.plain, list(possible.values()))).things
    found = [(possible[thing.name], thing) for thing in things if thing.name in possible]
    return tuple(Unseen(p.effect, tuple(np.sqrt(np.diag(p.covariance)).tolist()), t.v_ms, t.omega_rads) for p, t in found)


def _is_shared(effect: EffectModel) -> bool:
    """Whether an effect shifts what is seen of all flights: it is no noise, none of each flight, and nothing that is searched for."""
    return not (effect.random or effect.noise or effect.entry.searched or effect.entry.scope.own)


def _covariance(test: ScoreTest) -> Array:
    """Of parameters (q, q) as far from none as would be seen in 95% of cases, were the ends of their plausible ranges a prior's sizes."""
    information = np.diag([max(map(abs, p.plausible)) ** -2.0 for p in test.effect.entry.parameters])
    mine = [i for i, column in enumerate(test.columns) if column.sequence == test.columns[0].sequence]
    at = [test.columns[i].parameter for i in mine]
    information[np.ix_(at, at)] += stable_inverse(SEEN_IN_95_PERCENT**2 * test.covariance[np.ix_(mine, mine)])
    return np.asarray(np.linalg.inv(information))


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
    return f"That takes for granted what these data would not show: {'; '.join(told)}. {_stating(list(named))}"


def _stating(named: Sequence[str]) -> str:
    """How to have effects in the error bars, and how to state what is known of them where there is a way of its own."""
    ways = [SETTLED_BY[key] for key in named if key in SETTLED_BY]
    checked = f"; --known states what was checked: {', '.join(ways)}" if ways else ""
    return f"With --possible EFFECT=±SIGMA it is in the error bars{checked}."


def _size_words(each: Unseen) -> str:
    """An effect with the largest of its sizes, where all of these have one unit."""
    name, units = in_words(each.effect.entry.key), {p.unit for p in each.effect.entry.parameters}
    if len(units) > 1:
        return name
    size, (unit,) = max(each.sizes), units
    if each.effect.entry.names == ("relative",):
        return f"{name} of {100.0 * size:.2g}%"
    return f"{name} of {size:.2g}{'' if unit == '1' else ' ' + unit}"
