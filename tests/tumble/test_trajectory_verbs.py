"""The verbs on trajectories, end to end: what they write, what they refuse."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from datasets.estimate_files import read_estimate
from datasets.json_documents import read_document
from datasets.trajectory import Trajectory
from tests.estimator.made_trajectories import RATE_HZ, Hidden, Tracker, campaign
from tests.estimator.measurements.trajectories.struck_tosses import toss
from tests.estimator.measurements.trajectories.test_gyroscope import gyro_rows
from tests.tumble.test_effect_writing import diagnosis
from tumble.cli.campaign_options import values_table
from tumble.cli.main import main
from tumble.reports.words import rms_ete_px

pytestmark = pytest.mark.long

GRAVITY = "--gravity=0,0,-9.81"


def write_csv(trajectory: Trajectory, folder: Path) -> None:
    columns, names = [trajectory.times_s[:, None], trajectory.x_world], ["t_s", "x_m", "y_m", "z_m"]
    if trajectory.q_world_tracked is not None:
        columns.append(trajectory.q_world_tracked)
        names += ["qx", "qy", "qz", "qw"]
    if trajectory.omega_world is not None:
        columns.append(trajectory.omega_world)
        names += ["wx_rads", "wy_rads", "wz_rads"]
    lines = [",".join(repr(float(v)) for v in row) for row in np.hstack(columns)]
    (folder / f"{trajectory.name}.csv").write_text("\n".join([",".join(names), *lines]) + "\n")


@pytest.fixture(scope="module")
def tosses(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tosses")
    for trajectory in campaign(8, Hidden(drag=0.3), Tracker(rows=20), sequences=3):
        write_csv(trajectory, folder)
    return folder


@pytest.fixture(scope="module")
def positions(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("positions")
    for trajectory in campaign(8, Hidden(drag=0.3), Tracker(rows=20, orientation=False), sequences=3):
        write_csv(trajectory, folder)
    (folder / "trajectory.toml").write_text("gravity_world = [0.0, 0.0, -9.81]\n")
    return folder


def test_diagnose_finds_the_drag_and_says_what_it_could_not_try(tosses: Path, tmp_path: Path) -> None:
    assert main(["diagnose", str(tosses), GRAVITY, "--out", str(tmp_path / "out"), "-q"]) == 0
    found = read_document(tmp_path / "out" / "diagnosis.json", "diagnosis")
    assert found["verdict"]["add"] == ["quadratic_drag"]
    assert found["verdict"]["next"] == f"tumble ladder {tosses} --gravity=0,0,-9.81 --effects quadratic_drag"
    assert found["unit"] == "σ"
    assert found["not_applicable"]["rolling_shutter"] == "it acts on pictures"
    assert not {each["effect"] for each in found["diagnosis"]["candidates"]} & set(found["not_applicable"])
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Not on trial" in page
    assert " px" not in page.split("</style>")[1].split("<footer")[0].replace("px in the", "")


@pytest.mark.parametrize("refused", [False, True])
def test_spins_that_contradict_orientations_are_said(tmp_path: Path, capsys: pytest.CaptureFixture[str], *, refused: bool) -> None:
    """Degrees are refused; swapped axes, which nothing that is tried mends, are noted and measured, though they fit badly."""
    (tmp_path / "tosses").mkdir()
    for made in campaign(8, Hidden(), Tracker(rows=20, spin=True), sequences=2):
        omega = np.asarray(made.omega_world)
        write_csv(replace(made, omega_world=np.degrees(omega) if refused else omega[:, [1, 2, 0]]), tmp_path / "tosses")
    assert main(["compare", str(tmp_path / "tosses"), GRAVITY, "--out", str(tmp_path / "out")]) == 2
    told = capsys.readouterr().err
    assert "toss_0.csv: wx_rads, wy_rads, wz_rads: expected the angular velocity, along the world's axes" in told
    assert ("call the columns wx_degs, wy_degs, wz_degs" in told) is refused
    assert ("tumble: note: " in told) is not refused
    assert (tmp_path / "out" / "diagnosis.json").is_file() is not refused


def test_a_warp_that_was_written_as_a_plug_in_goes_up_the_ladder(tosses: Path, tmp_path: Path) -> None:
    """Beside effects of which the links take a setting, as the next command of a real diagnosis has it."""
    found, law = diagnosis(tmp_path / "diagnosis.json", None, family="volume_warp"), tmp_path / "my_law.py"
    assert main(["effect", "new", "MyLaw", "--from", str(found), "--out", str(law), "-q"]) == 0
    effects = f"uniform_acceleration,centre_of_mass,frame_rate,{law}:MyLaw"
    assert main(["ladder", str(tosses), GRAVITY, "--effects", effects, "--out", str(tmp_path / "out"), "-q"]) == 0
    steps = read_document(tmp_path / "out" / "diagnosis.json", "diagnosis")["ladder"]
    assert steps[-1]["added"] == "my_law"


def test_a_recording_that_is_there_twice_counts_once(positions: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "twice"
    folder.mkdir()
    for path in positions.iterdir():
        (folder / path.name).write_text(path.read_text())
    (folder / "toss_9.csv").write_text((positions / "toss_1.csv").read_text())
    assert main(["compare", str(folder), "--out", str(tmp_path / "out")]) == 1
    assert "the same rows as toss_1" in capsys.readouterr().err
    assert read_document(tmp_path / "out" / "diagnosis.json", "diagnosis")["sequences"] == ["toss_0", "toss_1", "toss_2"]


@pytest.mark.parametrize("flat", [True, False], ids=["a column of zeros", "made data"])
def test_positions_without_noise_are_refused_until_it_is_stated(tmp_path: Path, *, flat: bool) -> None:
    (tmp_path / "tosses").mkdir()
    t = np.arange(60)[:, None] / RATE_HZ
    for number, each in enumerate(campaign(8, Hidden(), Tracker(rows=60, orientation=False), sequences=3)):
        x = each.x_world * [1.0, 0.0, 1.0] if flat else [0.1 * number, 0.0, 0.3] + t * [1.0, 0.5, 2.0] + 0.5 * t**2 * [0.0, 0.0, -9.81]
        write_csv(replace(each, x_world=x), tmp_path / "tosses")
    command = ["diagnose", str(tmp_path / "tosses"), GRAVITY, "--out", str(tmp_path / "out"), "-q"]
    assert main(command) == 2
    (tmp_path / "tosses" / "trajectory.toml").write_text("sigma_x_m = 5e-4\n")
    assert main(command) == 0


def test_what_one_number_cannot_tell_apart_is_one_group(tmp_path: Path) -> None:
    folder = tmp_path / "tosses"
    folder.mkdir()
    for trajectory in campaign(8, Hidden(more_gravity=0.4), Tracker(rows=40), sequences=3):
        write_csv(trajectory, folder)
    assert main(["diagnose", str(folder), GRAVITY, "--out", str(tmp_path / "out"), "-q"]) == 0
    diagnosis = read_document(tmp_path / "out" / "diagnosis.json", "diagnosis")["diagnosis"]
    assert {"frame_rate", "length_scale"} <= set(diagnosis["group"])
    pairs = [set(each["pair"]) for each in diagnosis["separations"]]
    assert {"frame_rate", "length_scale"} in pairs


def test_compare_ladder_and_estimate(positions: Path, tmp_path: Path) -> None:
    assert main(["compare", str(positions), "--out", str(tmp_path / "compare"), "-q"]) == 0
    compared = read_document(tmp_path / "compare" / "diagnosis.json", "diagnosis")
    assert compared["noise_floor"]["explainable"]
    assert compared["maps"][0]["residual_unit"] == "σ"
    assert main(["ladder", str(positions), "--effects", "quadratic_drag", "--out", str(tmp_path / "ladder"), "-q"]) == 0
    rungs = read_document(tmp_path / "ladder" / "diagnosis.json", "diagnosis")["ladder"]
    assert rungs[1]["held_out"]["rms_px"] < 0.8 * rungs[0]["held_out"]["rms_px"]
    assert main(["estimate", str(positions), "--effects", "quadratic_drag", "--out", str(tmp_path / "estimates"), "-q"]) == 0
    estimate = read_estimate(tmp_path / "estimates" / "toss_0.estimate.json")
    assert estimate.middle is not None
    assert np.isfinite(estimate.middle.v_world).all()
    assert np.isnan(estimate.middle.omega_world).all()
    assert "Orientation and spin were not measured" in estimate.message
    assert estimate.statistics["rows"] == 20
    assert rms_ete_px(estimate) is None


def test_estimate_of_poses_without_effects(tosses: Path, tmp_path: Path) -> None:
    assert main(["estimate", str(tosses), GRAVITY, "--out", str(tmp_path / "out"), "-q"]) in {0, 1}
    estimate = read_estimate(tmp_path / "out" / "toss_1.estimate.json")
    assert len(estimate.frames) == 20
    assert json.loads((tmp_path / "out" / "campaign.json").read_text())["effects"] == []


def test_files_with_blanks_and_umlauts_give_estimates_that_are_read(tosses: Path, tmp_path: Path) -> None:
    folder = tmp_path / "my tosses"
    folder.mkdir()
    for number, path in enumerate(sorted(tosses.glob("*.csv"))):
        (folder / f"Würfel {number}!.csv").write_text(path.read_text())
    (folder / "trajectory.toml").write_text('gravity_world = [0.0, 0.0, -9.81]\nparticle = "Würfel [red]"\n')
    assert main(["estimate", str(folder), "--out", str(tmp_path / "out"), "-q"]) in {0, 1}
    assert read_estimate(tmp_path / "out" / "Wurfel_1_.estimate.json").name == "Wurfel_1_"


def test_estimate_of_poses_that_strike_something_has_the_impacts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(5)
    folder = tmp_path / "struck"
    folder.mkdir()
    known = [toss(rng) for _ in range(2)]
    for number, each in enumerate(known):
        write_csv(replace(each.trajectory, name=f"toss_{number}"), folder)
    (folder / "trajectory.toml").write_text("gravity_world = [0.0, 0.0, -9.81]\ninertia_ratios = [0.6, 0.8, 1.0]\n")
    command = ["estimate", str(folder), "--out", str(tmp_path / "out")]
    assert main([*command, "--json"]) == 0
    assert [each["status"] for each in json.loads(capsys.readouterr().out)] == ["converged", "converged"]
    estimate = read_estimate(tmp_path / "out" / "toss_1.estimate.json")
    assert abs(estimate.impacts[0].time_s - known[1].hits[0].time_s) < 1e-3
    assert not (tmp_path / "out" / "campaign.json").exists()
    assert main(["report", str(tmp_path / "out"), "--out", str(tmp_path / "report"), "-q"]) == 0
    assert "2 free flights" in (tmp_path / "report" / "report.html").read_text()
    (folder / "broken.csv").write_text("t_s,x_m\n0,0\n")
    assert main([*command, "--force"]) == 1
    told = capsys.readouterr()
    assert "broken.csv is left out" in told.err
    assert "1 impact, 2 free flights" in told.out


def test_a_broken_file_is_left_out_and_named(tosses: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "tosses"
    folder.mkdir()
    for path in tosses.glob("*.csv"):
        (folder / path.name).write_text(path.read_text())
    (folder / "broken.csv").write_text("t_s,x_m,y_m,z_m\n0,0,0\n")
    assert main(["diagnose", str(folder), GRAVITY, "--out", str(tmp_path / "out"), "-q"]) == 1
    assert "broken.csv is left out" in capsys.readouterr().err


def test_a_mesh_gives_the_body(tosses: Path, tmp_path: Path) -> None:
    trimesh.creation.box((0.1, 0.06, 0.03)).export(tmp_path / "box.ply")
    words = [GRAVITY, "--mesh", str(tmp_path / "box.ply"), "--effects", "quadratic_drag", "--out", str(tmp_path / "out"), "-q"]
    assert main(["estimate", str(tosses), *words]) in {0, 1}
    assert (tmp_path / "out" / "campaign.json").exists()


@pytest.fixture(scope="module")
def spun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Readings of a gyroscope alone, whose spin is damped."""
    folder = tmp_path_factory.mktemp("spun")
    for trajectory in gyro_rows(4, 0.2, (0.55, 0.56, 1.0), rows=80):
        assert trajectory.gyro is not None
        lines = [",".join(repr(float(v)) for v in (t, *row)) for t, row in zip(trajectory.times_s, trajectory.gyro, strict=True)]
        (folder / f"{trajectory.name}.csv").write_text("\n".join(["t_s,gyro_x_rads,gyro_y_rads,gyro_z_rads", *lines]) + "\n")
    (folder / "trajectory.toml").write_text("inertia_ratios = [0.55, 0.56, 1.0]\n")
    return folder


