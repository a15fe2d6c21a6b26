"""What further data would tell apart effects that these data cannot.

The difference of the criterion that is to be expected (:mod:`estimator.diagnosis.expected_difference`) needs no data, only where tangencies
would lie: so it is computed for the campaign as it is and for the campaign with an imagined recording more. A pair counts as told
apart where the difference exceeds the margin of groups in 95% of cases, whichever of the two is true; each is taken at the size that
the campaign gives it.

Holds as far as effects are small enough for their signatures to be linear. An effect that every sequence has a size of its own of is taken
to be absent from a new recording.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import Scope, Stage
from estimator.diagnosis.candidate_recordings import (
    MEASUREMENTS,
    RECORDINGS,
    CandidateMeasurement,
    CandidateRecording,
    corners_of,
)
from estimator.diagnosis.expected_difference import Expected, expected
from estimator.diagnosis.imagined_sequences import Drop, Imagination, Pictures, counted, hull_of
from estimator.diagnosis.imagined_trajectories import Tracks
from estimator.diagnosis.imagined_views import with_more_views
from estimator.diagnosis.score_tests import (
    Candidates,
    EfficientScores,
    ScoreTest,
    arranged,
    candidate_equations,
    efficient_scores,
    joint_model,
)
from estimator.diagnosis.selection.groups import FACTOR
from estimator.effects.link import EffectModel
from estimator.effects.view_outline_offset import ViewOutlineOffset
from estimator.fitting.campaign import Campaign, CampaignFit, CampaignState, SequenceEquations, layout_of, sequence_equations
from estimator.fitting.model_errors import SequenceTask
from estimator.motion.flight import Flight, V
from estimator.particle import Particle
from estimator.registration import Registered
from estimator.side_by_side import each_of

Array = NDArray[np.float64]
Pair = tuple[str, str]
MARGIN = 2.0 * float(np.log(FACTOR))
"""Difference of the criterion, twice that of log likelihoods, beyond which two effects count as told apart."""
FEWEST = np.exp(np.e)
"""Measurements, of which the penalty is Akaike's 2."""
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
    registered: Registered, fit: CampaignFit, tests: Sequence[ScoreTest], group: Sequence[str], *, margin: float = MARGIN
) -> tuple[Separation, ...]:
    """How to tell the first effect of ``group`` from each of the others; ``tests`` are of ``fit``, those of the whole catalogue.

    Effects drawn anew in every frame have no signature to compare; pairs with them are left out.
    """
    plain = [t for t in tests if not t.random and t.columns]
    rivals = [key for key in group[1 : 1 + MOST_RIVALS] if key in {t.effect.entry.key for t in plain}]
    if not rivals or group[0] not in {t.effect.entry.key for t in plain}:
        return ()
    present = _present(registered, fit, plain)
    pairs = [(group[0], rival) for rival in rivals]
    now = {pair: _expected(present.scores, present, pair, margin) for pair in pairs}
    found: dict[Pair, list[Prospect]] = {pair: [] for pair in pairs}
    recordings = [r for r in RECORDINGS if present.like.camera is not None or not r.pictures]
    for recorded in each_of(lambda r: _of_recording(present, r, pairs, margin), recordings):
        for pair, prospect in recorded.items():
            found[pair].append(prospect)
    for pair, prospect in _of_views(present, registered.particles, pairs, margin).items():
        found[pair].append(prospect)
    for pair in pairs:
        found[pair] += [p for m in MEASUREMENTS if (p := _of_measurement(present, m, pair, margin)) is not None]
    return tuple(Separation(pair, margin, now[pair], tuple(sorted(found[pair], key=_order))) for pair in pairs)


def _order(prospect: Prospect) -> tuple[int, float]:
    return max(prospect.drops, 1), -prospect.expected.difference


@dataclass(frozen=True)
class _Present:
    """The campaign as it is, linearised in all candidates, and what new recordings are made like.

    ``whole`` is the campaign with all sightings; those of ``campaign`` are few, and in each sequence stand for so many each.
    """

    whole: Campaign
    campaign: Campaign
    stands_for: tuple[float, ...]
    fit: CampaignFit
    tests: tuple[ScoreTest, ...]
    candidates: Candidates
    equations: tuple[SequenceEquations, ...]
    scores: EfficientScores
    template: int
    like: Imagination

    def number(self, key: str) -> int:
        """The candidate with a key."""
        return next(i for i, e in enumerate(self.candidates.effects) if e.entry.key == key)


def _present(registered: Registered, fit: CampaignFit, tests: Sequence[ScoreTest]) -> _Present:
    whole = registered.campaign
    template = int(np.argmax([whole.kind.sightings(s) for s in whole.sequences]))
    like = _imagination(registered, fit, template)
    few = [like.thinned(sequence, _most_sightings(whole)) for sequence in whole.sequences]
    campaign = replace(whole, sequences=tuple(sequence for sequence, _ in few))
    starts = tuple(np.unique(np.stack(list(t.starts.values())), axis=0) for t in tests)
    candidates = Candidates(tuple(t.effect for t in tests), starts)
    stands_for = tuple(count for _, count in few)
    equations = _counted_equations(campaign, fit, candidates, stands_for)
    scores, _ = efficient_scores(campaign, fit, arranged(campaign, equations, fit.model, candidates))
    return _Present(whole, campaign, stands_for, fit, tuple(tests), candidates, equations, scores, template, like)


