"""Which effect a step adds: the likeliest of a linear look are refitted and compared by what the scores of all others then say is left.

Those that leave the same remainder are one alias group. Where two effects are missing, one that is neither may imitate their sum; if the
best effect leaves something unexplained or has many parameters, the likeliest pairs are therefore refitted too, and a better one is added.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from estimator.diagnosis.contest import criterion_of
from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.ranking import Hypothesis, Pair, Ranking, by_remainder, misfit_unit, pairs_by_remainder, surprise_of
from estimator.diagnosis.score_tests import Candidates, EfficientScores, ScoreTest, score_tests
from estimator.effects.choosing import contradiction
from estimator.fitting.campaign import Campaign, CampaignFit, cost_like

Array = NDArray[np.float64]
FEWEST = np.exp(np.e)
"""Measurements, of which the penalty is Akaike's 2."""
FEWEST_REFITTED = 3
"""Where effects are large the linear look says little of those behind the first."""
MANY = 4
"""Parameters, beyond which an effect may imitate two others of fewer."""
Found = tuple[list[ScoreTest], EfficientScores, Ranking]
"""The tests of all effects at a fit, their scores, and the order of a linear look."""


@dataclass(frozen=True)
class Rules:
    """When to believe.

    ``alpha``: p-value, corrected for the number of candidates, below which an effect is taken for missing. ``margin``: difference of the
    criterion within which effects cannot be told apart. ``shortlist``: effects refitted per step; ``window``: criterion above the
    best within which they are; ``pairs``: pairs refitted where one effect is not enough. ``most_effects`` a model may gain.
    ``superfluous``: p-value above which an effect is dropped again.
    """

    alpha: float = 0.01
    margin: float = 6.0
    shortlist: int = 4
    window: float = 40.0
    pairs: int = 2
    most_effects: int = 6
    superfluous: float = 0.05


def penalty_of(campaign: Campaign) -> float:
    """Penalty per parameter among known effects: ``2 ln ln n`` of n independent measurements [Hannan and Quinn 1979], 2 at least."""
    return float(2.0 * np.log(np.log(max(campaign.kind.independent(campaign), FEWEST))))


@dataclass(frozen=True)
class Refitted:
    """A refit with an effect more, of ``parameters`` in the whole campaign.

    ``group``: keys of the effects that it cannot be told from, its own first. ``left``: chi-squared of what the scores of all others say
    is left, of ``columns`` degrees of freedom. ``surprise`` at its value, where nature hardly produces it. ``evidence`` is what the data
    say against it among others, ``criterion`` that with the surprise.
    """

    test: ScoreTest
    group: tuple[str, ...]
    fit: CampaignFit
    left: float
    columns: int
    parameters: int
    surprise: float = 0.0
    evidence: float = np.inf
    criterion: float = np.inf


def contenders(campaign: Campaign, fit: CampaignFit, found: Found, rules: Rules) -> tuple[Refitted, ...]:
    """The effect to add, refitted; or two, where one alone does not explain what both do: the larger one, then both."""
    tests, _, ranking = found
    known = [h for h in ranking.hypotheses if not tests[h.effect].random and tests[h.effect].counts]
    if not known:
        return ()
    window = known[0].criterion + rules.window
    close = [h for i, h in enumerate(known[: rules.shortlist]) if i < FEWEST_REFITTED or h.criterion <= window]
    refits = [r for r in (_refit(campaign, fit, tests, h) for h in close) if np.isfinite(r.left)]
    if not refits:
        return ()
    refitted = _judged(refits, penalty_of(campaign))
    chosen = refitted[0]
    if chosen.parameters > MANY or chi2.sf(chosen.left, max(chosen.columns, 1)) < rules.alpha:
        both = _pair(campaign, fit, found, refitted, rules)
        if both:
            return both
    group = [r for r in refitted if r.evidence <= chosen.evidence + rules.margin]
    leader = _simplest(campaign, chosen, group, tests)
    return (replace(leader, group=(_key(leader), *(_key(r) for r in group if r is not leader))),)


