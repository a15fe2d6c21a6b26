"""Two effects that explain together what neither does alone.

Pairs are proposed by a linear look at the fit without both, and by looks beside each effect that was refitted alone: large effects are far
from linear, and what one does to the other (a displaced principal point to a distortion) has no slope where neither is there. What a look
cannot tell from one of a pair beside the other is refitted in its place; where effects are large such a look is off by a share of
what they explain, and would take twins for strangers.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from estimator.diagnosis.ranking import Hypothesis, by_remainder, misfit_unit, pairs_by_remainder
from estimator.diagnosis.refits import Refitted, Rules, alike, judged, key_of, looked, named, penalty_of, refit, refit_pair, twins_of
from estimator.diagnosis.score_tests import EfficientScores, ScoreTest
from estimator.effects.choosing import contradiction
from estimator.fitting.campaign import Campaign, CampaignFit
from estimator.side_by_side import each_of

NEAR = 0.02
"""Share of what an effect explains, by which a linear look at it may be off."""
Keys = frozenset[str]


@dataclass(frozen=True)
class Proposed:
    """A pair, the fit from which both are refitted (one of them may be there), and what a linear look says that they leave."""

    fit: CampaignFit
    tests: tuple[ScoreTest, ScoreTest]
    remainder: float
    columns: int

    @property
    def keys(self) -> Keys:
        """The two effects."""
        return frozenset(test.effect.entry.key for test in self.tests)

    @property
    def parameters(self) -> int:
        """Those of both in the whole campaign."""
        return sum(len(test.columns) for test in self.tests)


@dataclass(frozen=True)
class Pairs:
    """The search: the ``campaign``, the ``fit`` without both, ``tests`` and ``scores`` of all effects there."""

    campaign: Campaign
    fit: CampaignFit
    tests: Sequence[ScoreTest]
    scores: EfficientScores
    rules: Rules

    @property
    def penalty(self) -> float:
        """Per parameter."""
        return penalty_of(self.campaign)

    def better(self, singles: Sequence[Refitted]) -> tuple[Refitted, ...]:
        """The member that costs less alone of a pair that explains more than any of ``singles``, and both; nothing where there is none."""
        alone, pairs = self._compared({key_of(single): single for single in singles}, self._refitted(self._likely(singles)))
        rivals = list(alone)
        best = self._best([alone[key] for key in rivals], pairs)
        if best is None:
            return ()
        alone, pairs = self._compared(self._with_members(alone, best), pairs)
        if best not in pairs:
            return ()
        alone, pairs = self._compared(alone, self._with_mates(alone, pairs, best))
        best = self._best([alone[key] for key in rivals], pairs)
        if best is None:
            return ()
        alone, pairs = self._compared(self._with_members(alone, best), pairs)
        if best not in pairs:
            return ()
        larger, smaller = sorted((alone[key] for key in sorted(best)), key=lambda r: 2.0 * r.cost + self.penalty * r.parameters)
        if not larger.holds_it:
            return ()
        near = [*self._twins(pairs, best), *_near(pairs, best, self.rules.margin, self.penalty)]
        groups = [_group(near, best, key_of(member)) for member in (larger, smaller)]
        return replace(larger, group=groups[0]), replace(pairs[best], test=smaller.test, group=groups[1])

    def _likely(self, singles: Sequence[Refitted]) -> list[Proposed]:
        """The pairs that looks propose."""
        return [*self._beside_nothing(), *self._beside_one(singles)]

    def _beside_nothing(self) -> list[Proposed]:
        """The likeliest pairs of a look at the fit without both."""
        proposed = [
            Proposed(self.fit, (self.tests[p.effects[0]], self.tests[p.effects[1]]), p.remainder, len(self.scores.columns) - p.parameters)
            for p in pairs_by_remainder(self.scores, penalty=self.penalty)
        ]
        alone = by_remainder(self.scores, penalty=self.penalty).hypotheses
        return self._likeliest(proposed, [(h.remainder, h.parameters) for h in alone])

    def _beside_one(self, singles: Sequence[Refitted]) -> list[Proposed]:
        """The likeliest second beside each effect that was refitted alone, and the pair that promises the least cost.

        What an effect explains is judged in a noise that its own absence has made too large, the more so the more it explains.
        """
        proposed: list[Proposed] = []
        promised: list[tuple[float, int, Proposed]] = []
        for single in singles:
            for i, (h, test) in enumerate(_allowed_beside(single, _looked_at(single, self.penalty))):
                pair = Proposed(single.fit, (single.test, test), h.remainder, len(single.scores.columns) - h.parameters)
                if i == 0:
                    proposed.append(pair)
                promised.append((2.0 * single.cost - test.explained + self.penalty * pair.parameters, len(promised), pair))
        cheapest = [pair for *_, pair in sorted(promised)[:1]]
        return self._likeliest(proposed, [(single.left, single.parameters) for single in singles]) + cheapest

    def _likeliest(self, proposed: Sequence[Proposed], alone: Iterable[tuple[float, int]]) -> list[Proposed]:
        """The proposed pairs that leave least, where that is less than what any effect ``alone`` leaves with its parameters."""
        unit = misfit_unit((p.remainder, p.columns) for p in proposed)
        beaten = min((left / unit + self.penalty * n for left, n in alone), default=0.0) - self.rules.margin
        found = [(p.remainder / unit + self.penalty * p.parameters, i) for i, p in enumerate(proposed) if _allowed(*p.tests)]
        return [proposed[i] for criterion, i in sorted(found)[: self.rules.pairs] if criterion < beaten]

    def _refitted(self, proposed: Iterable[Proposed]) -> dict[Keys, Refitted]:
        """Refits of pairs; of one that was proposed beside several effects, the refit of least cost."""
        wanted = {(pair.keys, id(pair.fit)): pair for pair in proposed}
        found: dict[Keys, Refitted] = {}
        refits = each_of(lambda p: refit_pair(self.campaign, self.fit, p.fit, p.tests), list(wanted.values()), self.campaign, self.fit)
        for pair, new in zip(wanted.values(), refits, strict=True):
            if pair.keys not in found or new.cost < found[pair.keys].cost:
                found[pair.keys] = new
        return found

    def _compared(self, alone: Mapping[str, Refitted], pairs: Mapping[Keys, Refitted]) -> tuple[dict[str, Refitted], dict[Keys, Refitted]]:
        """Effects ``alone`` and ``pairs``, all with what is left in the noise of the best of them; no pairs that were led astray."""
        found = looked(self.campaign, [*alone.values(), *pairs.values()], self.tests)
        together = zip(pairs, found[len(alone) :], strict=True)
        return dict(zip(alone, found, strict=False)), {keys: r for keys, r in together if r.flew}

    def _best(self, singles: Sequence[Refitted], refits: Mapping[Keys, Refitted]) -> Keys | None:
        """The pair that nature likeliest produces among those that the data like best; ``None`` where an effect alone does as well."""
        if not refits:
            return None
        ranked = _by_fit([*singles, *refits.values()], self.penalty)
        pairs = {keys: ranked[id(r.fit)] for keys, r in refits.items()}
        least = min(r.evidence for r in pairs.values())
        wanted = self.rules.margin + _worth_of_choice(len(self.tests))
        if least > min((ranked[id(single.fit)].evidence for single in singles), default=np.inf) - wanted:
            return None
        return min((keys for keys, r in pairs.items() if r.evidence <= least + self.rules.margin), key=lambda keys: pairs[keys].criterion)

    def _with_members(self, alone: Mapping[str, Refitted], pair: Keys) -> dict[str, Refitted]:
        """Effects ``alone`` with the members of a pair, refitted where they are not among them."""
        tests = {test.effect.entry.key: test for test in self.tests}
        missing = sorted(pair - alone.keys())
        found = each_of(partial(refit, self.campaign, self.fit), [tests[key] for key in missing], self.campaign, self.fit)
        return {**alone, **dict(zip(missing, found, strict=True))}

    def _with_mates(self, alone: Mapping[str, Refitted], pairs: Mapping[Keys, Refitted], best: Keys) -> dict[Keys, Refitted]:
        """Pairs with those of the best one's mates; one that a refit from another side put far off counts if its cost is less from here."""
        near = _near(pairs, best, self.rules.margin, self.penalty)
        mates = [mate for member in sorted(best) for mate in self._in_place_of(member, alone[next(iter(best - {member}))])]
        found = self._refitted(mate for mate in mates if mate.keys not in near)
        return {**pairs, **{keys: r for keys, r in found.items() if keys not in pairs or r.cost < pairs[keys].cost}}

    def _twins(self, pairs: Mapping[Keys, Refitted], best: Keys) -> list[Keys]:
        """Pairs with the twin of one of the best one's members in its place."""
        tests = {test.effect.entry.key: test for test in self.tests}
        found = [(best - {key}) | {twin} for key in sorted(best) for twin in sorted(twins_of(self.campaign, tests[key], self.tests))]
        return [keys for keys in found if keys in pairs]

    def _in_place_of(self, member: str, beside: Refitted) -> list[Proposed]:
        """Pairs with what a look cannot tell from ``member`` beside the other of its pair, and with its twins.

        Where the look says nothing of the member (a blur has no slope at zero), whatever else it says nothing of is no mate of it.
        """
        seen = _looked_at(beside, self.penalty)
        own = next((h for h, test in seen if test.effect.entry.key == member), None)
        if own is None:
            return []
        columns = len(beside.scores.columns)
        unit = misfit_unit((h.remainder, columns - h.parameters) for h, _ in seen)
        explained = (by_remainder(beside.scores, penalty=0.0).nothing - own.remainder) / unit
        if explained < self.penalty * own.parameters + self.rules.margin:
            return []
        reach = self.rules.margin + NEAR * explained
        twins = twins_of(self.campaign, beside.others[own.effect], self.tests)
        mates = [
            (abs(h.criterion - own.criterion), test, Proposed(beside.fit, (test, beside.test), h.remainder, columns - h.parameters))
            for h, test in _allowed_beside(beside, seen)
            if test.effect.entry.key != member
        ]
        near = sorted((mate for mate in mates if mate[0] <= reach), key=lambda mate: mate[0])[: self.rules.mates]
        near += [mate for mate in mates if mate[1].effect.entry.key in twins and all(mate is not each for each in near)]
        return [proposed for *_, proposed in near]


