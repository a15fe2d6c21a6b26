"""What impacts could have shown, against ladders climbed on impacts that have it."""

import numpy as np
import pytest

from estimator.contact_validation import detection
from estimator.contact_validation.detection import Detectable, detectable
from estimator.contact_validation.fitting import fit
from estimator.contact_validation.held_out import gain, judge
from estimator.contact_validation.laws.models import ADDITIONS, RIGID, impulse_model
from estimator.contact_validation.laws.point_contact import PointContact, point_contact
from estimator.contact_validation.spread import prepared
from tests.estimator.contact_validation.made_impacts import made_impacts

pytestmark = pytest.mark.long

PLAIN = {"restitution": 0.6, "friction": 0.15}
RUNS, SETS = 8, 4


@pytest.fixture(scope="module")
def limits() -> dict[str, Detectable]:
    """Limits of the rigid impulse with friction."""
    impacts = prepared(made_impacts(point_contact(PLAIN), RUNS, 20), 0)
    found = detectable(impacts, judge(impacts, fit(impacts, RIGID)), (), np.random.default_rng(0))
    return {each.parameter: each for each in found}


def accepted(physics: str, law: PointContact) -> int:
    """Sets out of :data:`SETS` in which ``physics`` is accepted when nature follows ``law``."""
    count = 0
    for seed in range(SETS):
        impacts = prepared(made_impacts(law, RUNS, 100 + seed), 0)
        before, after = (judge(impacts, fit(impacts, model)) for model in (RIGID, impulse_model([physics])))
        count += gain(impacts, before, after, np.random.default_rng(0)).beyond_chance
    return count


def test_all_that_may_be_added_has_a_limit(limits: dict[str, Detectable]) -> None:
    assert set(limits) == {"compliance", "slowing", "adhesion", "tilt", "tilt_across", "recoil"}
    for each in limits.values():
        assert each.half is not None
        assert each.nearly_all is None or each.half < each.nearly_all


def test_what_is_well_above_its_limit_is_found_and_what_is_well_below_is_not(limits: dict[str, Detectable]) -> None:
    limit = limits["adhesion"]
    assert limit.half is not None
    assert limit.nearly_all is not None
    assert accepted("adhesion", point_contact({**PLAIN, "adhesion": 2.0 * limit.nearly_all})) >= SETS - 1
    assert accepted("adhesion", point_contact({**PLAIN, "adhesion": 0.3 * limit.half})) <= 1


def test_more_runs_show_smaller_sizes(limits: dict[str, Detectable], monkeypatch: pytest.MonkeyPatch) -> None:
    looked_at = tuple(p for p in ADDITIONS if p.key in ("velocity_dependent_restitution", "adhesion"))
    monkeypatch.setattr(detection, "ADDITIONS", looked_at)
    impacts = prepared(made_impacts(point_contact(PLAIN), 2 * RUNS, 20), 0)
    more = {each.parameter: each for each in detectable(impacts, judge(impacts, fit(impacts, RIGID)), (), np.random.default_rng(0))}
    for name in ("slowing", "adhesion"):
        few, many = limits[name].half, more[name].half
        assert few is not None
        assert many is not None
        assert many < 0.9 * few