def test_a_gyroscope_alone_goes_through_every_verb(spun: Path, tmp_path: Path) -> None:
    for verb in ("compare", "diagnose", "explain"):
        assert main([verb, str(spun), "--out", str(tmp_path / verb), "-q"]) == 0
    assert read_document(tmp_path / "diagnose" / "diagnosis.json", "diagnosis")["verdict"]["add"] == ["spin_damping"]
    assert main(["ladder", str(spun), "--effects", "spin_damping", "--out", str(tmp_path / "ladder"), "-q"]) == 0
    rungs = read_document(tmp_path / "ladder" / "diagnosis.json", "diagnosis")["ladder"]
    assert rungs[1]["held_out"]["rms_px"] < 0.5 * rungs[0]["held_out"]["rms_px"]
    assert main(["estimate", str(spun), "--effects", "spin_damping", "--out", str(tmp_path / "estimates"), "-q"]) == 0
    estimate = read_estimate(tmp_path / "estimates" / "spun_0.estimate.json")
    assert estimate.middle is not None
    assert np.isnan(estimate.middle.v_world).all()
    assert np.isfinite(estimate.middle.omega_world).all()
    assert "Positions were not measured" in estimate.message
    assert main(["report", str(tmp_path / "estimates"), "--out", str(tmp_path / "report"), "-q"]) == 0


