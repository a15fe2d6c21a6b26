"""What v and omega take for granted: effects that a campaign would not show, and what velocities would be off by where one is there.

A standard deviation of a velocity says nothing of an effect that the evidence does not ask for: it counts as none. So each one on trial is
considered alone (:mod:`estimator.fitting.campaigns.considered`). Its values have the covariance ``P = (C⁻¹ / 3.3² + F + L⁻²)⁻¹``: of 3.3
standard deviations of its score test, of covariance ``C``, of what facts say (``F``), and of the ends ``L`` of its plausible ranges. Of all
values at the edge of that ellipsoid those that move a velocity most are told, and by how much. Left out are noise, what is searched for,
effects with values of every flight, and what the data do show.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import EffectEntry, in_words
from estimator.diagnosis.diagnose import ALPHA, SEEN_IN_95_PERCENT, Finding
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.link import EffectModel
from estimator.fitting.campaigns.campaign import Campaign
from estimator.fitting.campaigns.considered import Possible, Uncertain, considered, stated_rows
from estimator.fitting.campaigns.impacts import sensitivities
from estimator.fitting.stable_inverse import stable_inverse
from tumble.limiting import SETTLED_BY

Array = NDArray[np.float64]
MOST_NAMED = 3
"""Effects in a sentence; a document has them all."""
LEAST_TOLD = 0.01
"""Of a velocity's standard deviation, what an effect moves it by at least that is told of at all."""
UNDETERMINED = 1e-9
"""Least eigenvalue of an information, in units of its diagonal, at which it still determines all values."""
QUANTITIES = (("v", "m/s", slice(0, 3)), ("ω", "rad/s", slice(3, 6)))


@dataclass(frozen=True)
class Moved:
    """What a velocity would be ``off`` by (m/s or rad/s, root mean square over flights) with ``values`` (q,) of an effect's parameters."""

    off: float
    values: tuple[float, ...]


@dataclass(frozen=True)
class Unseen:
    """An effect that the data would not show, and what it could do to ``v`` and ``omega``."""

    effect: EffectModel
    v: Moved
    omega: Moved


def unseen(campaign: Campaign, of: Uncertain, findings: Sequence[Finding], named: Collection[str] = ()) -> tuple[Unseen, ...]:
    """What a fit with its uncertainty takes for granted, of the ``findings`` beside it; ``named``: other names of what is in it."""
    tests = [f.test for f in findings if f.p >= ALPHA and f.key not in {*of.fit.model.keys, *named} and _is_shared(f.test.effect)]
    covariances = ((test.effect, _covariance(campaign, test)) for test in tests)
    possible = [Possible(effect.held_by(None), P) for effect, P in covariances if P is not None]
    found = sensitivities(campaign, of.fit, considered(campaign, of.fit, of.at.plain, possible))
    return tuple(Unseen(p.effect, *(_most(found[p.effect.entry.key][:, part], p.covariance) for *_, part in QUANTITIES)) for p in possible)


def _is_shared(effect: EffectModel) -> bool:
    """Whether an effect shifts what is seen of all flights: it is no noise, none of each flight, and nothing that is searched for."""
    return not (effect.random or effect.noise or effect.entry.searched or effect.entry.scope.own)


def _covariance(campaign: Campaign, test: ScoreTest) -> Array | None:
    """Of an effect's values (q, q), of the particle or camera that shows least of it; ``None``: nothing limits them, or all is stated."""
    entry = test.effect.entry
    limits = np.array([max(map(abs, p.plausible)) for p in entry.parameters])
    stated = stated_rows(campaign.facts, entry.key)
    if len(stated) and np.linalg.matrix_rank(stated) == len(limits):
        return None
    known = np.diag(limits**-2.0) + (stated.T @ stated if len(stated) else 0.0)
    owners = sorted(set(campaign.sharing(entry.scope)))
    each = [known + _seen(test, owner, len(limits)) for owner in owners]
    if not all(map(_determined, each)):
        return None
    found = [np.linalg.inv(information) for information in each]
    return np.asarray(max(found, key=lambda P: float(np.sum(np.diag(P) / np.where(np.isfinite(limits), limits, 1.0) ** 2))))


def _seen(test: ScoreTest, owner: int, size: int) -> Array:
    """Information (q, q) of values from none to where a test would see them in 95% of cases; none of what the data do not determine."""
    information, mine = np.zeros((size, size)), [i for i, column in enumerate(test.columns) if column.sequence in (None, owner)]
    at = [test.columns[i].parameter for i in mine]
    information[np.ix_(at, at)] = stable_inverse(SEEN_IN_95_PERCENT**2 * test.covariance[np.ix_(mine, mine)])
    return information


