"""Score tests: what each effect that is not in the model would explain, with every other parameter re-adjusted.

At the fit of the base model the derivative of the cost by a candidate's parameters, with what the base parameters could do about it
taken off (Neyman's C(alpha), the efficient score ``g``), has mean ``-H theta`` where the effect has the size ``theta`` and covariance
``M``: the noise of each silhouette, of each calibrated view in all the sightings that use it, of the body-fixed error, and of the prior
[Neyman 1959; White 1982]. One step gives ``theta = -H⁻¹ g`` with covariance ``H⁻¹ M H⁻¹``, and ``gᵀ M⁻¹ g`` is chi-squared with as many
degrees of freedom as the effect has parameters where nothing is missing.

An effect that is not linear in a parameter (a frequency, the place of a gap) is tried at many values; the best counts, and its p-value is
corrected for their number.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from datasets.vocabulary.effects import Scope
from estimator.effects.link import LEAST_COUNT, EffectModel
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations, sequence_equations
from estimator.fitting.levenberg_marquardt import NormalEquations
from estimator.fitting.stable_inverse import stable_inverse
from estimator.fitting.system import Arrangement, System
from estimator.likelihood.time_shifts import JitterTest, jitter_test

Array = NDArray[np.float64]
Index = NDArray[np.int64]
SMALLEST_SHARE = 1e-3
"""Smallest eigenvalue of the scores' correlation matrix that is kept; below it, rounding would seem to distinguish aliased columns."""


@dataclass(frozen=True)
class Column:
    """One candidate column: which effect, at which of its starts, which parameter, and the first sequence of those that share it.

    ``sequence`` is ``None`` where all share it; an effect of a sequence is not shared.
    """

    effect: int
    start: int
    parameter: int
    sequence: int | None


@dataclass(frozen=True)
class Candidates:
    """Effects on trial and the starts (s, q) of each."""

    effects: tuple[EffectModel, ...]
    starts: tuple[Array, ...]

    @classmethod
    def of(cls, campaign: Campaign, effects: Iterable[EffectModel]) -> "Candidates":
        """Those of the effects that apply to such measurements, with the starts that they give themselves in the longest sequence.

        An effect without any is left out: no sequence is long enough to show it.
        """
        setting = max((each.setting for each in campaign.sequences), key=lambda each: len(each.times_s))
        adapted = (campaign.kind.adapted(e) for e in effects if campaign.kind.why_not(campaign, e) is None)
        found = [(e, starts) for e in adapted if len(starts := e.starts(setting))]
        return cls(tuple(e for e, _ in found), tuple(starts for _, starts in found))

    @property
    def tried(self) -> list[tuple[int, int]]:
        """Effect and start of everything that is tried."""
        return [(e, s) for e, starts in enumerate(self.starts) for s in range(len(starts))]


@dataclass(frozen=True)
class EfficientScores:
    """``g`` (c,), ``H`` (c, c) and, once noise has been counted, ``M`` (c, c) of the candidate columns."""

    columns: tuple[Column, ...]
    g: Array
    H: Array
    M: Array

    def take(self, rows: Index) -> "EfficientScores":
        """The columns ``rows`` (k,) alone."""
        square = np.ix_(rows, rows)
        M = self.M[square] if self.M.size else self.M
        return EfficientScores(tuple(self.columns[i] for i in rows), self.g[rows], self.H[square], M)

    @property
    def whitener(self) -> Array:
        """The map (r, c) to the r independent numbers of size one that the scores hold."""
        scale = 1.0 / np.sqrt(np.maximum(np.diag(self.M), 1e-300))
        value, vector = np.linalg.eigh(self.M * scale[:, None] * scale)
        told = value > SMALLEST_SHARE
        return np.asarray((vector[:, told] / np.sqrt(value[told])).T * scale)

    @cached_property
    def information(self) -> Array:
        """Information (c, c) of the scores on the amplitudes, ``H M⁻¹ H``."""
        signature = self.whitener @ self.H
        return np.asarray(signature.T @ signature)


