"""Every effect of the registry keeps the contracts; effects that do not are found out."""

from dataclasses import replace

import numpy as np
import pytest

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.appearance.effect_contracts import check_contracts
from estimator.appearance.model_errors import SequenceTask
from estimator.data.fit_task import FitTask
from estimator.effects.choosing import catalogue
from estimator.effects.link import Array, EffectModel, Moment, Places, Setting
from tests.estimator.small_campaign import registered


def short() -> SequenceTask:
    """Every third frame of a sequence, its stamps a little uneven."""
    sequence = registered().campaign.sequences[0]
    rows = np.arange(0, len(sequence.task.sightings), 3)
    task = sequence.task
    few = FitTask(task.sightings.take(rows), task.views, task.prior, task.huber, task.weight[rows])
    setting = replace(sequence.setting, scatter_s=1e-4 * np.sin(np.arange(len(sequence.setting.times_s))))
    return replace(sequence, task=few, setting=setting, shape=sequence.shape.take(rows))


@pytest.mark.parametrize("key", sorted(catalogue()))
def test_an_effect_of_the_catalogue_keeps_the_contracts(key: str) -> None:
    broken = [each for each in check_contracts(catalogue()[key], short(), registered().start.flights[0]) if not each.kept]
    assert broken == []


def entry(key: str, stage: Stage = Stage.DYNAMICS) -> EffectEntry:
    return EffectEntry(key, stage, Scope.CAMPAIGN, (Parameter("size", "1", (-5.0, 5.0), 1e-3, "size"),), "broken on purpose", "none")


class AlwaysThere(EffectModel):
    entry = entry("always_there")

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        return np.broadcast_to(theta + 1.0, moment.x.shape)


class NeverThere(EffectModel):
    entry = entry("never_there")

    def acceleration(self, theta: Array, moment: Moment, setting: Setting) -> Array | None:
        return np.zeros(moment.x.shape)


class Forgetful(EffectModel):
    """Its answer depends on how often it was asked."""

    entry = entry("forgetful", Stage.SEGMENTATION)
    asked = 0

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        self.asked += 1
        return np.full(places.radius_px.shape, theta[0] * self.asked)


class Kinked(EffectModel):
    """Its derivative jumps within one step everywhere."""

    entry = entry("kinked", Stage.SEGMENTATION)

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        return np.full(places.radius_px.shape, 1e-3 * np.sin(theta[0] * 1e5) + 0 * places.radius_px)

    def slope_at(self, theta: Array) -> Array:
        return theta + 1e-5


@pytest.mark.parametrize(
    ("effect", "contract"),
    [
        (AlwaysThere(), "zero is no effect"),
        (NeverThere(), "it acts"),
        (Forgetful(), "the same twice"),
        (Kinked(), "derivatives"),
    ],
)
def test_a_broken_effect_is_found_out(effect: EffectModel, contract: str) -> None:
    broken = [each.name for each in check_contracts(effect, short(), registered().start.flights[0]) if not each.kept]
    assert contract in broken
