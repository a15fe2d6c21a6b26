"""What is refused of impacts on the command line: exit code 2 for what cannot be, a status and a sentence for what cannot be measured."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from datasets.estimate import Status
from datasets.estimate_files import read_estimate
from datasets.observation import Observation
from datasets.observation_files import write_observation
from datasets.recipes.recipe import EffectRecipe
from datasets.truth import Truth
from synth.sequence import build_silhouette_sequence
from tests.estimator.test_measure import RECIPE, part
from tumble.cli.main import main

DROPS = Path(__file__).resolve().parents[2] / "docs" / "tutorial_files" / "impacts.toml"
QUICK = ["--set", "momentum_starts=0", "--set", "trajectory_candidates=1", "--jobs", "1"]


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("contact.restitution=1.2", "contact.restitution: expected a value from 0.05 to 1, got 1.2; no contact gives back more"),
        ("contact.friction=-0.1", "contact.friction: expected a value from 0 to 2, got -0.1"),
        ("contact.poisson=0.7", "contact.poisson: expected a value from -0.99 to 0.5, got 0.7"),
        ("contact.youngs_gpa=0", "contact.youngs_gpa: expected a value from 0.001 to 2000, got 0"),
        ("plate.poisson=-2", "plate.poisson: expected a value from -0.99 to 0.5, got -2"),
        ("plate.youngs_gpa=210e9", "plate.youngs_gpa: expected a value from 0.001 to 2000, got 2.1e+11; gigapascals are meant"),
    ],
)
def test_materials_that_cannot_be_are_not_rendered(setting: str, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["render", "--config", str(DROPS), "--set", setting, "--out", str(tmp_path / "d")]) == 2
    assert said in capsys.readouterr().err
    assert not (tmp_path / "d").exists()


@pytest.fixture(scope="module")
def sequence() -> tuple[Observation, Truth]:
    return build_silhouette_sequence(RECIPE, 0)


@pytest.mark.parametrize("side", ["first", "last"])
def test_an_impact_at_the_edge_of_the_recording(
    side: str, sequence: tuple[Observation, Truth], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    observation, truth = sequence
    at, count = int(np.searchsorted(observation.clock.times_s, truth.impacts[0].time_s)), len(observation.clock.times_s)
    cut = part(observation, 0, at + 3) if side == "last" else part(observation, at - 3, count)
    write_observation(replace(cut, name="drop"), tmp_path / "drop")
    assert main(["estimate", str(tmp_path / "drop"), "--out", str(tmp_path / "e"), *QUICK]) == 1
    (path,) = (tmp_path / "e").glob("*.estimate.json")
    estimate = read_estimate(path)
    if side == "last":
        assert (estimate.status, estimate.motion) == (Status.IMPACT_AT_EDGE, None)
        assert "in the last three there is too little to measure on that side" in " ".join(capsys.readouterr().out.split())
    else:
        assert estimate.status in {Status.IMPACT_AT_EDGE, Status.CONVERGED}
        assert (estimate.motion is None) == (estimate.status is Status.IMPACT_AT_EDGE)
        after = estimate.middle
        if after is not None:
            assert np.linalg.norm((after.v_world - truth.motion.v_world[-1])[:2]) < 0.5


def test_a_particle_that_broke_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recipe = replace(RECIPE, seed=3, contact_physics=(EffectRecipe("chip", {"depth": 0.1}),))
    write_observation(replace(build_silhouette_sequence(recipe, 0)[0], name="drop"), tmp_path / "drop")
    assert main(["estimate", str(tmp_path / "drop"), "--out", str(tmp_path / "e"), *QUICK]) == 1
    assert "the particle broke, or touched again unseen: its pictures fit" in " ".join(capsys.readouterr().out.split())
    (path,) = (tmp_path / "e").glob("*.estimate.json")
    assert read_estimate(path).status is Status.BROKEN