def test_readings_that_are_no_free_rotation_are_called_that(tmp_path: Path) -> None:
    """A body that is turned to and fro by hand: far from free rotation, not too short a recording."""
    times, rng = np.arange(300) / 100.0, np.random.default_rng(4)
    read = 3.0 * np.sin(np.outer(times, [11.0, 17.0, 23.0])) * np.sin(7.0 * times)[:, None] + 0.01 * rng.normal(size=(300, 3))
    lines = [",".join(repr(float(v)) for v in (t, *row)) for t, row in zip(times, read, strict=True)]
    folder = tmp_path / "held"
    folder.mkdir()
    (folder / "held.csv").write_text("\n".join(["t_s,gyro_x_rads,gyro_y_rads,gyro_z_rads", *lines]) + "\n")
    for name, ratios in (("stated", "inertia_ratios = [0.5, 0.8, 1.0]\n"), ("a_ball", "")):
        (folder / "trajectory.toml").write_text(ratios)
        assert main(["diagnose", str(folder), "--out", str(tmp_path / name), "-q"]) == 2
        verdict = read_document(tmp_path / name / "diagnosis.json", "diagnosis")["verdict"]
        assert verdict["sentence"].startswith("The model misses something, and beside that nothing can be said")
        assert any("nothing held or touched the body" in remark for remark in verdict["remarks"])
        assert any("state inertia_ratios" in remark for remark in verdict["remarks"]) is (name == "a_ball")
        assert not any("longer flights" in remark for remark in verdict["remarks"])
    assert main(["compare", str(folder), "--out", str(tmp_path / "compare"), "-q"]) == 2
    assert "beside that nothing can be said" in read_document(tmp_path / "compare" / "diagnosis.json", "diagnosis")["verdict"]["sentence"]


