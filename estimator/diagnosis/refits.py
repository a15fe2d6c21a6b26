"""Refits of a campaign with one effect more, or two, and what the scores of all other effects say is left then.

What is left is counted in the noise that the refit of least cost shows. A poorer one shows more, and would be forgiven for it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from estimator.diagnosis.extending import fit_extended
from estimator.diagnosis.ranking import by_remainder, misfit_unit, surprise_of
from estimator.diagnosis.score_tests import Candidates, EfficientScores, ScoreTest, counts_nothing, score_tests
from estimator.fitting.campaign import Campaign, CampaignFit, cost_like
from estimator.motion.rigid_body import RanAway
from estimator.side_by_side import each_of

Array = NDArray[np.float64]
FEWEST = np.exp(np.e)
"""Measurements, of which the penalty is Akaike's 2."""
NO_SCORES = EfficientScores((), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)))


@dataclass(frozen=True)
class Rules:
    """When to believe.

    ``alpha``: p-value, corrected for the number of candidates, below which an effect is taken for missing. ``margin``: difference of the
    criterion within which effects cannot be told apart. ``shortlist``: effects refitted per step; ``window``: criterion above the
    best within which they are; ``pairs``: pairs refitted where one effect is not enough, so many that a look at the fit without both
    proposes and so many that looks beside one of them do; ``mates``: rivals refitted in place of each of a pair. ``most_effects`` a model
    may gain. ``superfluous``: p-value above which an effect is dropped again.
    """

    alpha: float = 0.01
    margin: float = 6.0
    shortlist: int = 4
    window: float = 40.0
    pairs: int = 2
    mates: int = 3
    most_effects: int = 6
    superfluous: float = 0.05


def penalty_of(campaign: Campaign) -> float:
    """Penalty per parameter among known effects: ``2 ln ln n`` of n independent measurements [Hannan and Quinn 1979], 2 at least."""
    return float(2.0 * np.log(np.log(max(campaign.kind.independent(campaign), FEWEST))))


@dataclass(frozen=True)
class Refitted:
    """A refit with an effect more, of ``parameters`` in the whole campaign.

    ``cost``: with the noise of the fit before, infinite where the fit was led astray. ``surprise`` at its value, where nature hardly
    produces it. ``others`` and ``scores``: the tests of all other effects beside it, with the noise of the fit ``like``; ``left``:
    chi-squared of what those scores say is left, of ``columns`` degrees of freedom. ``evidence`` is what the data say against it among
    others, ``criterion`` that with the surprise, both in the ``unit`` in which misfits were compared; ``rivals``: refits of the effects
    that it cannot be told from; ``group``: its own key and those of the likeliest of them.
    """

    test: ScoreTest
    fit: CampaignFit
    parameters: int
    cost: float = np.inf
    surprise: float = 0.0
    like: CampaignFit | None = None
    others: tuple[ScoreTest, ...] = ()
    scores: EfficientScores = NO_SCORES
    left: float = np.inf
    columns: int = 0
    unit: float = 1.0
    evidence: float = np.inf
    criterion: float = np.inf
    group: tuple[str, ...] = ()
    rivals: tuple["Refitted", ...] = ()

    @property
    def flew(self) -> bool:
        """Whether neither the fit was led astray nor the look at it."""
        return bool(np.isfinite(self.cost) and np.isfinite(self.left))

    @property
    def holds_it(self) -> bool:
        """Whether there is a fit with the effect at all: flights under it did not run away."""
        return key_of(self) in self.fit.model.keys


def key_of(refitted: Refitted) -> str:
    """The added effect."""
    return refitted.test.effect.entry.key


def judged(refits: Sequence[Refitted], penalty: float) -> list[Refitted]:
    """Refits by ascending criterion, what they leave counted in units of the least that any leaves per degree of freedom.

    See :func:`estimator.diagnosis.ranking.misfit_unit`.
    """
    unit = misfit_unit((r.left, r.columns) for r in refits if np.isfinite(r.left))
    found = [replace(r, unit=unit, evidence=r.left / unit + penalty * r.parameters) for r in refits]
    return sorted((replace(r, criterion=r.evidence + r.surprise) for r in found), key=lambda r: r.criterion)


