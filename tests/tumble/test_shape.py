"""``tumble shape``: drops in, a particle file out that import and estimate take; what is wrong is named."""

import json
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from datasets.calibration_files import write_calibration
from datasets.errors import InputError
from datasets.estimate_files import read_estimate
from datasets.mesh_files import write_mesh
from datasets.observation import Observation
from datasets.observation_files import read_observation, write_observation
from datasets.outline_files import write_outlines
from datasets.particle_files import read_particle
from datasets.recipes.recipe import MotionRecipe, ParticleRecipe, Recipe, RigRecipe
from datasets.vocabulary.calibration import Calibration
from datasets.vocabulary.camera import HsvCamera
from estimator.data.configuration import Configuration
from estimator.outlines.result import EMPTY
from estimator.particle.view_faults import mirrored
from scripts.trials.study_shape import Rendered, rendered
from synth.sequence import build_silhouette_sequence
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.campaigning import Known, prepare
from tumble.cli.campaign_options import described_effects
from tumble.cli.main import main
from tumble.cli.shape import shape_rows
from tumble.diagnosing import Question
from tumble.engine import Serial
from tumble.reporting import collect, frame_words, particle_of
from tumble.shaping.drops import Drop
from tumble.shaping.shaping import shape

pytestmark = pytest.mark.long

RECIPE = Recipe(
    seed=3,
    particle=ParticleRecipe(size_mm=(6.0, 6.0)),
    motion=MotionRecipe(frames=20, speed_ms=(0.3, 0.6), spin_rads=(100.0, 150.0)),
    rig=RigRecipe(drops=3),
)


@pytest.fixture(scope="module")
def made() -> Rendered:
    return rendered("stone", ParticleRecipe(size_mm=(6.0, 6.0)), 21, drops=3)


