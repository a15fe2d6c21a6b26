"""What a fitted campaign misses: the posterior over sets of effects about that fit, and what each candidate alone would explain.

The verdict is that of the evidence. Beside it every candidate has its score test: whether noise alone would give scores as large as
these, corrected for the number of candidates.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from datasets.vocabulary.effects import Parameter, Stage
from estimator.diagnosis.score_tests import ScoreTest
from estimator.diagnosis.selection.groups import FACTOR, group_of
from estimator.diagnosis.selection.names import key_of
from estimator.diagnosis.selection.path import At, looked_at
from estimator.diagnosis.selection.search import Set
from estimator.diagnosis.selection.testing import scores_beside, tests_beside
from estimator.effects.link import EffectModel
from estimator.effects.parameter_values import WithInterval
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit

ALPHA = 0.01
"""p-value, corrected for the number of candidates, below which the scores of one are no noise (decision 47)."""
SEEN_IN_95_PERCENT = 3.3
"""A size this many standard deviations large is called in 95% of cases where 1.65 of them are asked for in addition to 1.65."""
MOST_BLIND = 0.5
"""Share of the candidates that a campaign may be blind to before it says nothing."""


@dataclass(frozen=True)
class Finding:
    """One candidate: its score ``test``, ``p`` of that corrected for the number of candidates, and the ``share`` that it explains alone.

    ``share``, 0 to 1, is of what the best set explains; ``probability`` of the candidate to be in the model; ``log_odds`` (nats) of the
    model with it alone against the model as it is.
    """

    test: ScoreTest
    p: float
    share: float
    probability: float
    log_odds: float

    @property
    def key(self) -> str:
        """The effect's key."""
        return self.test.effect.entry.key


@dataclass(frozen=True)
class Unknown:
    """The most probable empirical family: its test, corrected p-value, all families' tests, and whether it is ``present`` in the best set.

    Families (:mod:`estimator.effects.empirical.families`) compete with the effects of the catalogue for a place in the model. The one that
    is in the most probable set says at which stage something sits that no effect of the catalogue explains; where none is, the one that
    would be the most probable is told, as not present. ``sure``: probability that it, or something in its place, is missing.
    """

    test: ScoreTest
    p: float
    tests: tuple[ScoreTest, ...]
    present: bool
    sure: float = 1.0

    @property
    def stage(self) -> Stage:
        """Where it sits."""
        return self.test.effect.entry.stage


@dataclass(frozen=True)
class Diagnosis:
    """All candidates by descending odds, and what the evidence says of the model.

    ``findings``: effects of the catalogue that the model lacks, ``families``: empirical ones; ``missing``: keys that the most probable set
    has beside the model's own, families among them, none where nothing is missing; ``group``: the first of them and what the data cannot
    tell from it; ``superfluous``: the model's effects that the most probable set does without; ``probability`` that the model as it is
    lacks nothing; ``p``: the least corrected p-value; ``chi_square`` of so many ``degrees``: all candidates' scores together.
    """

    findings: tuple[Finding, ...]
    families: tuple[Finding, ...]
    missing: tuple[str, ...]
    group: tuple[str, ...]
    superfluous: tuple[str, ...]
    probability: float
    p: float
    chi_square: float
    degrees: int

    @property
    def p_all_together(self) -> float:
        """Probability of scores as large as these where nothing is missing."""
        return float(chdtrc(max(self.degrees, 1), self.chi_square))

    @property
    def unknown(self) -> Unknown | None:
        """What no effect of the catalogue explains; ``None`` where no family applies."""
        if not self.families:
            return None
        best = max(self.families, key=lambda f: (f.key in self.missing, f.log_odds))
        tests = tuple(f.test for f in self.families)
        return Unknown(best.test, min(1.0, best.test.p * len(tests)), tests, best.key in self.missing)


def diagnose(campaign: Campaign, fit: CampaignFit, candidates: Mapping[str, EffectModel]) -> Diagnosis:
    """Every candidate that is not in the model, and every empirical family, on trial."""
    return diagnosis_at(looked_at(campaign, fit, candidates, unknown=True))