def _counted_equations(
    campaign: Campaign, fit: CampaignFit, candidates: Candidates, stands_for: Sequence[float]
) -> tuple[SequenceEquations, ...]:
    return tuple(counted(e, n) for e, n in zip(candidate_equations(campaign, fit, candidates), stands_for, strict=True))


def _imagination(registered: Registered, fit: CampaignFit, number: int) -> Imagination:
    """New sequences are made like sequence ``number``."""
    sequence, flight, theta = registered.campaign.sequences[number], fit.state.flights[number], fit.state.theta[number]
    if not isinstance(sequence, SequenceTask):
        return Tracks(sequence, flight, fit.model, theta)
    corners = hull_of(registered.particles[registered.campaign.particle[number]])
    return Pictures(sequence, flight, corners, fit.model, theta)


def _of_recording(present: _Present, candidate: CandidateRecording, pairs: Sequence[Pair], margin: float) -> dict[Pair, Prospect]:
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
            whole = replace(present.whole, sequences=(*present.whole.sequences, *[made.sequence] * drops))
            for pair in wanted:
                found[pair] = Prospect(
                    candidate.key, candidate.words, drops, made.frames, _expected(scores, replace(present, whole=whole), pair, margin)
                )
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
    )
    state = CampaignState((*fit.state.flights, *[flight] * drops), (*fit.state.theta, *[fit.state.theta[t]] * drops))
    extended = replace(fit, state=state, layout=layout_of(more, fit.model))
    linear = arranged(more, (*present.equations, *[equations] * drops), fit.model, present.candidates)
    scores, _ = efficient_scores(more, extended, linear)
    return scores


def _of_views(present: _Present, particles: Sequence[Particle], pairs: Sequence[Pair], margin: float) -> dict[Pair, Prospect]:
    """What twice the calibrated views would do for pairs with an effect on the body or on the views."""
    asked = [pair for pair in pairs if any(_of_body(present.candidates.effects[present.number(key)]) for key in pair)]
    if not asked or not isinstance(present.like, Pictures):
        return {}
    campaign = present.campaign
    more = [
        with_more_views(sequence, particles[p], hull_of(particles[p]))
        for sequence, p in zip(campaign.sequences, campaign.particle, strict=True)
    ]
    campaign = replace(campaign, sequences=tuple(more))
    equations = _counted_equations(campaign, present.fit, present.candidates, present.stands_for)
    scores, _ = efficient_scores(campaign, present.fit, arranged(campaign, equations, present.fit.model, present.candidates))
    return {pair: Prospect("views", MORE_VIEWS, 0, 0, _expected(scores, present, pair, margin)) for pair in asked}


def _of_body(effect: EffectModel) -> bool:
    return effect.entry.stage is Stage.BODY or effect.entry.key == ViewOutlineOffset.entry.key


def _of_measurement(present: _Present, measurement: CandidateMeasurement, pair: Pair, margin: float) -> Prospect | None:
    """What a measurement would do for a pair; ``None`` where it measures neither."""
    numbers = [present.number(key) for key in pair]
    precision = np.zeros(len(present.scores.columns))
    for row, column in enumerate(present.scores.columns):
        if column.effect in numbers and present.candidates.effects[column.effect].entry.scope is not Scope.SEQUENCE:
            precision[row] = _precision(present, measurement, (column.effect, column.start, column.parameter))
    if not precision.any():
        return None
    H, M = present.scores.H + np.diag(precision), present.scores.M + np.diag(precision)
    return Prospect(measurement.key, measurement.words, 0, 0, _expected(replace(present.scores, H=H, M=M), present, pair, margin))


def _precision(present: _Present, measurement: CandidateMeasurement, which: tuple[int, int, int]) -> float:
    effect, parameter = present.candidates.effects[which[0]], which[2]
    entry = effect.entry
    sigma = measurement.sigma.get(f"{entry.key}.{entry.parameters[parameter].name}")
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


def penalty_of(campaign: Campaign) -> float:
    """Penalty per parameter: ``2 ln ln n`` of n independent measurements [Hannan and Quinn 1979], 2 at least."""
    return float(2.0 * np.log(np.log(max(campaign.kind.independent(campaign), FEWEST))))


def _expected(scores: EfficientScores, present: _Present, pair: Pair, margin: float) -> Expected:
    first, second = (present.number(key) for key in pair)
    tests = (present.tests[first], present.tests[second])
    return expected(scores, (first, second), tests, (penalty_of(present.whole), margin))