def _determined(information: Array) -> bool:
    """Whether an information (q, q) says something of every combination of values."""
    size = np.sqrt(np.diag(information))
    return bool(np.all(size > 0.0) and np.linalg.eigvalsh(information / np.outer(size, size))[0] > UNDETERMINED)


def _most(sensitivity: Array, covariance: Array) -> Moved:
    """The values at the edge of an ellipsoid (q, q) that move a velocity most, by its ``sensitivity`` (n, 3, q) in n flights."""
    root = np.linalg.cholesky(covariance)
    moved = (sensitivity @ root).reshape(-1, len(root))
    square, along = np.linalg.eigh(moved.T @ moved / len(sensitivity))
    values = root @ along[:, -1]
    return Moved(float(np.sqrt(max(square[-1], 0.0))), tuple((values * np.sign(values[np.argmax(np.abs(values))])).tolist()))


def with_unseen(
    limits: dict[str, Any], campaign: Campaign, of: Uncertain, findings: Sequence[Finding], named: Collection[str] = ()
) -> dict[str, Any]:
    """What limits v and omega, with what these take for granted."""
    return {**limits, "unseen": unseen_entry(unseen(campaign, of, findings, named), limits["total"])}


def unseen_entry(found: Sequence[Unseen], total: dict[str, float]) -> dict[str, Any]:
    """All that move a velocity by ``LEAST_TOLD`` of ``total``, what is stated, and a sentence of those that do by more than that."""
    stated = (total["v_ms"], total["omega_rads"])
    told = [each for each in found if any(m.off > LEAST_TOLD * size for m, size in zip((each.v, each.omega), stated, strict=True))]
    told.sort(key=lambda each: -max(m.off / size for m, size in zip((each.v, each.omega), stated, strict=True) if size > 0.0))
    things = [{"name": each.effect.entry.key, "v": _moved_entry(each, 0, stated), "omega": _moved_entry(each, 1, stated)} for each in told]
    return {"things": things, "sentence": unseen_sentence(told, stated)}


def _moved_entry(each: Unseen, number: int, stated: tuple[float, float]) -> dict[str, Any] | None:
    """One velocity's part; none where it was not measured or is not moved."""
    moved = (each.v, each.omega)[number]
    if not moved.off > LEAST_TOLD * stated[number]:
        return None
    return {"off": moved.off, "with": values_words(each.effect.entry, moved.values), "values": list(moved.values)}


def unseen_sentence(found: Sequence[Unseen], total: tuple[float, float]) -> str:
    """What v and omega take for granted, where it matters more than their standard deviations ``total`` (m/s, rad/s)."""
    told, named = [], dict[str, None]()
    for number, (letter, unit, _) in enumerate(QUANTITIES):
        moves = [(each.effect.entry, (each.v, each.omega)[number]) for each in found]
        most = sorted(((e, m) for e, m in moves if m.off > total[number]), key=lambda each: -each[1].off)[:MOST_NAMED]
        if most:
            named |= dict.fromkeys(entry.key for entry, _ in most)
            told.append(f"{letter} would be off by {', '.join(f'{m.off:.2g} {unit} with {with_words(e, m.values)}' for e, m in most)}")
    if not told:
        return ""
    return f"That takes for granted what these data would not show: {'; '.join(told)}. {_stating(list(named))}"


def _stating(named: Sequence[str]) -> str:
    """How to have effects in the error bars, and how to state what is known of them where there is a way of its own."""
    ways = [SETTLED_BY[key] for key in named if key in SETTLED_BY]
    checked = f"; --known states what was checked: {', '.join(ways)}" if ways else ""
    return f"With --possible EFFECT=±SIGMA it is in the error bars{checked}."


def with_words(entry: EffectEntry, values: Sequence[float]) -> str:
    """An effect with its values."""
    return f"{in_words(entry.key)} of {values_words(entry, values)}"


def values_words(entry: EffectEntry, values: Sequence[float]) -> str:
    """An effect's values: their length where all have one unit, else each."""
    units = {p.unit for p in entry.parameters}
    if entry.names == ("relative",):
        return f"{100.0 * abs(values[0]):.2g}%"
    if len(values) == 1 or (len(units) == 1 and units != {"1"}):
        (unit,) = units
        return _number(float(np.linalg.norm(values)), unit)
    return ", ".join(f"{p.name} {_number(value, p.unit)}" for p, value in zip(entry.parameters, values, strict=True))


def _number(value: float, unit: str) -> str:
    return f"{value:.2g}{'' if unit == '1' else ' ' + unit}"
