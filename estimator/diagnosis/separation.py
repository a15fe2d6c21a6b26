"""What further data would distinguish effects that these data cannot.

Where effect A has the size ``theta`` and nothing else is missing, effect B in its place loses the log likelihood by which groups are made
(:mod:`estimator.diagnosis.selection.groups`): ``d = thetaᵀ (G_AA - G_AB G_BB⁻¹ G_BA) theta / 2`` with the information ``G = H M⁻¹ H`` of
the scores. In data with noise the logarithm of the ratio is normal about ``d`` with the variance ``2 d`` [Cox 1961]. ``G`` needs no data,
only where tangencies would lie: so it is worked out for the campaign as it is, and for the campaign with an imagined recording more. A pair
counts as distinguished where the likelihood ratio exceeds ``FACTOR`` in 95% of cases, whichever of the two is true; each is taken at the
size that the campaign gives it.

Holds as far as effects are small enough for their signatures to be linear. An effect with one value per sequence is taken to be absent from
a new recording.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr

from datasets.vocabulary.effects import Stage, whose
from estimator.diagnosis.candidate_recordings import (
    MEASUREMENTS,
    RECORDINGS,
    CandidateMeasurement,
    CandidateRecording,
    corners_of,
)
from estimator.diagnosis.imagined_sequences import Drop, Imagination, counted
from estimator.diagnosis.score_tests import (
    Candidates,
    Column,
    EfficientScores,
    ScoreTest,
    arranged,
    candidate_equations,
    efficient_scores,
    joint_model,
)
from estimator.diagnosis.selection.groups import FACTOR
from estimator.effects.catalogue.segmentation.view_outline_offset import ViewOutlineOffset
from estimator.fitting.campaigns.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations, layout_of, sequence_equations
from estimator.fitting.campaigns.registered import Registered
from estimator.fitting.side_by_side import each_of
from estimator.fitting.stable_inverse import stable_inverse
from estimator.motion.flight import Flight, V
from estimator.particle.particle import Particle

Array = NDArray[np.float64]
Pair = tuple[str, str]
MARGIN = float(np.log(FACTOR))
"""Log likelihood ratio (nats) from which on two effects count as distinguished."""
SURE = 0.95
"""Probability with which data must distinguish a pair to be advised (decision 47)."""
MORE_VIEWS = "twice as many calibrated views"
MOST_RIVALS = 2
"""Effects beside the first that are compared with it: more alike than these is no group any more."""
KNOWN_START = 0.005
"""Share of the speed to which the velocity after a fall from a known height is known."""
LEAST_SIGHTINGS, MOST_SIGHTINGS, MOST_TOGETHER = 8, 30, 240
"""How many sightings of a sequence, and of all that are recorded, stand for the rest."""
LEAST_SEEN = 0.6
"""Share of a recording's frames that must lie in the picture."""


@dataclass(frozen=True)
class Expected:
    """Log likelihood (nats) by which the wrong effect loses: expected ``difference``, and ``probability`` that it exceeds the margin."""

    difference: float
    probability: float

    @property
    def separates(self) -> bool:
        """Whether the data would distinguish the pair."""
        return self.probability >= SURE


@dataclass(frozen=True)
class Prospect:
    """What further data would do.

    ``drops``: how many recordings (0 for a measurement); ``frames`` of each in which the particle is seen.
    """

    key: str
    words: str
    drops: int
    frames: int
    expected: Expected


@dataclass(frozen=True)
class Separation:
    """A pair of effects: how well it is told apart now, and what would change that, the most telling first."""

    pair: Pair
    margin: float
    now: Expected
    prospects: tuple[Prospect, ...]


def separations(
    registered: Registered, fit: CampaignFit, tests: Sequence[ScoreTest], groups: Sequence[Sequence[str]], *, margin: float = MARGIN
) -> list[tuple[Separation, ...]]:
    """How to tell the first effect of each of the ``groups`` from the others of its own.

    ``tests`` are of ``fit``, those of the whole catalogue. Effects drawn anew in every frame have no signature to compare; pairs with them
    are left out.
    """
    plain = [t for t in tests if not t.random and t.columns]
    known = {t.effect.entry.key for t in plain}
    of_groups = [[(group[0], rival) for rival in [r for r in group[1:] if {group[0], r} <= known][:MOST_RIVALS]] for group in groups]
    pairs = list(dict.fromkeys(pair for of_group in of_groups for pair in of_group))
    if not pairs:
        return [() for _ in groups]
    present = _present(registered, fit, plain, margin)
    found: dict[Pair, list[Prospect]] = {pair: [] for pair in pairs}
    recordings = [r for r in RECORDINGS if present.like.camera is not None or not r.pictures]
    prospects = [*each_of(lambda r: _of_recording(present, r, pairs), recordings), _of_views(present, registered.particles, pairs)]
    for pair, prospect in (item for each in prospects for item in each.items()):
        found[pair].append(prospect)
    for pair in pairs:
        found[pair] += [p for m in MEASUREMENTS if (p := _of_measurement(present, m, pair)) is not None]
    ordered = {pair: tuple(sorted(each, key=lambda p: (max(p.drops, 1), -p.expected.difference))) for pair, each in found.items()}
    told = {pair: Separation(pair, margin, present.expected(present.scores, pair), ordered[pair]) for pair in pairs}
    return [tuple(told[pair] for pair in of_group) for of_group in of_groups]


