"""``tumble validate-contact`` on estimates of trajectories: shape and plate are stated, since there are no pictures."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from estimator.contact_validation.fitting import fit
from estimator.contact_validation.heights import heights_against
from estimator.contact_validation.laws.models import RIGID
from estimator.contact_validation.spread import prepared
from tests.estimator.measurements.trajectories.struck_tosses import toss
from tumble.cli.main import main
from tumble.contact_documents import FILE, heights_entry
from tumble.contact_validating import Known, collected

RUNS = 4


@pytest.fixture(scope="module")
def estimates(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("struck")
    rng = np.random.default_rng(5)
    for number in range(RUNS):
        t = toss(rng).trajectory
        assert t.q_world_tracked is not None
        rows = np.column_stack([t.times_s, t.x_world, t.q_world_tracked])
        lines = [" ".join(repr(float(v)) for v in row) for row in rows]
        (folder / f"toss_{number}.tum").write_text("\n".join(lines) + "\n")
    (folder / "trajectory.toml").write_text("gravity_world = [0.0, 0.0, -9.81]\ninertia_ratios = [0.6, 0.8, 1.0]\n")
    assert main(["estimate", str(folder), "--out", str(folder / "estimates"), "-q"]) == 0
    return folder / "estimates"


def test_shape_and_plate_are_those_stated(estimates: Path, tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.1, 0.1)).export(tmp_path / "box.ply")
    found = collected(estimates, None, Known((0.0, 0.0, 2.0), 1200.0, tmp_path / "box.ply"))
    assert len(found.impacts) == RUNS
    assert found.left_out == {}
    for impact in found.impacts:
        np.testing.assert_allclose(impact.plate.normal_world, [0.0, 0.0, 1.0])
        assert impact.particle.solid.mass_kg == pytest.approx(1.2)
        # The lowest corner of the mesh is where the toss touched: on the board, at z = 0.
        assert abs(impact.state.x_world[2] + impact.low_corners[:, 2].min()) < 1e-3
    heights = heights_against(found.impacts)
    assert heights is not None
    assert abs(heights.scale) < 3.0 * heights.scale_sigma
    assert "those of the mesh's" in heights_entry(heights)["sentence"]
    assert "2.1% less than the mesh's" in heights_entry(replace(heights, scale=0.021, scale_sigma=0.003))["sentence"]
    rigid = fit(prepared(found.impacts, 0), RIGID).values
    assert abs(rigid[0] - 0.5) < 0.05
    assert abs(rigid[1] - 0.15) < 0.03


def test_without_shape_and_plate_it_says_what_to_give(estimates: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["validate-contact", str(estimates), "--plate=0,0,1", "--out", str(tmp_path / "out"), "-q"]) == 2
    assert "give --mesh FILE and --plate=X,Y,Z" in capsys.readouterr().err
    assert not (tmp_path / "out" / FILE).exists()