def _simplest(campaign: Campaign, chosen: Refitted, group: Sequence[Refitted], tests: Sequence[ScoreTest]) -> Refitted:
    """The chosen effect, or what it contains where that cannot be told from it and explains it in fewer words."""
    contained = [r for r in group if _key(r) in chosen.test.effect.contains]
    if not contained:
        return chosen
    known = {t.effect.entry.key: t.effect for t in tests}
    return min((chosen, *contained), key=lambda r: criterion_of(campaign, r.fit, known))


def random_contender(campaign: Campaign, fit: CampaignFit, found: Found, rules: Rules) -> tuple[Refitted, ...]:
    """The effect drawn anew in every frame, refitted, where it leads the linear look or is all that is significant; else nothing.

    Second differences show it where sums over smooth misfits, by which the others are ranked, show hardly anything.
    """
    tests, _, ranking = found
    first = next(h for h in ranking.hypotheses if tests[h.effect].counts)
    if not tests[first.effect].random and min((t.p for t in tests if not t.random), default=1.0) * len(tests) > rules.alpha:
        first = next((h for h in ranking.hypotheses if tests[h.effect].random), first)
    return (_refit(campaign, fit, tests, first),) if tests[first.effect].random else ()


def _judged(refits: Sequence[Refitted], penalty: float) -> list[Refitted]:
    """Refits by ascending criterion, what they leave counted in units of the least that any leaves per degree of freedom.

    See :func:`estimator.diagnosis.ranking.misfit_unit`.
    """
    unit = misfit_unit((r.left, r.columns) for r in refits)
    found = [replace(r, evidence=r.left / unit + penalty * r.parameters) for r in refits]
    return sorted((replace(r, criterion=r.evidence + r.surprise) for r in found), key=lambda r: r.criterion)


def _key(refitted: Refitted) -> str:
    return refitted.test.effect.entry.key


def _pair(campaign: Campaign, fit: CampaignFit, found: Found, singles: Sequence[Refitted], rules: Rules) -> tuple[Refitted, ...]:
    """The larger member of a pair that explains more than any effect alone, and both together; nothing where there is none."""
    tests, scores, ranking = found
    penalty = penalty_of(campaign)
    looked = pairs_by_remainder(scores, penalty=penalty)
    unit = misfit_unit((p.remainder, len(scores.columns) - p.parameters) for p in looked)
    alone = min(h.remainder / unit + penalty * h.parameters for h in ranking.hypotheses if not tests[h.effect].random)
    looked = tuple(p for p in looked if contradiction([tests[e].effect.entry.key for e in p.effects]) is None)
    likely = sorted(looked, key=lambda p: p.remainder / unit + penalty * p.parameters)[: rules.pairs]
    likely = [p for p in likely if p.remainder / unit + penalty * p.parameters < alone - rules.margin]
    refits = [(refit, pair) for pair in likely if (refit := _refit_pair(campaign, fit, tests, pair)) is not None]
    if not refits:
        return ()
    best, pair = min(refits, key=lambda each: each[0].left + penalty * each[0].parameters)
    judged = _judged([*singles, best], penalty)
    if judged[0].fit is not best.fit or judged[0].evidence > min(r.evidence for r in judged[1:]) - rules.margin:
        return ()
    known = {_key(r): r for r in singles}
    members = [h for h in ranking.hypotheses if h.effect in pair.effects]
    larger, smaller = _judged([known.get(_key_of(tests, h)) or _refit(campaign, fit, tests, h) for h in members], penalty)
    groups = [_mates(campaign, beside.fit, tests, member.test, rules) for member, beside in ((larger, smaller), (smaller, larger))]
    return replace(larger, group=groups[0]), replace(best, test=smaller.test, group=groups[1])