def _worth_of_choice(candidates: int) -> float:
    """What the best pair of all is better by chance: ``2 ln`` of how many pairs there are for every effect [Bogdan et al. 2004]."""
    return float(2.0 * np.log(max((candidates - 1) / 2.0, 1.0)))


def _looked_at(single: Refitted, penalty: float) -> list[tuple[Hypothesis, ScoreTest]]:
    """All effects beside one, by what they leave."""
    return [(h, single.others[h.effect]) for h in by_remainder(single.scores, penalty=penalty).hypotheses]


def _allowed_beside(single: Refitted, seen: Iterable[tuple[Hypothesis, ScoreTest]]) -> Iterator[tuple[Hypothesis, ScoreTest]]:
    """Those that are there at all and can be in a model with it."""
    return ((h, test) for h, test in seen if test.counts and _allowed(single.test, test))


def _allowed(first: ScoreTest, second: ScoreTest) -> bool:
    """Whether data could tell two effects apart: neither contradicts the other, or contains it."""
    keys = (first.effect.entry.key, second.effect.entry.key)
    return contradiction(keys) is None and keys[1] not in first.effect.contains and keys[0] not in second.effect.contains


def _near(refits: Mapping[Keys, Refitted], best: Keys, margin: float, penalty: float) -> list[Keys]:
    """The pairs that cannot be told from the best, the likeliest first; one that shares no effect with it has no group to be in."""
    ranked = _by_fit(list(refits.values()), penalty)
    pairs = {keys: ranked[id(r.fit)] for keys, r in refits.items()}
    near = {id(r.fit) for r in alike(list(pairs.values()), pairs[best], penalty, margin)}
    return [keys for keys in sorted(pairs, key=lambda keys: pairs[keys].criterion) if id(pairs[keys].fit) in near]


def _by_fit(refits: Sequence[Refitted], penalty: float) -> dict[int, Refitted]:
    """Refits with their criteria, by the identity of their fits."""
    return {id(r.fit): r for r in judged(refits, penalty)}


def _group(near: Sequence[Keys], best: Keys, key: str) -> tuple[str, ...]:
    """The alias group of one of the best pair, itself first: what does as well beside the other, or beside one of the other's own mates."""
    (other,) = best - {key}
    others = {other, *(mate for keys in near if key in keys for mate in keys - {key})}
    mates = [mate for keys in near for partner in keys & others for mate in keys - {partner} if mate not in others]
    return named((key, *mates))
