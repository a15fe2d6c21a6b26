"""Effects of trackers and gyroscopes keep the contracts where they act, and those that do not are found out, as fits call them."""

from pathlib import Path

import numpy as np
import pytest

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.appearance.effect_contracts import Kept
from estimator.effects.choosing import catalogue
from estimator.effects.empirical.families import VolumeWarp
from estimator.effects.link import Array, EffectModel, Setting
from estimator.effects.model import overrides
from estimator.effects.plug_ins import load_plug_in
from estimator.measurements.report_contracts import OF_ROWS, check_reports
from tests.estimator.small_campaign import registered

REPORTING = sorted(key for key, effect in catalogue().items() if overrides(effect, *OF_ROWS))
PLUG_IN = '''
from dataclasses import replace
from estimator.effects.empirical.families import VolumeWarp

class Shifted(VolumeWarp):
    """A warp of its own: arguments named as its author likes."""
    entry = replace(VolumeWarp.entry, key="shifted")
    def tracked(self, values, points, around):
        return points + values[:3] * {what}
'''


def checked(effect: EffectModel) -> tuple[Kept, ...]:
    found = registered()
    return check_reports(effect, found.campaign.sequences[0].setting, found.start.flights[0])


@pytest.mark.parametrize("key", REPORTING)
def test_an_effect_of_the_catalogue_keeps_the_contracts(key: str) -> None:
    kept = checked(catalogue()[key])
    assert len(kept) == 4
    assert [each for each in kept if not each.kept] == []


def test_an_effect_without_a_report_has_nothing_to_keep() -> None:
    assert checked(catalogue()["gravity"]) == ()


def test_a_plug_in_is_called_as_fits_call_it(tmp_path: Path) -> None:
    """Fits give the setting by its name, which a plug-in need not have; derivatives are those of what it overrides."""
    path = tmp_path / "shifted.py"
    path.write_text(PLUG_IN.format(what="around.reach_m"), encoding="utf-8")
    assert [each for each in checked(load_plug_in(f"{path}:Shifted")) if not each.kept] == []
    path.write_text(PLUG_IN.format(what="around.reach"), encoding="utf-8")
    broken = [each for each in checked(load_plug_in(f"{path}:Shifted")) if not each.kept]
    assert len(broken) == 4
    assert all("raised AttributeError" in each.found and "in tracked()" in each.found for each in broken)


class AlwaysThere(VolumeWarp):
    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        return super().tracked(theta, x, setting) + 1e-3


class WrongDerivatives(VolumeWarp):
    def tracked_by(self, theta: Array, x: Array, setting: Setting) -> Array:
        return 1.1 * super().tracked_by(theta, x, setting)

    def tracked(self, theta: Array, x: Array, setting: Setting) -> Array:
        return np.asarray(x + super().tracked_by(theta, x, setting) @ theta)


class NeverThere(EffectModel):
    entry = EffectEntry("never", Stage.TRACKING, Scope.CAMPAIGN, (Parameter("size", "1", (-5.0, 5.0), 1e-3, "size"),), "nothing", "none")

    def reading(self, theta: Array, omega: Array) -> Array:
        return omega.copy()


class Forgetful(NeverThere):
    asked = 0

    def reading(self, theta: Array, omega: Array) -> Array:
        self.asked += 1
        return omega + theta * self.asked


@pytest.mark.parametrize(
    ("effect", "contract"),
    [
        (AlwaysThere(), "zero is no effect"),
        (WrongDerivatives(), "derivatives"),
        (NeverThere(), "it acts"),
        (Forgetful(), "the same twice"),
    ],
)
def test_a_broken_report_is_found_out(effect: EffectModel, contract: str) -> None:
    assert f"{contract}, of rows" in [each.name for each in checked(effect) if not each.kept]
