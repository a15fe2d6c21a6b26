"""Whether something is left that no effect of the catalogue explains, and at which stage it sits.

Empirical families (:mod:`estimator.effects.empirical`) compete with the effects of the catalogue for a place in the model; the one that is
in the most probable set names the stage. Where none is, the family that would be the most probable one is told, as not present.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from datasets.vocabulary.effects import Stage
from estimator.diagnosis.diagnose import Diagnosis
from estimator.diagnosis.score_tests import ScoreTest
from estimator.diagnosis.selection.search import Set, Trial


@dataclass(frozen=True)
class Unknown:
    """The most probable family: its test, corrected p-value, all families' tests, and whether it is ``present`` in the best set."""

    test: ScoreTest
    p: float
    tests: tuple[ScoreTest, ...]
    present: bool

    @property
    def stage(self) -> Stage:
        """Where it sits."""
        return self.test.effect.entry.stage


def family_of(found: Diagnosis) -> Unknown | None:
    """The most probable family of a diagnosis, present where the best set has it; ``None`` where none applies."""
    if not found.families:
        return None
    best = max(found.families, key=lambda f: (f.key in found.missing, f.log_odds))
    tests = tuple(f.test for f in found.families)
    return Unknown(best.test, min(1.0, best.test.p * len(tests)), tests, best.key in found.missing)


def unknown_of(trial: Trial, tests: Sequence[ScoreTest], members: Set, *, present: bool) -> Unknown | None:
    """The family that is the most probable one beside the set ``members`` of a fit; ``tests`` of all effects that the fit lacks."""
    keys = trial.evidence.of.keys
    wide = {keys[e]: e for e in trial.families}
    own = tuple(t for t in tests if t.effect.entry.key in wide)
    if not own:
        return None
    best = max(own, key=lambda t: trial.log_posterior(tuple(sorted((*members, wide[t.effect.entry.key])))))
    return Unknown(best, min(1.0, best.p * len(own)), own, present)