@dataclass(frozen=True)
class ScoreTest:
    """One effect on trial.

    ``theta`` (c,) one-step values of its ``columns`` and ``covariance`` (c, c); ``statistic`` and its p-value ``p``, corrected for the
    starts tried, 1 where an effect that comes in whole numbers has none; ``starts`` [sequence or None] the best start.
    ``starts`` (q,) each.
    """

    effect: EffectModel
    columns: tuple[Column, ...]
    theta: Array
    covariance: Array
    statistic: float
    p: float
    starts: dict[int | None, Array]

    @property
    def random(self) -> bool:
        """Whether the effect is drawn anew in every frame, and has a likelihood's gain instead of scores."""
        return self.effect.random


Tested = tuple[list[ScoreTest], EfficientScores]
"""Tests of some candidates, and the scores of the columns that were kept."""


def score_tests(campaign: Campaign, fit: CampaignFit, candidates: Candidates) -> Tested:
    """Test every candidate against the fit; also the scores of the columns that were kept, for comparing effects with one another."""
    linear = arranged(campaign, candidate_equations(campaign, fit, candidates), fit.model, candidates)
    scores, chosen = efficient_scores(campaign, fit, linear)
    jitter = jitter_test(campaign.time_shifts(linear.equations))
    return [test_of(scores, candidates, number, chosen, jitter) for number in range(len(candidates.effects))], scores


def efficient_scores(campaign: Campaign, fit: CampaignFit, linear: "Linear") -> tuple[EfficientScores, dict[tuple[int, int | None], int]]:
    """Scores of the best start of every effect with their noise, and which start that is, by effect and sequence."""
    scores, projection, seen = _projected(campaign, fit, linear)
    chosen = _best_starts(scores)
    kept = np.array([i for i, c in enumerate(scores.columns) if chosen.get((c.effect, c.sequence)) == c.start and seen[i]], dtype=np.int64)
    scores = scores.take(kept)
    scores = replace(scores, M=_noise(campaign, fit, linear, (projection, kept)))
    return scores.take(np.flatnonzero(np.diag(scores.M) > LEAST_NOISE * np.diag(scores.H))), chosen


@dataclass(frozen=True)
class Linear:
    """The joint model's equations of every sequence, and where its candidates' ``columns`` lie among all of these.

    ``number`` (j,) of each sequence: that of its candidates' j parameters, one more than there are columns where it shows nothing of them.
    """

    equations: tuple[SequenceEquations, ...]
    columns: tuple[Column, ...]
    number: tuple[Index, ...]


def joint_model(model: Model, candidates: Candidates) -> tuple[Model, Array]:
    """A model with every start of every candidate beside it, and the parameters of those starts."""
    extra = candidates.tried
    tried = np.concatenate([np.zeros(0)] + [candidates.starts[e][s] for e, s in extra])
    return Model((*model.effects, *(candidates.effects[e] for e, _ in extra))), tried


def candidate_equations(campaign: Campaign, fit: CampaignFit, candidates: Candidates) -> tuple[SequenceEquations, ...]:
    """Every sequence linearised in the parameters of the fit and of all candidates."""
    model, tried = joint_model(fit.model, candidates)
    state = CampaignState(fit.state.flights, tuple(np.concatenate([theta, tried]) for theta in fit.state.theta))
    return tuple(sequence_equations(campaign, i, state, model) for i in range(len(campaign.sequences)))


