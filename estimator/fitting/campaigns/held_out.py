"""How well a model predicts what was not used to fit it.

Sequences are dealt into four parts, or as many as there are sequences: what they share is fitted on the others, and each part is judged
with that [Stone 1974]. A sequence that is judged still needs its own state: every fourth frame is judged with the state that the three
others give, four times in turn, so that every frame counts once. The state without a quarter is the state with it less one Gauss-Newton
step (PRESS, [Allen 1974]).

What the other parts leave open of all that is shared, those three quarters settle: values there are a prior with the others' information.
Moments of inertia show in a sequence that spins fast and hardly in slow ones, whose values would misjudge it by more than most effects do.
What the others do tell holds, for a sequence is a small part of what is known of an effect that all show.

What is known to be small (the hull's errors of mass, the outline offset, the instrument's discrepancy) begins within ``MOST`` standard
deviations of its prior when a model is judged: a base model that borrows a missing effect from there does not predict.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtr

from datasets.vocabulary.effects import Scope
from estimator.effects.model import Model
from estimator.fitting.campaigns.campaign import (
    Campaign,
    CampaignFit,
    CampaignState,
    SequenceEquations,
    fit_campaign,
    layout_of,
    sequence_equations,
)
from estimator.fitting.descent import Effort
from estimator.fitting.side_by_side import each_of
from estimator.fitting.stable_inverse import stable_inverse
from estimator.motion.flight import LAYOUT
from estimator.motion.rigid_body import RanAway

Array = NDArray[np.float64]
PARTS, QUARTERS = 4, 4
"""Parts of the sequences, and of a sequence's frames, that are held out in turn (notebooks 10 and 33)."""
MOST = 2.0
"""Standard deviations of its prior that something held by a prior begins within (notebook 19)."""
LOCAL_STEPS, SETTLED = 6, 0.05
"""Steps of a refit without what is held out, and the step in standard deviations that ends it: it begins near its end. By judgement."""
ASTRAY = (RanAway, np.linalg.LinAlgError, FloatingPointError)


@dataclass(frozen=True)
class HeldOut:
    """Errors held out, in px or the unit of the kind of measurement: sums of ``squares`` and ``counts`` (n,) of each sequence's rows."""

    squares: tuple[Array, ...]
    counts: tuple[Array, ...]

    @property
    def rms_px(self) -> float:
        """Root mean square of all."""
        return float(np.sqrt(sum(each.sum() for each in self.squares) / max(self.errors, 1)))

    @property
    def per_sequence_px(self) -> Array:
        """Those of each sequence (s,); infinite where its flight has left all that was measured behind."""
        each = zip(self.squares, self.counts, strict=True)
        return np.array([np.sqrt(squares.sum() / counts.sum()) if counts.any() else np.inf for squares, counts in each])

    @property
    def errors(self) -> int:
        """How many there are."""
        return int(sum(each.sum() for each in self.counts))

    def worse_by_chance(self, other: "HeldOut") -> float:
        """p-value of it predicting the same sequences as badly beside another where neither is worse, of all or of the worst of them.

        What is chance the rows of each sequence say: half the mean square of the change of a difference from one row to the next, which
        a misfit that lasts does not enter [von Neumann 1941], as good as two thirds of so many independent ones. Scatter between
        sequences would excuse a model that is ruined in one of them.
        """
        both = [(mine > 0.0) & (others > 0.0) for mine, others in zip(self.counts, other.counts, strict=True)]
        pairs = zip(self.squares, other.squares, both, strict=True)
        each = np.array([_difference(mine[rows], others[rows]) for mine, others, rows in pairs])
        worse, variance, freedom = np.vstack([each, each.sum(axis=0)]).T
        with np.errstate(divide="ignore", invalid="ignore"):
            p = stdtr(np.maximum(freedom, 1.0), np.nan_to_num(-worse / np.sqrt(variance), posinf=np.inf, neginf=-np.inf))
        return float(min(p[:-1].min() * len(each), p[-1]))


def _difference(squares: Array, other: Array) -> tuple[float, float, float]:
    """By how much squares (n,) are larger than others in all, its variance by chance, its freedom.

    Infinitely much, either way, where one of them is not predicted at all; no number where neither is.
    """
    if not np.isfinite([squares, other]).all():
        return float(np.inf * (float(np.isinf(squares).any()) - float(np.isinf(other).any()))), 1.0, 1.0
    worse = squares - other
    changes = np.diff(worse)
    return float(worse.sum()), float(0.5 * len(worse) * np.mean(changes**2)) if len(changes) else 0.0, 2.0 * len(changes) / 3.0