@dataclass(frozen=True)
class _Present:
    """The campaign as it is, linearised in all candidates, and what new recordings are made like.

    The sightings of ``campaign`` are few, and in each sequence stand for so many each.
    """

    campaign: Campaign
    stands_for: tuple[float, ...]
    fit: CampaignFit
    tests: tuple[ScoreTest, ...]
    candidates: Candidates
    equations: tuple[SequenceEquations, ...]
    scores: EfficientScores
    template: int
    like: Imagination
    margin: float

    def number(self, key: str) -> int:
        """The candidate with a key."""
        return next(i for i, e in enumerate(self.candidates.effects) if e.entry.key == key)

    def expected(self, scores: EfficientScores, pair: Pair, known: Array | float = 0.0) -> Expected:
        """What to expect of a pair, whichever of the two is true: the worse case; ``known``: information (c,) from elsewhere."""
        G = scores.information + np.diag(np.broadcast_to(known, len(scores.columns)))
        lost = min(self.lost(G, scores.columns, (self.number(a), self.number(b))) for a, b in (pair, pair[::-1]))
        return Expected(lost, float(ndtr((lost - self.margin) / np.sqrt(2.0 * max(lost, 1e-12)))))

    def lost(self, G: Array, columns: Sequence[Column], which: tuple[int, int]) -> float:
        """Log likelihood (nats) that is lost where the second effect stands for the first at the size that its test has."""
        first, second = (np.array([i for i, c in enumerate(columns) if c.effect == e], dtype=np.int64) for e in which)
        test = self.tests[which[0]]
        sizes = {(c.parameter, c.sequence): float(v) for c, v in zip(test.columns, test.theta, strict=True)}
        theta = np.array([sizes.get((columns[i].parameter, columns[i].sequence), 0.0) for i in first])
        cross = G[np.ix_(second, first)]
        left = G[np.ix_(first, first)] - cross.T @ stable_inverse(G[np.ix_(second, second)], 1e-10) @ cross
        return max(float(0.5 * theta @ left @ theta), 0.0)


def _present(registered: Registered, fit: CampaignFit, tests: Sequence[ScoreTest], margin: float) -> _Present:
    whole = registered.campaign
    template = int(np.argmax([whole.kind.sightings(s) for s in whole.sequences]))
    like: Imagination = whole.kind.imagination(whole, template, fit, registered.particles)
    few = [like.thinned(sequence, _most_sightings(whole)) for sequence in whole.sequences]
    campaign = replace(whole, sequences=tuple(sequence for sequence, _ in few))
    starts = tuple(np.unique(np.stack(list(t.starts.values())), axis=0) for t in tests)
    candidates = Candidates(tuple(t.effect for t in tests), starts)
    stands_for = tuple(count for _, count in few)
    equations = _counted_equations(campaign, fit, candidates, stands_for)
    scores = _scores(campaign, fit, equations, candidates)
    return _Present(campaign, stands_for, fit, tuple(tests), candidates, equations, scores, template, like, margin)


def _scores(campaign: Campaign, fit: CampaignFit, equations: tuple[SequenceEquations, ...], candidates: Candidates) -> EfficientScores:
    return efficient_scores(campaign, fit, arranged(campaign, equations, fit.model, candidates))[0]


def _counted_equations(
    campaign: Campaign, fit: CampaignFit, candidates: Candidates, stands_for: Sequence[float]
) -> tuple[SequenceEquations, ...]:
    return tuple(counted(e, n) for e, n in zip(candidate_equations(campaign, fit, candidates), stands_for, strict=True))


def _of_recording(present: _Present, candidate: CandidateRecording, pairs: Sequence[Pair]) -> dict[Pair, Prospect]:
    """What one such drop would do for each pair, and where that is not enough, what as many as the campaign has would."""
    made = present.like.imagined(candidate.change(present.like.recorded))
    if made.frames < LEAST_SEEN * len(made.drop.times_s):
        return {}
    sequence, equations = _imagined_equations(present, made.drop, made.sequence)
    found: dict[Pair, Prospect] = {}
    for drops in (1, max(2, len(present.equations))):
        wanted = [pair for pair in pairs if pair not in found or not found[pair].expected.separates]
        if wanted:
            scores = _with_drops(present, (sequence, made.drop.flight, equations), drops)
            for pair in wanted:
                found[pair] = Prospect(candidate.key, candidate.words, drops, made.frames, present.expected(scores, pair))
    return found