def diagnosis_at(at: At, *, ended: bool = False) -> Diagnosis:
    """The diagnosis where a search stands; where it has ``ended``, what is more probable there was refitted and refused."""
    of, noise = at.trial.evidence.of, at.trial.noise
    numbers, tests = range(of.own, len(of.effects)), tests_beside(of)
    n = len(set(numbers) - at.trial.families - noise)
    found = {number: _finding(at, number, test, n) for number, test in zip(numbers, tests, strict=True) if number not in noise}
    known = sorted((f for number, f in found.items() if number not in at.trial.families), key=lambda f: -f.log_odds)
    best: Set = at.members if ended else _best(at)
    without = {e: tuple(m for m in best if m != e) for e in best}
    new = sorted(set(best) - set(at.members), key=lambda e: (e in at.trial.families, at.trial.log_posterior(without[e])))
    group = tuple(key_of(at, name) for name in group_of(at.trial, best, new[0])) if new else ()
    scores = scores_beside(of)
    white = scores.whitener @ scores.g if len(scores.g) else np.zeros(0)
    p = min((f.p for f in known), default=1.0)
    nothing = 1.0 - at.posterior.more_than(at.members)
    superfluous = at.named(tuple(e for e in at.members if e not in best))
    families = tuple(f for number, f in found.items() if number in at.trial.families)
    return Diagnosis(tuple(known), families, at.named(tuple(new)), group, superfluous, nothing, p, float(white @ white), len(white))


def _best(at: At) -> Set:
    """The most probable set that holds the model; another one only where it fits clearly better: an alias in its place is no news."""
    best, holds = at.posterior.best, next(s for s in at.posterior.sets if set(s) >= set(at.members))
    gained = at.trial.evidence.fitted(best).log_likelihood - at.trial.evidence.fitted(holds).log_likelihood
    return best if set(best) >= set(at.members) or gained > np.log(FACTOR) else holds


def _finding(at: At, number: int, test: ScoreTest, candidates: int) -> Finding:
    with_it = tuple(sorted((*at.members, number)))
    own, best = (at.trial.evidence.fitted(s).log_likelihood for s in (at.members, at.posterior.best))
    gained = at.trial.evidence.fitted(with_it).log_likelihood - own
    share = float(np.clip(gained / max(best - own, gained, 1e-12), 0.0, 1.0))
    odds = at.trial.log_posterior(with_it) - at.value
    return Finding(test, min(1.0, test.p * candidates), share, at.posterior.probability(number), float(odds))


@dataclass(frozen=True)
class TestedValue(WithInterval):
    """One parameter of an effect on trial; ``sequence``: number of the sequence it belongs to, ``None`` where sequences share it."""

    __test__ = False
    parameter: Parameter
    sequence: int | None
    value: float
    sigma: float

    @property
    def seen_from(self) -> float:
        """Size that would be seen in 95% of cases, in the parameter's unit."""
        return SEEN_IN_95_PERCENT * self.sigma


def tested_values(test: ScoreTest) -> tuple[TestedValue, ...]:
    """All values of a test; an effect that is random has no columns, and its one value is a standard deviation."""
    parameters = test.effect.entry.parameters
    places = [(c.parameter, c.sequence) for c in test.columns] or [(0, None)]
    sigma = np.sqrt(np.maximum(np.diag(test.covariance), 0.0)).tolist()
    values = zip(places, test.theta.tolist(), sigma, strict=False)
    return tuple(TestedValue(parameters[number], sequence, value, s) for (number, sequence), value, s in values)


def blind_to(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Candidates that these data would not show even at the end of their plausible range."""
    return tuple(finding.key for finding in diagnosis.findings if not _visible(finding.test))


def says_nothing(diagnosis: Diagnosis) -> bool:
    """Whether a campaign is too short to say anything: it is blind to most effects."""
    return len(blind_to(diagnosis)) > MOST_BLIND * len(diagnosis.findings)


def _visible(test: ScoreTest) -> bool:
    largest = {p.name: max(abs(p.plausible[0]), abs(p.plausible[1])) for p in test.effect.entry.parameters}
    return any(0.0 < value.seen_from < largest[value.parameter.name] for value in tested_values(test))