REFUSED = [
    (["ladder", "{spun}", "--effects", "linear_drag"], "does not apply to these measurements: it needs measured positions"),
    (["diagnose", "{tosses}"], "expected gravity in the trajectory's frame"),
    (
        ["diagnose", "{tosses}", GRAVITY, "--effects", "radial_distortion"],
        "does not apply to these measurements: it acts on pictures",
    ),
    (
        ["ladder", "{positions}", "--effects", "magnus_lift"],
        "does not apply to these measurements: it needs a measured orientation or spin",
    ),
    (["estimate", "{tosses}", GRAVITY, "--mesh", "absent.ply"], "absent.ply: expected a mesh"),
    (["compare", "{tosses}/..", GRAVITY], "expected trajectories (*.csv, *.tum, *.txt) for --gravity=0,0,-9.81, got none"),
    (["diagnose", "{tosses}", "--gravity=0,0,0", "--effects", "frame_rate"], "frame_rate cannot be found in force-free flight"),
]


def test_sequences_that_measure_different_things_are_one_campaign(spun: Path, tmp_path: Path) -> None:
    folder = tmp_path / "mixed"
    folder.mkdir()
    flat, whole = campaign(8, Hidden(drag=0.3), Tracker(rows=30, ratios=(0.55, 0.56, 1.0)), sequences=2)
    write_csv(flat, folder)
    rows = [line.split(",") for line in (folder / f"{flat.name}.csv").read_text().splitlines()]
    unseen = [{2, 4, 5, 6, 7} if 5 < number < 9 else {2} for number in range(len(rows))]
    empty = [["" if column in gone else cell for column, cell in enumerate(row)] for row, gone in zip(rows, unseen, strict=True)]
    (folder / f"{flat.name}.csv").write_text("\n".join(",".join(row) for row in [rows[0], *empty[1:]]) + "\n")
    write_csv(whole, folder)
    for path in spun.glob("*.csv"):
        (folder / path.name).write_text(path.read_text())
    (folder / "trajectory.toml").write_text("gravity_world = [0.0, 0.0, -9.81]\ninertia_ratios = [0.55, 0.56, 1.0]\n")
    assert main(["diagnose", str(folder), "--out", str(tmp_path / "out"), "-q"]) == 0
    assert main(["estimate", str(folder), "--out", str(tmp_path / "estimates"), "-q"]) in {0, 1}
    estimate = read_estimate(tmp_path / "estimates" / f"{flat.name}.estimate.json")
    assert len(estimate.frames) == 30
    assert len(estimate.statistics["noise"]) == 6


