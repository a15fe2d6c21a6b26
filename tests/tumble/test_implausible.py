"""What was stated wrongly is not explained away by values that no such thing has; a contact is not called a force without a word."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from datasets.json_documents import read_document
from datasets.trajectory import Trajectory
from estimator.effects.model import Model
from estimator.effects.registry import MODELS
from estimator.measurements.trajectories.free_flights import share_of_gravity
from tests.estimator.made_trajectories import GRAVITY, Hidden, Tracker, campaign
from tests.estimator.measurements.trajectories.struck_tosses import RATE_HZ, toss
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.cli.main import main
from tumble.implausible import believed, gravity_words
from tumble.reports.verdict import Verdict


@pytest.mark.parametrize("factor", [1.0, -1.0, 100.0])
def test_the_share_of_gravity_is_that_of_the_path(factor: float) -> None:
    (each,) = campaign(8, Hidden(), Tracker(rows=30), sequences=1)
    x = factor * each.x_world
    x[::5] = np.nan
    share = share_of_gravity(each.times_s, x, GRAVITY)
    assert share == pytest.approx(factor, rel=0.02)
    assert share_of_gravity(each.times_s, x, np.zeros(3)) is None
    assert share_of_gravity(each.times_s[:6], x[:6], GRAVITY) is None


def test_a_model_of_values_that_nothing_has_is_not_told() -> None:
    found = Verdict("found", "The campaign is explained with uniform acceleration.", ("a remark",), ("uniform_acceleration",))
    made = {each.name: each for each in campaign(8, Hidden(), Tracker(rows=20), sequences=3)}
    assert believed(found, (), made) is found
    told = believed(found, ("uniform acceleration",), made)
    assert told.sentence.startswith("No model of plausible values explains the campaign: in the most probable one uniform acceleration")
    assert told.remarks[0].startswith("Positions fall with 0.98")
    assert (told.kind, told.add) == ("judged", ())


def _cut(after: int, *, oriented: bool) -> dict[str, Trajectory]:
    """Tosses that end so many rows after their contact."""
    rng = np.random.default_rng(5)
    made = {}
    for number in range(6):
        known = toss(rng, height=0.16)
        rows = slice(0, int(known.hits[0].time_s * RATE_HZ) + 1 + after)
        t = known.trajectory
        q = t.q_world_tracked[rows] if oriented and t.q_world_tracked is not None else None
        made[f"toss_{number}"] = replace(t, name=f"toss_{number}", times_s=t.times_s[rows], x_world=t.x_world[rows], q_world_tracked=q)
    return made


@pytest.mark.parametrize("oriented", [True, False])
def test_trajectories_are_cut_before_a_contact(tmp_path: Path, *, oriented: bool) -> None:
    tosses = tmp_path / "tosses"
    for folder, after in ((tosses, 3), (tmp_path / "before", 0)):
        folder.mkdir()
        for each in _cut(after, oriented=oriented).values():
            write_csv(each, folder)
    assert main(["diagnose", str(tosses), "--gravity=0,0,-9.81", "--out", str(tmp_path / "out"), "-q"]) == 0
    found = read_document(tmp_path / "out" / "diagnosis.json", "diagnosis")
    assert main(["diagnose", str(tmp_path / "before"), "--gravity=0,0,-9.81", "--out", str(tmp_path / "alone"), "-q"]) == 0
    alone = read_document(tmp_path / "alone" / "diagnosis.json", "diagnosis")
    assert found["verdict"]["remarks"][0].startswith("6 of 6 sequences touch something: their velocity jumps as no force makes it.")
    assert not [remark for remark in alone["verdict"]["remarks"] if "touch something" in remark]
    assert found["rms_ete_px"] < 1.1 * alone["rms_ete_px"]


@pytest.mark.parametrize(("tilt_deg", "more", "said"), [(2.0, 0.0, True), (0.0, 0.2, False), (0.05, 0.0, False)])
def test_a_gravity_that_is_tilted_is_told_by_its_direction(tilt_deg: float, more: float, said: bool) -> None:
    made, tilt = campaign(3, Hidden(), Tracker(rows=20), sequences=1), np.deg2rad(tilt_deg)
    dg = 9.81 * np.array([np.sin(tilt), 0.0, 1.0 - np.cos(tilt)]) + np.array([0.0, 0.0, more])
    model = Model((MODELS["linear_drag"], MODELS["gravity"]))
    fit = SimpleNamespace(model=model, state=SimpleNamespace(theta=(np.concatenate([[0.3], dg]),)))
    of = SimpleNamespace(fit=fit, of_values=SimpleNamespace(of=lambda number, columns: 0.01**2 * np.eye(len(columns))))
    told = gravity_words({"toss": made[0]}, of)  # type: ignore[arg-type]
    assert bool(told) == said
    if said:
        assert told[0].startswith("The fitted gravity points 2.000 ± 0.058 degrees off the stated direction")