def arranged(campaign: Campaign, equations: tuple[SequenceEquations, ...], model: Model, candidates: Candidates) -> Linear:
    """Where each candidate's columns lie in the equations of the sequences; ``model`` is the fit's own."""
    extra, first = candidates.tried, model.layout.size
    names: list[tuple[int, int, int]] = []
    for e, s in extra:
        names += [(e, s, p) for p in range(len(candidates.effects[e].entry.parameters))]
    sharing = {scope: campaign.sharing(scope) for scope in Scope}
    searched = [candidates.effects[e].entry.parameters[p].name in candidates.effects[e].entry.searched for e, _, p in names]
    columns: list[Column] = []
    lookup: dict[Column, int] = {}
    number: list[list[int | None]] = []
    for i in range(len(equations)):
        number.append([None] * len(names))
        for j, (e, s, p) in enumerate(names):
            flat = searched[j] and not equations[i].errors.J[..., first + j].any()
            if flat:
                continue
            scope = candidates.effects[e].entry.scope
            own = scope.own or len(set(sharing[scope])) > 1
            column = Column(e, s, p, sharing[scope][i] if own else None)
            if column not in lookup:
                lookup[column] = len(columns)
                columns.append(column)
            number[i][j] = lookup[column]
    places = tuple(np.array([len(columns) if n is None else n for n in numbers], dtype=np.int64) for numbers in number)
    return Linear(equations, tuple(columns), places)


@dataclass(frozen=True)
class _Projection:
    """What all parameters do with one unit of each of c candidates, those of the fit to undo it.

    ``undone`` (b, c): what the fit's b do less; they and then the candidates lie ``at`` their places; ``local`` [sequence] (l, k): how what
    is the sequence's alone follows its k of them.
    """

    at: Arrangement
    local: Array
    undone: Array


LEAST_NOISE = 0.1
"""Variance of a score over its information, about 1 and more: where it is less, both are what rounding leaves of an alias in the model."""
SMALLEST_VISIBLE = 1e-12
"""Share of a column's information that must be left when the base parameters have done what they can; less is rounding."""


def _projected(campaign: Campaign, fit: CampaignFit, linear: Linear) -> tuple[EfficientScores, _Projection, NDArray[np.bool_]]:
    """Efficient scores without their noise, the projection behind them, and which columns (c,) the data see at all."""
    layout, b, c = fit.layout, fit.layout.size, len(linear.columns)
    places = (np.concatenate([place, layout.p + number]) for place, number in zip(layout.places, linear.number, strict=True))
    at, known = Arrangement(tuple(places), layout.p + c + 1, layout.local), fit.system(campaign).known
    more = NormalEquations(np.pad(known.H, (0, c + 1)), np.pad(known.g, (0, c + 1)), known.cost)
    reduced, whole = System(linear.equations, at, more, fit.cost).reduced(), np.zeros(b + c + 1)
    for each, place in zip(linear.equations, at.place, strict=True):
        whole[place] += np.diag(each.H)[at.shared]
    B = stable_inverse(reduced.H[:b, :b]) @ reduced.H[:b, b:-1]
    H, undone = reduced.H[b:-1, b:-1], reduced.H[b:-1, :b] @ B
    H -= undone
    H = np.multiply(np.add(H, H.T, out=undone), 0.5, out=undone)  # in place: there may be thousands of columns
    scores = EfficientScores(linear.columns, reduced.g[b:-1] - B.T @ reduced.g[:b], H, np.zeros((0, 0)))
    return scores, _Projection(at, reduced.answer, B), np.diag(H) > SMALLEST_VISIBLE * whole[b:-1]


def _best_starts(scores: EfficientScores) -> dict[tuple[int, int | None], int]:
    """For each effect (and sequence, where it has parameters of its own) the start that explains most."""
    rows: dict[tuple[int, int | None], dict[int, list[int]]] = {}
    for i, column in enumerate(scores.columns):
        rows.setdefault((column.effect, column.sequence), {}).setdefault(column.start, []).append(i)

    def explained(those: list[int]) -> float:
        part = scores.take(np.array(those, dtype=np.int64))
        return float(part.g @ stable_inverse(part.H, 1e-10) @ part.g)

    return {key: max(each, key=lambda start: explained(each[start])) if len(each) > 1 else min(each) for key, each in rows.items()}