@pytest.fixture
def folders(tosses: Path, positions: Path, spun: Path) -> dict[str, Path]:
    return {"tosses": tosses, "positions": positions, "spun": spun}


@pytest.mark.parametrize(("words", "said"), REFUSED, ids=[said[:30] for _, said in REFUSED])
def test_refused(words: list[str], said: str, folders: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    filled = [w.format(**folders) for w in words]
    assert main([*filled, "--out", str(tmp_path / "out"), "-q"]) == 2
    assert said in capsys.readouterr().err


def test_values_of_many_sequences_are_one_line_of_the_table() -> None:
    def value(sequence: str | None, size: float) -> dict[str, Any]:
        same = {"parameter": "a_x", "unit": "m/s2", "sigma": 0.1, "interval": [size - 0.2, size + 0.2], "plausible": True}
        return {"effect": "drag" if sequence is None else "push", "sequence": sequence, "value": size, **same}

    few = values_table([value(None, 1.0), value("a", 2.0), value("b", 3.0)])
    assert few.row_count == 3
    many = values_table([value(None, 1.0), *(value(f"toss_{i}", 0.1 * i) for i in range(40))])
    assert many.row_count == 2
    assert list(many.columns[2].cells) == ["all", "each of 40"]
    assert list(many.columns[3].cells)[1] == "0 to 3.9"