def _imagined_equations(present: _Present, drop: Drop, sequence: Any) -> tuple[Any, SequenceEquations]:
    """The imagined sequence, thinned, and linearised in the parameters of the fit and of all candidates."""
    model, tried = joint_model(present.fit.model, present.candidates)
    theta = np.concatenate([present.like.theta, tried])
    few, times = present.like.thinned(sequence, _most_sightings(present.campaign))
    alone = replace(present.campaign, sequences=(few,), particle=(0,), camera=(0,))
    equations = present.like.silent(counted(sequence_equations(alone, 0, CampaignState((drop.flight,), (theta,)), model), times))
    if not drop.known_start or not drop.flight.v.any():
        return few, equations
    known = np.zeros(len(equations.frames.H))
    known[V] = (KNOWN_START * float(np.linalg.norm(drop.flight.v))) ** -2.0
    frames = equations.frames
    return few, replace(equations, frames=replace(frames, H=frames.H + np.diag(known), known=frames.known + np.diag(known)))


def _most_sightings(campaign: Campaign) -> int:
    return max(LEAST_SIGHTINGS, min(MOST_SIGHTINGS, MOST_TOGETHER // len(campaign.sequences)))


def _with_drops(present: _Present, new: tuple[Any, Flight, SequenceEquations], drops: int) -> EfficientScores:
    """Scores of the campaign with ``drops`` new sequences that are alike."""
    sequence, flight, equations = new
    campaign, fit, t = present.campaign, present.fit, present.template
    more = replace(
        campaign,
        sequences=(*campaign.sequences, *[sequence] * drops),
        particle=(*campaign.particle, *[campaign.particle[t]] * drops),
        camera=(*campaign.camera, *[campaign.camera[t]] * drops),
        recording=(*campaign.recording, *(f"new {k + 1}" for k in range(drops))) if campaign.recording else (),
    )
    state = CampaignState((*fit.state.flights, *[flight] * drops), (*fit.state.theta, *[fit.state.theta[t]] * drops))
    extended = replace(fit, state=state, layout=layout_of(more, fit.model))
    return _scores(more, extended, (*present.equations, *[equations] * drops), present.candidates)


def _of_views(present: _Present, particles: Sequence[Particle], pairs: Sequence[Pair]) -> dict[Pair, Prospect]:
    """What twice the calibrated views would do for pairs with an effect on the body or on the views."""
    of_body = {e.entry.key for e in present.candidates.effects if e.entry.stage is Stage.BODY} | {ViewOutlineOffset.entry.key}
    asked = [pair for pair in pairs if of_body & set(pair)]
    if not asked or not particles:
        return {}
    both = zip(present.campaign.sequences, present.campaign.particle, strict=True)
    campaign = replace(present.campaign, sequences=tuple(present.like.more_views(sequence, particles[p]) for sequence, p in both))
    equations = _counted_equations(campaign, present.fit, present.candidates, present.stands_for)
    scores = _scores(campaign, present.fit, equations, present.candidates)
    return {pair: Prospect("views", MORE_VIEWS, 0, 0, present.expected(scores, pair)) for pair in asked}


def _of_measurement(present: _Present, measurement: CandidateMeasurement, pair: Pair) -> Prospect | None:
    """What a measurement would do for a pair; ``None`` where it measures neither."""
    numbers = [present.number(key) for key in pair]
    precision = np.zeros(len(present.scores.columns))
    for row, column in enumerate(present.scores.columns):
        if column.effect in numbers and not present.candidates.effects[column.effect].entry.scope.own:
            precision[row] = _precision(present, measurement, column)
    if not precision.any():
        return None
    return Prospect(measurement.key, measurement.words, 0, 0, present.expected(present.scores, pair, precision))


def _precision(present: _Present, measurement: CandidateMeasurement, column: Column) -> float:
    """Information that a measurement has of a column's parameter."""
    effect, parameter = present.candidates.effects[column.effect], column.parameter
    entry = effect.entry
    sigma = measurement.sigma.get(f"{whose(entry.key)[0]}.{entry.parameters[parameter].name}")
    if sigma is not None:
        return sigma**-2.0
    camera = present.like.camera
    if camera is None or measurement.corner_px is None or entry.scope.value != "camera" or entry.stage.value != "optics":
        return 0.0
    corners, step = corners_of(camera), entry.parameters[parameter].step
    up, down = (np.where(np.arange(len(entry.parameters)) == parameter, s * step, 0.0) for s in (1.0, -1.0))
    times = np.zeros(len(corners))
    moved = effect.correct(up, corners, camera, times) - effect.correct(down, corners, camera, times)
    return float(np.mean(np.sum((moved / (2.0 * step)) ** 2, axis=1)) / measurement.corner_px**2)