def _noise(campaign: Campaign, fit: CampaignFit, linear: Linear, which: tuple[_Projection, Index]) -> Array:
    """Covariance (c, c) of the efficient scores of the columns kept."""
    projection, kept = which
    at, B, b = projection.at, projection.undone[:, kept], fit.layout.size
    combined, more = [], campaign.kind.noise_ratio(campaign, linear.equations)
    total = np.zeros((b + len(linear.columns) + 1,) * 2)
    total[:b, :b] = fit.system(campaign).known.H
    for each, place, local in zip(linear.equations, at.place, projection.local, strict=True):
        change = np.empty((each.frames.weighted.shape[-1], len(place)))
        change[at.local], change[at.shared] = local, np.eye(len(place))
        combined.append(each.frames.combined(change, more))
        np.add.at(total, (place[:, None], place), combined[-1].meat)
    errors = [each.errors for each in linear.equations]
    total += campaign.kind.repeated_noise(campaign, errors, combined, Arrangement(at.place, len(total)), errors)
    less = B.T @ (total[:b, b + kept] - 0.5 * total[:b, :b] @ B)
    M = total[np.ix_(b + kept, b + kept)] - less - less.T
    return np.asarray(0.5 * (M + M.T))


def test_of(
    scores: EfficientScores, candidates: Candidates, number: int, chosen: Mapping[tuple[int, int | None], int], jitter: JitterTest
) -> ScoreTest:
    """The test of candidate ``number``; the ``chosen`` starts explain most. What is drawn anew in every frame the residuals judge."""
    effect, starts = candidates.effects[number], candidates.starts[number]
    if effect.random:
        sigma, variance = np.array([jitter.sigma_s]), np.array([[jitter.sigma_error_s**2]])
        return ScoreTest(effect, (), sigma, variance, jitter.gain, jitter.p, {None: sigma})
    part = scores.take(np.array([i for i, c in enumerate(scores.columns) if c.effect == number], dtype=np.int64))
    inverse = stable_inverse(part.H, 1e-10)
    theta = -inverse @ part.g
    return ScoreTest(
        effect=effect,
        columns=part.columns,
        theta=theta,
        covariance=inverse @ part.M @ inverse,
        statistic=_statistic(part),
        p=1.0 if counts_nothing(effect, part.columns, theta) else p_of(part, len(starts)),
        starts={sequence: starts[start] for (e, sequence), start in chosen.items() if e == number},
    )


def _statistic(part: EfficientScores) -> float:
    return float(part.g @ stable_inverse(part.M, 1e-10) @ part.g)


def _log_p(part: EfficientScores) -> float:
    """Logarithm of the p-value of all columns together; minus infinity where it is too small for a number."""
    with np.errstate(divide="ignore"):
        return float(np.log(chdtrc(len(part.columns), _statistic(part))))


def p_of(part: EfficientScores, tried: int) -> float:
    """The p-value of an effect of which the best of ``tried`` starts was taken, in each sequence where it has its own.

    All sequences together count every combination of starts, which is too much where one of many shows the effect; then that one
    counts, out of all. The better of both is taken, twice as likely by chance.
    """
    if not part.columns:
        return 1.0
    sequences = sorted({c.sequence for c in part.columns if c.sequence is not None})
    jointly = _log_p(part) + max(len(sequences), 1) * float(np.log(tried))
    if tried == 1 or len(sequences) < 2:
        return float(np.exp(min(jointly, 0.0)))
    rows = [np.array([i for i, c in enumerate(part.columns) if c.sequence == s], dtype=np.int64) for s in sequences]
    singly = min(_log_p(part.take(each)) for each in rows) + np.log(tried * len(sequences))
    return float(np.exp(min(min(jointly, singly) + np.log(2.0), 0.0)))


def counts_nothing(effect: EffectModel, columns: tuple[Column, ...], theta: Array) -> bool:
    """Whether an effect that comes in whole numbers has none; ``theta`` (c,) of the columns."""
    counts = [value for column, value in zip(columns, theta, strict=True) if effect.entry.parameters[column.parameter].name in effect.whole]
    return bool(effect.whole) and max(counts, default=0.0) < LEAST_COUNT
