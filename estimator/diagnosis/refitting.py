"""Which effect a step adds: the likeliest of a linear look are refitted and compared by what the scores of all others then say is left.

Those that leave the same remainder, or cost the same, are one alias group (:func:`estimator.diagnosis.refits.alike`), and so are twins
that reduced models cannot claim to tell apart. Where two effects are missing, one that is neither may imitate their sum; if the best effect
leaves something unexplained or has many parameters, pairs are therefore refitted too (:mod:`estimator.diagnosis.pairing`), and a better
one is added.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from scipy.stats import chi2

from estimator.diagnosis.contest import criterion_of
from estimator.diagnosis.looks import Looks
from estimator.diagnosis.pairing import Pairs
from estimator.diagnosis.ranking import Hypothesis, Ranking
from estimator.diagnosis.refits import (
    Refitted,
    Rules,
    alike,
    as_it_is,
    dearer,
    judged,
    key_of,
    looked,
    named,
    penalty_of,
    refit,
    twins_of,
    wider,
    with_twins,
)
from estimator.diagnosis.score_tests import EfficientScores, ScoreTest
from estimator.fitting.campaign import Campaign, CampaignFit
from estimator.side_by_side import each_of

FEWEST_REFITTED = 3
"""Where effects are large the linear look says little of those behind the first."""
MANY = 4
"""Parameters, beyond which an effect may imitate two others of fewer."""
Found = tuple[list[ScoreTest], EfficientScores, Ranking]
"""The tests of all effects at a fit, their scores, and the order of a linear look."""


def contenders(campaign: Campaign, fit: CampaignFit, found: Found, rules: Rules) -> tuple[Refitted, ...]:
    """The effect to add, refitted; or two, where one alone does not explain what both do: the larger one, then both."""
    tests, scores, ranking = found
    wanted = _shortlist(_known(tests, ranking), tests, rules)
    refits = each_of(partial(refit, campaign, fit), _and_twins(campaign, wanted, wanted[:1], tests), campaign, fit)
    flown = [r for r in looked(campaign, refits, tests) if r.flew]
    if not flown:
        return ()
    refitted = judged(flown, penalty_of(campaign))
    chosen = refitted[0]
    if chosen.parameters > MANY or chi2.sf(chosen.left, max(chosen.columns, 1)) < rules.alpha:
        both = Pairs(campaign, fit, tests, scores, rules).better(refitted)
        if both:
            return both
    return (_leader(campaign, refitted, tests, rules),)


def in_place(campaign: Campaign, without: CampaignFit, fit: CampaignFit, found: Found, rules: Rules, key: str) -> Refitted | None:  # noqa: PLR0917
    """The likeliest effect in place of ``key``, which ``fit`` has beside others and the fit ``without`` it lacks; it may be ``key`` itself.

    ``found`` at the fit without it. ``None`` where nothing can be said, since the effect cannot be tested there.
    """
    tests, _, ranking = found
    own = next((t for t in tests if t.effect.entry.key == key and t.counts), None)
    if own is None:
        return None
    wanted = _shortlist(_known(tests, ranking), tests, rules)
    others = [test for test in _and_twins(campaign, wanted, [own, *wanted[:1]], tests) if test is not own]
    refits = [as_it_is(campaign, without, fit, own), *each_of(partial(refit, campaign, without), others, campaign, without)]
    flown = [r for r in looked(campaign, refits, tests) if r.flew]
    return _leader(campaign, judged(flown, penalty_of(campaign)), tests, rules) if flown else None


def _known(tests: Sequence[ScoreTest], ranking: Ranking) -> list[Hypothesis]:
    """Effects that have parameters which the data show."""
    return [h for h in ranking.hypotheses if not tests[h.effect].random and tests[h.effect].counts]


def _leader(campaign: Campaign, refitted: Sequence[Refitted], tests: Sequence[ScoreTest], rules: Rules) -> Refitted:
    """The likeliest of refits, the first, or what it contains, with those that cannot be told from it.

    First come its twins and what contains it and says more, then what the sum of both measures, scores' remainder and cost, likes best.
    """
    chosen = refitted[0]
    group = alike(refitted, chosen, penalty_of(campaign), rules.margin)
    leader = _simplest(campaign, chosen, group, tests)
    wide = wider(refitted, leader, rules.superfluous)
    first = twins_of(campaign, leader.test, [r.test for r in refitted]) | set(map(key_of, wide))
    held = {id(r) for r in (*with_twins(campaign, group, refitted, leader), *wide)}
    rivals = [r for r in refitted if id(r) in held and r is not leader]
    rivals.sort(key=lambda r: (key_of(r) not in first, r.criterion + dearer(r, chosen, penalty_of(campaign))))
    return replace(leader, group=named(map(key_of, (leader, *rivals))), rivals=tuple(rivals))


def _shortlist(known: Sequence[Hypothesis], tests: Sequence[ScoreTest], rules: Rules) -> list[ScoreTest]:
    """The likeliest effects of a look, and the one that explains most: the noise it is judged in may be its own absence."""
    if not known:
        return []
    window = known[0].criterion + rules.window
    close = [h.effect for i, h in enumerate(known[: rules.shortlist]) if i < FEWEST_REFITTED or h.criterion <= window]
    most = max((h.effect for h in known), key=lambda number: tests[number].explained)
    return [tests[number] for number in dict.fromkeys((*close, most))]


def _and_twins(campaign: Campaign, wanted: Sequence[ScoreTest], of: Sequence[ScoreTest], tests: Sequence[ScoreTest]) -> list[ScoreTest]:
    """What is ``wanted``, and the twins ``of`` some: a look may leave them far behind though nobody can tell them apart."""
    twins = {key for test in of for key in twins_of(campaign, test, tests)}
    return [*wanted, *(t for t in tests if t.effect.entry.key in twins and t.counts and all(t is not each for each in wanted))]


def _simplest(campaign: Campaign, chosen: Refitted, group: Sequence[Refitted], tests: Sequence[ScoreTest]) -> Refitted:
    """The chosen effect, or what it contains where that cannot be told from it and explains it in fewer words."""
    contained = [r for r in group if key_of(r) in chosen.test.effect.contains]
    if not contained:
        return chosen
    looks = Looks({t.effect.entry.key: t.effect for t in tests})
    return min((chosen, *contained), key=lambda r: criterion_of(campaign, r.fit, looks))


def random_contender(campaign: Campaign, fit: CampaignFit, found: Found, rules: Rules) -> tuple[Refitted, ...]:
    """The effect drawn anew in every frame, refitted, where it leads the linear look or is all that is significant; else nothing.

    Second differences show it where sums over smooth misfits, by which the others are ranked, show hardly anything.
    """
    tests, _, ranking = found
    first = next(h for h in ranking.hypotheses if tests[h.effect].counts)
    if not tests[first.effect].random and min((t.p for t in tests if not t.random), default=1.0) * len(tests) > rules.alpha:
        first = next((h for h in ranking.hypotheses if tests[h.effect].random), first)
    if not tests[first.effect].random:
        return ()
    refitted = refit(campaign, fit, tests[first.effect])
    return (refitted,) if refitted.holds_it else ()