def alike(refits: Sequence[Refitted], chosen: Refitted, penalty: float, margin: float) -> list[Refitted]:
    """Refits that the data cannot tell from the ``chosen`` one, itself among them.

    They are told apart where both what scores say is left and what the fits cost differ by more than the ``margin``; models are inexact,
    and the two may disagree. Costs count in the unit in which misfits were compared. Where some cost less than the chosen one beyond the
    margin the two speak for different effects: then those of nearly the least cost belong to the group.
    """
    more_than = [dearer(r, chosen, penalty) for r in refits]
    cheap = min(more_than, default=0.0) + margin
    return [
        r
        for r, more in zip(refits, more_than, strict=True)
        if r.evidence <= chosen.evidence + margin or -margin <= more <= margin or more <= min(cheap, margin)
    ]


def dearer(refitted: Refitted, chosen: Refitted, penalty: float) -> float:
    """How much more than the ``chosen`` one a refit costs, parameters counted, in the unit in which misfits were compared."""
    return 2.0 * (refitted.cost - chosen.cost) / chosen.unit + penalty * (refitted.parameters - chosen.parameters)


MOST_NAMED = 3
"""Members of an alias group with its first: of more that do as well, the likeliest are named. So many are alike where little is missing."""
TWIN_SHARE = 0.5
"""Least share of what an effect explains that its twin explains, too, where either may be there."""


def with_twins(campaign: Campaign, group: Sequence[Refitted], refits: Sequence[Refitted], chosen: Refitted) -> list[Refitted]:
    """A ``group`` with those refits of effects that the reduced models cannot claim to tell from the ``chosen`` one."""
    held, twins = {id(r) for r in group}, twins_of(campaign, chosen.test, [r.test for r in refits])
    return [r for r in refits if id(r) in held or key_of(r) in twins]


def wider(refits: Sequence[Refitted], chosen: Refitted, superfluous: float) -> list[Refitted]:
    """Refits of effects that contain the ``chosen`` one and whose further parameters say something, p below ``superfluous``.

    No data speak against what contains the truth; parameters cost more than a size near its detection limit pays for. By the scores or by
    the cost: models are inexact, and the two may disagree.
    """
    found = []
    for r in refits:
        more = r.parameters - chosen.parameters
        if key_of(chosen) in r.test.effect.contains and more > 0 and r.flew:
            gained = max(chosen.left - r.left, 2.0 * (chosen.cost - r.cost)) / chosen.unit
            found += [r] if chi2.sf(gained, more) < superfluous else []
    return found


def named(keys: Iterable[str]) -> tuple[str, ...]:
    """The alias group of the first of some ``keys``, given the likeliest of the others first."""
    return tuple(dict.fromkeys(keys))[:MOST_NAMED]


def twins_of(campaign: Campaign, test: ScoreTest, tests: Sequence[ScoreTest]) -> set[str]:
    """Keys of those of the ``tests`` whose effects the reduced models cannot claim to tell from a tested one."""
    if not test.effect.twins_on(np.inf):
        return set()
    hollow = max((campaign.kind.hollow(sequence) for sequence in campaign.sequences), default=0.0)
    twins = test.effect.twins_on(hollow)
    return {t.effect.entry.key for t in tests if t.effect.entry.key in twins and t.explained >= TWIN_SHARE * test.explained}


def refit(campaign: Campaign, fit: CampaignFit, test: ScoreTest) -> Refitted:
    """Refit with a tested effect, not looked at yet."""
    astray = Refitted(test, fit, len(test.columns), group=(test.effect.entry.key,))
    try:
        new = fit_extended(campaign, fit, test)
        cost = cost_like(campaign, new, fit)
    except (RanAway, np.linalg.LinAlgError):
        return astray
    if cost > fit.cost or _absent(new, test):
        return replace(astray, fit=new)
    return replace(astray, fit=new, cost=cost, surprise=surprise_of(test, _values(new, test)))


