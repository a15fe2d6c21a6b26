"""One look answers what three questions would: what the catalogue explains, what families do, and what both leave."""

from dataclasses import replace

import numpy as np
from estimator.diagnosis.looks import Looks
from estimator.diagnosis.pruning import tests_at as effects_tested_at

from estimator.diagnosis.score_tests import Tested
from estimator.diagnosis.unknown import outstanding, unknown
from estimator.effects.registry import MODELS
from tests.estimator.small_campaign import fitted, registered

ASKED = {key: MODELS[key] for key in ("gravity", "trigger_jitter", "linear_drag", "dropped_frames")}


def assert_same(one: Tested, other: Tested) -> None:
    for test, same in zip(one[0], other[0], strict=True):
        assert test.effect.entry.key == same.effect.entry.key
        assert test.columns == same.columns
        np.testing.assert_allclose(test.theta, same.theta, rtol=1e-9)
        np.testing.assert_allclose([test.p, test.statistic], [same.p, same.statistic], rtol=1e-8)
    assert one[1].columns == other[1].columns
    np.testing.assert_allclose(one[1].g, other[1].g, rtol=1e-9)
    np.testing.assert_allclose(one[1].M, other[1].M, rtol=1e-8, atol=1e-9 * np.abs(other[1].M).max())


def test_a_look_says_what_tests_of_its_parts_say() -> None:
    campaign, fit = registered().campaign, fitted()
    look = Looks(ASKED).at(campaign, fit)
    assert_same(look.catalogue, effects_tested_at(campaign, fit, ASKED))
    alone, together = unknown(campaign, fit), outstanding(look.families)
    assert [t.effect.entry.key for t in together.tests] == [t.effect.entry.key for t in alone.tests]
    np.testing.assert_allclose([t.p for t in together.tests], [t.p for t in alone.tests], rtol=1e-6)
    assert together.stage == alone.stage


def test_what_is_drawn_anew_in_every_frame_leaves_nothing_that_lasts() -> None:
    (tests, scores), known = Looks(ASKED).at(registered().campaign, fitted()).lasting
    assert [t.effect.entry.key for t in tests[:known]] == ["gravity", "linear_drag", "dropped_frames"]
    assert not any(t.random for t in tests)
    assert {column.effect for column in scores.columns} == set(range(len(tests)))


def test_a_look_is_taken_once_at_a_fit() -> None:
    campaign, fit, looks = registered().campaign, fitted(), Looks({"gravity": MODELS["gravity"]})
    first = looks.at(campaign, fit)
    assert looks.at(campaign, fit) is first
    assert looks.at(campaign, replace(fit)) is not first
    for _ in range(Looks.REMEMBERED):
        looks.at(campaign, replace(fit))
    assert looks.at(campaign, fit) is not first
