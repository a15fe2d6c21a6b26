"""Effects are instances that nothing changes: another prior, another range, a law or a watched plug-in is an instance of a known class."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from datasets.vocabulary.camera import Intrinsics
from estimator.effects.catalogue.dynamics.gravity import Gravity
from estimator.effects.catalogue.optics.principal_point import PrincipalPoint
from estimator.effects.empirical.law_effect import LawEffect, law_effect
from estimator.effects.empirical.law_terms import TERMS
from estimator.effects.link import Array, EffectModel, Moment, Setting
from estimator.effects.model import holds_of, overrides
from estimator.effects.plug_ins import load_plug_in
from estimator.effects.registry import MODELS
from estimator.measurements.trajectories.applying import PLAUSIBLE, with_plausible_values
from tests.estimator.effects.empirical.test_force_curves import moment
from tests.estimator.effects.test_plug_ins import HEAD

BY_KEY = {term.key: term for term in TERMS}
PULLED = '''
class Wind(EffectModel):
    """As strong as its prior is wide, which a copy has another of."""
    entry = entry()
    def acceleration(self, theta, moment, setting):
        return np.full((len(theta), 3), 0.0 if self.held is None else self.held[0])
'''


def test_a_wider_range_is_another_instance_of_the_same_class() -> None:
    (key, limits), *_ = PLAUSIBLE.items()
    before = MODELS[key].entry
    wider = with_plausible_values(MODELS[key].held_by((1.0,) * len(before.parameters)))
    assert type(wider) is type(MODELS[key])
    assert {parameter.plausible for parameter in wider.entry.parameters} == {limits}
    assert wider.held is not None
    assert MODELS[key].entry is before


def test_a_law_acts_where_its_terms_do_and_can_be_sent() -> None:
    drag = law_effect("law", (BY_KEY["against_velocity"],), (np.array([2.0]),))
    assert isinstance(drag, LawEffect)
    assert overrides(drag, "acceleration")
    assert not overrides(drag, "torque", "times")
    sent = pickle.loads(pickle.dumps(drag))
    assert sent.entry == drag.entry
    np.testing.assert_array_equal(sent.start, drag.start)


def test_what_a_class_says_of_its_force_does_not_hold_for_another_s() -> None:
    class Pulse(Gravity):
        def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array:
            return np.asarray(theta * np.sin(moment.time_s))

    class Zoom(PrincipalPoint):
        def correct(self, theta: Array, points_px: Array, camera: Intrinsics, times_s: Array) -> Array:
            return np.asarray((1.0 + theta[0]) * points_px)

    for effect, holds in ((Gravity(), True), (Pulse(), False)):
        assert holds_of(effect, "constant", "acceleration", "torque") == holds
    for moved, holds in ((PrincipalPoint(), True), (Zoom(), False)):
        assert holds_of(moved, "picture_moves", "correct") == holds


@pytest.mark.parametrize("effect", MODELS.values(), ids=lambda each: each.entry.key)
def test_pictures_that_are_moved_as_a_whole_are_corrected_by_that(effect: EffectModel) -> None:
    rng, theta = np.random.default_rng(0), np.array([parameter.plausible[1] / 3.0 for parameter in effect.entry.parameters])
    times, points = np.repeat([0.0, 1e-3, 7e-3], 5), rng.normal(size=(15, 2)) * 100.0 + 300.0
    moves = effect.picture_moves(theta, times)
    if moves is not None:
        camera = Intrinsics(width_px=640, height_px=480, fx_px=6000.0, fy_px=6000.0, cx_px=319.5, cy_px=239.5)
        np.testing.assert_allclose(effect.correct(theta, points, camera, times), points - moves, atol=1e-9)


def test_the_links_of_a_copied_plug_in_are_those_of_the_copy(tmp_path: Path) -> None:
    path = tmp_path / "my_wind.py"
    path.write_text(HEAD + PULLED, encoding="utf-8")
    effect = load_plug_in(f"{path}:Wind")
    copied = effect.held_by((3.0,))
    at, setting = moment(1), Setting(np.linspace(0.0, 1.0, 3), 0.0, np.zeros(3), np.ones(3))
    assert type(copied) is type(effect)
    np.testing.assert_array_equal(copied.acceleration(np.zeros((1, 1)), at, setting), np.full((1, 3), 3.0))
    np.testing.assert_array_equal(effect.acceleration(np.zeros((1, 1)), at, setting), np.zeros((1, 3)))
