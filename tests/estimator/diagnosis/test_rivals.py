"""Where held-out frames refuse an effect, those that cannot be told from it get their chance."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from estimator.diagnosis.refits import Refitted, Rules, key_of

from estimator.diagnosis import explain
from estimator.diagnosis.score_tests import ScoreTest
from estimator.effects.registry import MODELS

NOTHING: Any = None
BASE: Any = SimpleNamespace(rms_px=0.136)


def refitted(key: str, rms_px: float, rivals: tuple[Refitted, ...] = ()) -> Refitted:
    """A refit whose held-out error is given."""
    test = ScoreTest(MODELS[key], (), np.zeros(1), np.zeros((1, 1)), 9.0, 1e-4, 9.0, {None: np.zeros(2)})
    fit: Any = SimpleNamespace(state=rms_px, model=None)
    return Refitted(test, fit, 2, group=(key, *map(key_of, rivals)), rivals=rivals)


@pytest.mark.parametrize(
    ("errors_px", "taken"), [((0.137, 0.135), "principal_point"), ((0.134, 0.133), "radial_distortion"), ((0.137, 0.138), None)]
)
def test_a_rival_that_held_out_frames_like_takes_the_place(
    errors_px: tuple[float, float], taken: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    leader = refitted("radial_distortion", errors_px[0], (refitted("principal_point", errors_px[1]),))
    monkeypatch.setattr(explain, "random_contender", lambda *_: ())
    monkeypatch.setattr(explain, "contenders", lambda *_: (leader,))
    monkeypatch.setattr(explain, "held_out", lambda _campaign, state, _model: SimpleNamespace(rms_px=state))
    (step,) = explain._steps(NOTHING, NOTHING, ((), NOTHING, NOTHING), Rules(), BASE)
    assert step.accepted is (taken is not None)
    assert step.added == (taken or "radial_distortion")
    assert set(step.group) == {"radial_distortion", "principal_point"}
    assert step.group[0] == step.added