@pytest.fixture(scope="module")
def drops(made: Rendered, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Outlines of three drops, one of them as masks, and the rig."""
    folder = tmp_path_factory.mktemp("drops")
    for drop in made.drops:
        write_outlines(folder / f"{drop.name}.npz", drop.outlines)
    (folder / "masks").mkdir()
    for camera, (outline, view) in enumerate(zip(made.drops[2].outlines, made.drops[2].views, strict=True)):
        mask = np.zeros((view.intrinsics.height_px, view.intrinsics.width_px), np.uint8)
        cv2.fillPoly(mask, [np.round(outline.points_px * 64).astype(np.int32)], 255, shift=6)
        cv2.imwrite(str(folder / "masks" / f"c{camera}.png"), mask)
    cameras = tuple(HsvCamera(f"c{k}", v.intrinsics, v.R_cam_particle, v.t_cam_particle) for k, v in enumerate(made.drops[0].views))
    (folder / "rig").mkdir()
    write_calibration(Calibration(cameras=cameras), folder / "rig" / "calibration.json")
    return folder


@pytest.fixture(scope="module")
def stone(drops: Path) -> Path:
    out = drops / "stone"
    assert main(["shape", str(drops / "drop0.npz"), str(drops / "drop1.npz"), "--rig", str(drops / "rig"), "--out", str(out), "-q"]) == 0
    return out


def test_a_particle_file_says_what_was_found(stone: Path, made: Rendered) -> None:
    particle = read_particle(stone)
    assert len(particle.views) == 12
    assert particle.merging is not None
    assert [entry["name"] for entry in particle.merging["sets"]] == ["drop0", "drop1"]
    assert np.array(particle.merging["covariance"]).shape == (12, 12)
    R = [np.array(entry["R_set_particle"]) for entry in particle.merging["sets"]]
    turned = R[1] @ R[0].T @ (made.R[1] @ made.R[0].T).T
    assert np.rad2deg(np.arccos((np.trace(turned) - 1.0) / 2.0)) < 0.25
    assert particle.shape["volume_sigma_m3"] > 0.0
    assert any("further views would do" in note for note in particle.notes)
    assert (stone / "surface.ply").stat().st_size > 1000


def test_masks_named_as_the_cameras_may_lack_one(stone: Path, drops: Path, capsys: pytest.CaptureFixture[str]) -> None:
    five = drops / "five"
    five.mkdir()
    for camera in (0, 1, 2, 4, 5):
        (five / f"c{camera}.png").write_bytes((drops / "masks" / f"c{camera}.png").read_bytes())
    words = ["shape", str(stone), str(five), "--rig", str(drops / "rig"), "--masks", "--out", str(drops / "more"), "--json"]
    assert main(words) == 0
    document = json.loads(capsys.readouterr().out)
    assert [(entry["name"], entry["views"]) for entry in document["merging"]["sets"]] == [("stone", 12), ("five", 5)]
    assert {entry["view"] for entry in document["merging"]["views"] if entry["set"] == "five"} == {0, 1, 2, 3, 4}
    (five / "c5.png").rename(five / "picture9.png")
    assert main([*words[:-3], "--out", str(drops / "not")]) == 2
    assert "name the others' files as the cameras are named (c0, c1, c2, c3, c4, c5)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("{drops}/drop0.npz",), "expected --rig RIG once, or once for each of the 1 drops"),
        (("{drops}/drop0.npz", "--rig", "{drops}/drop1.npz"), "expected a rig as tumble calibrate rig writes it"),
        (("{drops}/drop0.npz", "--rig", "{drops}/no rig"), "got no such folder or file"),
        (("{drops}/stone", "--rig", "{drops}/rig"), "expected no --rig where all drops are calibrated already"),
        (("{drops}/drop0.npz", "--rig", "{drops}/rig", "--mass", "-1"), "expected kilograms"),
        (("{drops}/masks", "--rig", "{drops}/rig", "--background", "{drops}/masks/c0.png"), "expected --background for each of the 6"),
        (
            ("{drops}/masks", "--rig", "{drops}/rig", "--masks", "--background", "{drops}/masks/c0.png"),
            "expected no --background with --masks",
        ),
    ],
)
def test_what_is_wrong_is_named(stone: Path, drops: Path, words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert stone.is_dir()
    assert main(["shape", *(word.format(drops=drops) for word in words), "--out", str(drops / "refused")]) == 2
    assert said in capsys.readouterr().err
    assert not (drops / "refused").exists()


def test_estimates_are_the_same_with_and_without_what_is_kept(tmp_path: Path) -> None:
    """An estimate from the views that an observation states, from the particle file, and from one that keeps nothing."""
    observation = build_silhouette_sequence(RECIPE, 0)[0]
    write_observation(observation, tmp_path / "one")
    assert main(["shape", str(tmp_path / "one"), "--out", str(tmp_path / "stone"), "-q"]) == 0
    particle = read_particle(tmp_path / "stone")
    assert particle.merging is None
    common = ["estimate", str(tmp_path / "one"), "--jobs", "1", "-q"]
    assert main([*common, "--out", str(tmp_path / "plain")]) in (0, 1)
    assert main([*common, "--particle", str(tmp_path / "stone"), "--out", str(tmp_path / "kept")]) in (0, 1)
    named = replace(read_observation(tmp_path / "one"), particle=tmp_path / "stone")
    write_observation(replace(named, views=particle.views, view_recording=particle.outlines), tmp_path / "named" / "one")
    assert read_observation(tmp_path / "named" / "one").made is not None
    assert main(["estimate", str(tmp_path / "named" / "one"), "--jobs", "1", "-q", "--out", str(tmp_path / "third")]) in (0, 1)
    (first, second, third) = ((tmp_path / where / "one.estimate.json").read_bytes() for where in ("plain", "kept", "third"))
    assert first == second == third
    assert [bool(frame_words(tmp_path / where)) for where in ("plain", "kept", "third")] == [False, True, True]
    assert "Orientations are in the frame of" in frame_words(tmp_path / "third")
    bare = replace(read_observation(tmp_path / "one"), views=(), view_recording=())
    write_observation(bare, tmp_path / "bare" / bare.name)
    shutil.copytree(tmp_path / "kept", tmp_path / "of_tangents")
    (tmp_path / "of_tangents" / "one.surface.ply").unlink()
    (shown,) = collect(tmp_path / "of_tangents", tmp_path / "bare", None, out=tmp_path / "page", executor=Serial(), quiet=True)
    assert shown.result["shown"]["body"] is not None
    assert any(name.endswith("stone/particle.json") for name, _ in shown.result["shown"]["read"])
    (tmp_path / "stone").rename(tmp_path / "elsewhere")
    shutil.copytree(tmp_path / "one", tmp_path / "own" / bare.name)
    (shown,) = collect(tmp_path / "of_tangents", tmp_path / "own", None, out=tmp_path / "page", executor=Serial(), quiet=True)
    assert shown.result["shown"]["cameras"][0]["pictures"]
    assert shown.result["shown"]["body"] is None  # not the body of the observation's own views, which lies in another frame
    (shown,) = collect(tmp_path / "kept", tmp_path / "own", None, out=tmp_path / "page", executor=Serial(), quiet=True)
    assert shown.result["shown"]["body"] is not None  # the estimate's own surface lies where its poses have it
    assert read_estimate(tmp_path / "kept" / "one.estimate.json").middle is not None


def test_import_takes_a_particle_file(stone: Path, drops: Path, tmp_path: Path) -> None:
    observation = build_silhouette_sequence(RECIPE, 0)[0]
    write_observation(observation, tmp_path / "one")
    words = ["import", str(tmp_path / "one" / "outlines_hsv.npz"), "--camera", str(tmp_path / "one"), "--particle", str(stone)]
    assert main([*words, "--gravity", "down", "--rate", "4000", "--exposure", "50us", "--out", str(tmp_path / "run"), "-q"]) in (0, 1)
    read = read_observation(tmp_path / "run" / "observations" / "outlines_hsv")
    assert len(read.views) == 12
    assert read.made is not None
    assert read.particle is not None
    assert read.particle.resolve() == stone.resolve()


def test_a_campaign_takes_a_particle_file_and_trajectories_none(stone: Path, tmp_path: Path) -> None:
    observation = build_silhouette_sequence(RECIPE, 0)[0]
    write_observation(replace(observation, views=(), view_recording=()), tmp_path / "one")
    known = Known(particle=stone)
    assert known.options == ("--particle", str(stone))
    prepared = prepare(tmp_path / "one", Configuration(), [], quiet=True, known=known)
    (found,) = prepared.observations.values()
    assert isinstance(found, Observation)
    assert len(found.views) == 12
    (tmp_path / "tosses").mkdir()
    for trajectory in campaign(8, Hidden(), Tracker(rows=20), sequences=1):
        write_csv(trajectory, tmp_path / "tosses")
    with pytest.raises(InputError, match="expected no --particle with trajectories"):
        prepare(tmp_path / "tosses", Configuration(), [], quiet=True, known=known)


def test_a_mesh_is_written_as_ply(tmp_path: Path) -> None:
    write_mesh(tmp_path / "m.ply", np.eye(3), np.array([[0, 1, 2]]))
    assert (tmp_path / "m.ply").read_bytes().startswith(b"ply\nformat binary_little_endian")


def test_a_picture_given_twice_counts_once(stone: Path, drops: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A drop given twice made the volume ten times surer; also one that a particle file has already."""
    words = ["shape", str(drops / "drop0.npz"), str(drops / "drop0.npz"), "--rig", str(drops / "rig"), "--out", str(drops / "again")]
    assert main([*words, "--json"]) == 1
    document = json.loads(capsys.readouterr().out)
    assert len(document["views"]["cameras"]) == 6
    assert any("drop0-2: view 5 left out: its outline is that of drop0, view 5 to the last digit" in note for note in document["notes"])
    words = ["shape", str(stone), str(drops / "drop1.npz"), "--rig", str(drops / "rig"), "--out", str(drops / "known"), "-q"]
    assert main(words) == 1
    assert len(read_particle(drops / "known").views) == 12


def test_what_too_few_views_leave_unknown_is_not_stated(made: Rendered) -> None:
    drop = made.drops[0]
    few = Drop("few", Path("few"), tuple(drop.outlines[:4]), tuple(drop.views[:4]), {})
    particle = shape([few], "few", mass_kg=None).particle
    rows = dict(shape_rows(particle))
    assert rows["hull larger than the body by"].startswith("unknown")
    assert "can only be told from 6 directions on, here by 2 more" in particle.notes[-1]


def test_views_that_contradict_one_another_are_no_body(made: Rendered, drops: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Pictures in the reverse order had a volume below 0, exit code 0, and ``tumble import`` as what comes next."""
    write_outlines(drops / "reversed.npz", made.drops[0].outlines[::-1])
    words = ["shape", str(drops / "reversed.npz"), "--rig", str(drops / "rig"), "--out", str(drops / "no stone")]
    assert main(words) == 1
    said = " ".join(capsys.readouterr().out.split())
    assert "volume not measured" in said
    assert "they contradict one another" in said
    assert "in the reverse order" in said
    assert "tumble import" not in said
    assert "further views" not in said


def test_transposed_rotations_of_a_rig_are_named(made: Rendered) -> None:
    """Also where no hull is left of them."""
    drop = made.drops[0]
    views = [replace(v, R_cam_particle=v.R_cam_particle.T) for v in drop.views]
    with pytest.raises(InputError, match="rotations are transposed"):
        shape([Drop("one", Path("one"), tuple(drop.outlines), tuple(views), {})], "one", mass_kg=None)


def test_views_left_out_are_not_counted(made: Rendered, drops: Path, capsys: pytest.CaptureFixture[str]) -> None:
    outlines = list(made.drops[0].outlines)
    outlines[2] = mirrored(outlines[2], made.drops[0].views[2].intrinsics.width_px)
    write_outlines(drops / "one mirrored.npz", outlines)
    assert main(["shape", str(drops / "one mirrored.npz"), "--rig", str(drops / "rig"), "--out", str(drops / "five of six")]) == 1
    assert "5 of 6 views" in capsys.readouterr().out


def test_the_excess_of_a_hull_is_of_the_body(stone: Path) -> None:
    """Of a hull of which 55 % were taken off, 124 % of what is left."""
    particle = read_particle(stone)
    dinosaur = replace(particle, shape={**particle.shape, "hull_volume_excess": 0.553})
    assert dict(shape_rows(dinosaur))["hull larger than the body by"] == "123.7% (taken off)"


def test_one_drop_that_is_left_lies_as_that_drop_does(made: Rendered) -> None:
    """A particle's frame is kept, whichever drop it was given as."""
    first, second = (Drop(d.name, Path(d.name), tuple(d.outlines), tuple(d.views), {}) for d in made.drops[:2])
    nothing = replace(first, outlines=(EMPTY,) * 6)
    views = shape([nothing, replace(second, posed=True)], "one", mass_kg=None).particle.views
    np.testing.assert_array_equal(views[0].t_cam_particle, second.views[0].t_cam_particle)


def test_a_report_knows_the_particle_of_a_joint_fit(tmp_path: Path) -> None:
    """``estimate --effects --particle`` states it as ``estimate --particle`` does."""
    known = Known(particle=tmp_path / "stone")
    content = described_effects(Question(source=tmp_path, configuration={}, effects=(), words="quadratic_drag", known=known))
    (tmp_path / "run.json").write_text(json.dumps({"schema": "tumble-run", "configuration": content}), encoding="utf-8")
    assert particle_of(tmp_path) == (tmp_path / "stone").resolve()