def as_it_is(campaign: Campaign, without: CampaignFit, fit: CampaignFit, test: ScoreTest) -> Refitted:
    """An effect that ``fit`` has and the fit ``without`` it lacks, where it was tested; not looked at yet."""
    cost = cost_like(campaign, fit, without)
    return Refitted(test, fit, len(test.columns), cost, surprise_of(test, _values(fit, test)), group=(test.effect.entry.key,))


def refit_pair(campaign: Campaign, before: CampaignFit, fit: CampaignFit, pair: tuple[ScoreTest, ScoreTest]) -> Refitted:
    """Refit with those of a pair that ``fit`` lacks, not looked at yet; the fit ``before`` lacks both.

    Its surprise is that of both values.
    """
    astray = Refitted(pair[1], fit, sum(len(test.columns) for test in pair))
    try:
        new = fit_extended(campaign, fit, *(test for test in pair if test.effect.entry.key not in fit.model.keys))
        cost = cost_like(campaign, new, before)
    except (RanAway, np.linalg.LinAlgError):
        return astray
    if cost > before.cost or any(_absent(new, test) for test in pair):
        return replace(astray, fit=new)
    return replace(astray, fit=new, cost=cost, surprise=sum(surprise_of(test, _values(new, test)) for test in pair))


def looked(campaign: Campaign, refits: Sequence[Refitted], tests: Sequence[ScoreTest]) -> list[Refitted]:
    """Refits with what the scores of all other effects say is left, in the noise of the one of least cost.

    Those that were led astray leave infinitely much: what cannot be flown explains nothing.
    """
    like = min(refits, key=lambda r: r.cost, default=None)
    if like is None:
        return list(refits)
    wanted = [i for i, r in enumerate(refits) if r.like is not like.fit and not np.isinf(r.cost)]
    seen = each_of(lambda i: _looked(campaign, refits[i], tests, like.fit), wanted, campaign, refits, tests)
    new = dict(zip(wanted, seen, strict=True))
    return [new.get(i, r) for i, r in enumerate(refits)]


def _looked(campaign: Campaign, refitted: Refitted, tests: Sequence[ScoreTest], like: CampaignFit) -> Refitted:
    """With what the scores say is left at the refit; infinitely much where flights run away."""
    asked = _at_their_best([t for t in tests if t.effect.entry.key not in refitted.fit.model.keys])
    try:
        with np.errstate(over="ignore", invalid="ignore"):  # of effects that cannot be flown from there
            others, scores = score_tests(campaign, refitted.fit, asked, like=like)
            ranking = by_remainder(scores, penalty=0.0)
    except (RanAway, np.linalg.LinAlgError):
        return replace(refitted, like=like, left=np.inf)
    return replace(refitted, like=like, left=ranking.nothing, columns=ranking.columns, others=tuple(others), scores=scores)


def _at_their_best(tests: Sequence[ScoreTest]) -> Candidates:
    """The effects of tests, each at its best starts alone; none that are drawn anew in every frame, or of which the data show nothing."""
    tests = [t for t in tests if t.starts and not t.random]
    return Candidates(tuple(t.effect for t in tests), tuple(np.unique(np.stack(list(t.starts.values())), axis=0) for t in tests))


def _absent(fit: CampaignFit, test: ScoreTest) -> bool:
    """Whether an effect that comes in whole numbers has none in a fit: parts of one may imitate anything that grows with time."""
    return counts_nothing(test.effect, test.columns, _values(fit, test))


def _values(fit: CampaignFit, test: ScoreTest) -> Array:
    """Fitted values (c,) of a test's columns."""
    part = fit.model.slices[fit.model.keys.index(test.effect.entry.key)]
    return np.array([fit.state.theta[column.sequence or 0][part][column.parameter] for column in test.columns])
