"""``--known`` and ``--possible`` through the verbs: they settle a group, widen v, are told, and come back in what to type next."""

import json
from pathlib import Path

import numpy as np
import pytest

from datasets.estimate_files import read_estimate
from datasets.json_documents import read_document
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.cli.main import main

GRAVITY = "--gravity=0,0,-9.81"
LENGTH = "length=96.0mm±0.3mm measured 100mm"


@pytest.fixture(scope="module")
def falling(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two flights that fall 4% too fast."""
    folder = tmp_path_factory.mktemp("falling")
    for trajectory in campaign(8, Hidden(more_gravity=0.4), Tracker(rows=40, orientation=False), sequences=2):
        write_csv(trajectory, folder)
    return folder


def test_a_known_length_settles_what_is_wrong(falling: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["diagnose", str(falling), GRAVITY, "--known", LENGTH, "--out", str(tmp_path / "known")]) == 0
    found = read_document(tmp_path / "known" / "diagnosis.json", "diagnosis")
    assert found["diagnosis"]["group"] == ["length_scale"]
    (fact,) = found["facts"]
    assert (fact["effects"], fact["model"]) == (["length_scale"], 0.0)
    assert f"--known '{LENGTH}'" in found["verdict"]["next"]
    assert "Stated: length=96.0mm" in capsys.readouterr().out
    page = (tmp_path / "known" / "report.html").read_text()
    assert "What was stated" in page
    assert "What limits v and ω?" in page


def test_explain_tells_a_number_under_each_of_its_names(falling: Path, tmp_path: Path) -> None:
    assert main(["explain", str(falling), GRAVITY, "--out", str(tmp_path / "bare"), "-q"]) == 0
    bare = read_document(tmp_path / "bare" / "diagnosis.json", "diagnosis")
    (group,) = bare["names"]
    assert bare["facts"] == []
    values = {name["effect"]: name["values"] for name in group["names"]}
    assert values["length_scale"][0]["value"] == pytest.approx(-0.04, abs=0.006)
    assert any("State one of them" in remark for remark in bare["verdict"]["remarks"])
    assert "possible" in [thing["kind"] for thing in bare["limits"]["things"]]
    assert main(["explain", str(falling), GRAVITY, "--known", LENGTH, "--out", str(tmp_path / "known"), "-q"]) == 0
    known = read_document(tmp_path / "known" / "diagnosis.json", "diagnosis")
    assert known["names"] == []
    assert known["model"] == ["length_scale"]
    assert abs(known["facts"][0]["misses"]) < 3.0
    assert known["limits"]["total"]["v_ms"] < bare["limits"]["total"]["v_ms"]


def test_a_possible_effect_widens_an_estimate(falling: Path, tmp_path: Path) -> None:
    assert main(["estimate", str(falling), GRAVITY, "--out", str(tmp_path / "bare"), "-q"]) == 0
    options = ["--possible", "length_scale=±4%"]
    assert main(["estimate", str(falling), GRAVITY, *options, "--out", str(tmp_path / "wide"), "-q"]) == 0
    bare, wide = (read_estimate(tmp_path / name / "toss_0.estimate.json") for name in ("bare", "wide"))
    assert bare.middle is not None
    assert wide.middle is not None
    assert np.array_equal(bare.middle.v_world, wide.middle.v_world)
    assert np.trace(wide.middle.covariance[:3, :3]) > 2.0 * np.trace(bare.middle.covariance[:3, :3])
    limits = read_document(tmp_path / "wide" / "campaign.json", "campaign")["limits"]
    assert [(thing["name"], thing["kind"]) for thing in limits["things"]] == [("length_scale", "possible")]
    assert "--possible 'length_scale=±4%'" in json.dumps(json.loads((tmp_path / "wide" / "run.json").read_text()), ensure_ascii=False)


def test_a_fact_with_an_effect_in_the_model_is_a_part_of_the_fit(falling: Path, tmp_path: Path) -> None:
    options = [GRAVITY, "--effects", "length_scale", "--known", "length_scale=-1.0%±0.01%"]
    assert main(["estimate", str(falling), *options, "--out", str(tmp_path / "out"), "-q"]) == 0
    (value,) = read_document(tmp_path / "out" / "campaign.json", "campaign")["values"]
    assert value["value"] == pytest.approx(-0.01, abs=2e-4)


@pytest.mark.parametrize("option", ["--known", "--possible"])
def test_what_cannot_be_read_is_refused_and_nothing_written(
    option: str, falling: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["compare", str(falling), GRAVITY, option, "length=100mm", "--out", str(tmp_path / "out"), "-q"]) == 2
    assert f"{option} 'length=100mm': expected " in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