def held_out(campaign: Campaign, state: CampaignState, model: Model) -> HeldOut:
    """Judge a model on frames and sequences that it was not fitted to; ``state`` is where fits start."""
    parts = _parts(campaign)
    found = [each for part in each_of(partial(_judged, campaign, state, model), parts) for each in part]
    squares, counts = zip(*(found[i] for i in np.argsort(np.concatenate(parts))), strict=True)
    return HeldOut(squares, counts)


def _judged(campaign: Campaign, state: CampaignState, model: Model, judged: NDArray[np.int64]) -> list[tuple[Array, Array]]:
    """Sums of squares and numbers of errors of the rows of each of the ``judged`` sequences, with what the others share."""
    n = len(campaign.sequences)
    learned_from = np.setdiff1d(np.arange(n), judged) if n > 1 else judged
    others = campaign.part(learned_from.tolist())
    try:
        fit = fit_campaign(others, _state_of(state, learned_from), model, Effort(LOCAL_STEPS, LOCAL_STEPS))
        learned = _Learned(learned_from, fit, fit.system(others).solved().shared if n > 1 else None)
    except ASTRAY:
        return [_not_predicted(campaign, int(i)) for i in judged]
    return [_judge(campaign, int(i), state, learned) for i in judged]


def _parts(campaign: Campaign) -> list[NDArray[np.int64]]:
    """The sequences in parts, beside each of which there are some of every particle and camera that has several.

    Flights of one recording are judged together, unless the campaign is a single recording.
    """
    recording = np.array(campaign.sharing(Scope.RECORDING))
    first = np.unique(recording)
    if len(first) == 1:
        recording = first = np.arange(len(recording))
    dealt = sorted(first.tolist(), key=lambda i: (campaign.particle[i], campaign.camera[i], i))
    return [np.flatnonzero(np.isin(recording, dealt[start::PARTS])) for start in range(min(len(first), PARTS))]


@dataclass(frozen=True)
class _Learned:
    """The ``fit`` to a part of the sequences, those ``rows`` (r,) of a campaign, and the covariance of all that they share.

    There is no covariance where the fit is to what it judges, and tells nothing.
    """

    rows: NDArray[np.int64]
    fit: CampaignFit
    covariance: Array | None

    def told(self, campaign: Campaign, number: int) -> NDArray[np.int64]:
        """Of every column (21 + q,) of sequence ``number``, the first of these that it shares it with; -1 where none does."""
        both, last = campaign.part([*self.rows.tolist(), number]), len(self.rows)
        first = {scope: last if scope.own else both.sharing(scope)[last] for scope in Scope}
        found = np.array([first[scope] for scope in self.fit.model.layout.scopes])
        return np.where(found < last, found, -1)

    def information(self, columns: NDArray[np.int64], teller: NDArray[np.int64]) -> Array:
        """What is known here of shared ``columns`` (c,) that sequences ``teller`` tell of: (c, c), nothing of those that none does."""
        total = np.zeros((len(columns), len(columns)))
        known = np.flatnonzero(teller[columns] >= 0)
        if self.covariance is None or not len(known):
            return total
        at = self.fit.layout
        place = np.array([at.places[teller[columns[i]]][columns[i]] - at.first for i in known], dtype=np.int64)
        total[np.ix_(known, known)] = stable_inverse(self.covariance[np.ix_(place, place)])
        return total


def _state_of(state: CampaignState, rows: NDArray[np.int64]) -> CampaignState:
    return CampaignState(tuple(state.flights[i] for i in rows), tuple(state.theta[i] for i in rows))