def _mates(campaign: Campaign, beside: CampaignFit, tests: Sequence[ScoreTest], member: ScoreTest, rules: Rules) -> tuple[str, ...]:
    """The alias group of one of a pair, itself first: what a linear look cannot tell from it where the other one is in the model."""
    others = [t for t in tests if t.effect.entry.key not in beside.model.keys and not t.random]
    _, scores = score_tests(campaign, beside, _at_their_best(others))
    ranking = by_remainder(scores, penalty=penalty_of(campaign))
    found = {others[h.effect].effect.entry.key: h.criterion for h in ranking.hypotheses}
    return alike(found, member.effect.entry.key, ranking.nothing, rules.margin)


def alike(criteria: Mapping[str, float], own: str, nothing: float, margin: float) -> tuple[str, ...]:
    """``own`` and the keys whose criteria are within ``margin`` of its; itself alone where it is no better than ``nothing`` by that much.

    A linear look may say nothing of an effect (a blur has no slope at zero); whatever else it says nothing of is no mate of it.
    """
    if own not in criteria or criteria[own] > nothing - margin:
        return (own,)
    near = (key for key in criteria if key != own and abs(criteria[key] - criteria[own]) <= margin)
    return (own, *sorted(near, key=lambda key: criteria[key]))


def _key_of(tests: Sequence[ScoreTest], hypothesis: Hypothesis) -> str:
    return tests[hypothesis.effect].effect.entry.key


def _refit_pair(campaign: Campaign, fit: CampaignFit, tests: Sequence[ScoreTest], pair: Pair) -> Refitted | None:
    """Refit with both of a pair; ``None`` where flights under it run away: what cannot be flown explains nothing."""
    try:
        new = fit_extended(campaign, fit, *(tests[e] for e in pair.effects))
    except (ValueError, np.linalg.LinAlgError):
        return None
    left, columns = _left(campaign, new, tests, pair.effects)
    return Refitted(tests[pair.effects[1]], (), new, left, columns, pair.parameters)


def _refit(campaign: Campaign, fit: CampaignFit, tests: Sequence[ScoreTest], hypothesis: Hypothesis) -> Refitted:
    """Refit with one effect more, and what the scores of all the others say is left: infinitely much where the fit was led astray."""
    test = tests[hypothesis.effect]
    new = fit_extended(campaign, fit, test)
    astray = Refitted(test, (test.effect.entry.key,), new, np.inf, 0, hypothesis.parameters)
    if cost_like(campaign, new, fit) > fit.cost:
        return astray
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # of effects that cannot be flown from there
            left, columns = _left(campaign, new, tests, (hypothesis.effect,))
    except (ValueError, np.linalg.LinAlgError):
        return astray
    return replace(astray, left=left, columns=columns, surprise=surprise_of(test, _values(new, test)))


def _left(campaign: Campaign, new: CampaignFit, tests: Sequence[ScoreTest], added: tuple[int, ...]) -> tuple[float, int]:
    """Chi-squared of the scores of all effects but those ``added``, and its degrees of freedom."""
    others = [t for i, t in enumerate(tests) if i not in added and not t.random]
    _, scores = score_tests(campaign, new, _at_their_best(others))
    ranking = by_remainder(scores, penalty=0.0)
    return ranking.nothing, ranking.columns


def _at_their_best(tests: Sequence[ScoreTest]) -> Candidates:
    """The effects of tests, each at its best starts alone."""
    return Candidates(tuple(t.effect for t in tests), tuple(np.unique(np.stack(list(t.starts.values())), axis=0) for t in tests))


def _values(fit: CampaignFit, test: ScoreTest) -> Array:
    """Fitted values (c,) of a test's columns; the tested effect is the last of the model."""
    part = fit.model.slices[-1]
    return np.array([fit.state.theta[column.sequence or 0][part][column.parameter] for column in test.columns])