def _judge(campaign: Campaign, number: int, own: CampaignState, learned: _Learned) -> tuple[Array, Array]:
    """Sums of squares and numbers (n,) of the errors of one sequence's rows, each predicted from the frames of the other quarters.

    Where a flight runs away from there, or has no normal matrix, nothing is predicted, and the sum is infinite.
    """
    model = learned.fit.model
    sequence = campaign.sequences[number]
    layout = layout_of(campaign, model)
    alone = campaign.part([number])
    teller = learned.told(campaign, number)
    state = _with_shared(_state_of(own, np.array([number])), learned.fit.state, teller)
    state = _within_priors(state, campaign.kind.precision(sequence), model)
    free = np.append(np.zeros(LAYOUT.size, dtype=np.bool_), model.instrument_precision == 0.0)
    told = (teller >= 0) & (learned.covariance is not None)
    open_ = layout.shared[(free | told)[layout.shared]]
    columns = np.concatenate([layout.local, open_])
    prior = np.zeros((len(columns), len(columns)))
    prior[len(layout.local) :, len(layout.local) :] = learned.information(open_, teller)
    try:
        with np.errstate(over="raise", invalid="raise"):
            equations, normal = _settled(alone, state, columns, prior, model)
            e = np.sum([_left_out(equations, columns, normal, start) for start in range(QUARTERS)], axis=0)
    except ASTRAY:
        return _not_predicted(campaign, number)
    seen = equations.errors.seen & (equations.errors.seen.sum(axis=0) >= QUARTERS)
    return _by_row(e**2), _by_row(seen)


def _not_predicted(campaign: Campaign, number: int) -> tuple[Array, Array]:
    """The same of a flight that runs away."""
    n = campaign.kind.sightings(campaign.sequences[number])
    return np.full(n, np.inf), np.ones(n)


def _by_row(values: Array) -> Array:
    """Sums (n,) over everything that is measured in one row."""
    return np.asarray(values.reshape(len(values), -1).sum(axis=1), dtype=np.float64)


def _settled(
    alone: Campaign, state: CampaignState, columns: NDArray[np.int64], prior: Array, model: Model
) -> tuple[SequenceEquations, tuple[Array, Array]]:
    """The equations of one sequence where its own columns have settled under a ``prior``, and their normal matrix and gradient."""
    began = state.theta[0]
    equations = sequence_equations(alone, 0, state, model)
    for _ in range(LOCAL_STEPS):
        H, g = _with_prior(equations, columns, prior, state.theta[0] - began)
        inverse = stable_inverse(H)
        step, whole = -inverse @ g, np.zeros(model.layout.size)
        whole[columns] = step
        state = state.moved([whole])
        equations = sequence_equations(alone, 0, state, model)
        if np.max(np.abs(step) / np.sqrt(np.maximum(np.diag(inverse), 1e-300))) < SETTLED:
            break
    return equations, _with_prior(equations, columns, prior, state.theta[0] - began)


def _with_prior(equations: SequenceEquations, columns: NDArray[np.int64], prior: Array, gone: Array) -> tuple[Array, Array]:
    """Normal matrix and gradient of ``columns`` with a ``prior`` on effects, from whose values these have ``gone`` (q,)."""
    away = np.append(np.zeros(LAYOUT.size), gone)[columns]
    return equations.frames.H[np.ix_(columns, columns)] + prior, equations.frames.g[columns] + prior @ away


def _left_out(equations: SequenceEquations, columns: NDArray[np.int64], normal: tuple[Array, Array], start: int) -> Array:
    """Errors (n, ...) of every fourth frame from ``start`` on, under the state that the other frames give; zero in those.

    What is measured in fewer frames than there are quarters is never left out, as a spin that was read once: no other frame tells it.
    """
    frames, errors = equations.frames, equations.errors
    out = np.zeros(errors.e.shape, dtype=np.bool_)
    out[start::QUARTERS] = errors.seen.sum(axis=0) >= QUARTERS
    e, J, W = errors.e[out], errors.J[out][:, columns], frames.weighted[out][:, columns]
    step = -stable_inverse(normal[0] - J.T @ W) @ (normal[1] - W.T @ e)
    left = np.zeros(errors.e.shape)
    left[out] = e + J @ step
    return left


def _with_shared(own: CampaignState, learned: CampaignState, teller: NDArray[np.int64]) -> CampaignState:
    """One sequence's own state with every column (21 + q,) that a sequence of others tells of taken from there."""
    (values,), others, told = own.values, learned.values, np.flatnonzero(teller >= 0)
    step = np.zeros(len(values))
    step[told] = [others[teller[column]][column] - values[column] for column in told]
    return own.moved([step])


def _within_priors(state: CampaignState, precision: Array, model: Model) -> CampaignState:
    """The state with everything that a prior holds brought within ``MOST`` of its standard deviations."""
    (values,), limit = state.values, MOST / np.sqrt(np.maximum(np.concatenate([precision, model.instrument_precision]), 1e-300))
    return state.moved([np.clip(values, -limit, limit) - values])
