"""What v and omega take for granted: what no test shows and yet moves them, by how much, and what is left of it once it is stated."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from datasets.estimate_files import read_estimate
from datasets.json_documents import read_document
from datasets.trajectory import Trajectory
from estimator.diagnosis.score_tests import Column, ScoreTest
from estimator.effects.choosing import catalogue
from tests.estimator.made_trajectories import Hidden, Tracker, campaign
from tests.tumble.test_trajectory_verbs import write_csv
from tumble.cli.main import main
from tumble.unseen import Moved, Unseen, _covariance, unseen_entry, unseen_sentence, with_words

GRAVITY = "--gravity=0,0,-9.81"


def few_rows() -> Trajectory:
    (made,) = campaign(5, Hidden(), Tracker(rows=12), sequences=1)
    return made


def larger(made: Trajectory, by: float) -> Trajectory:
    """As recorded with a ruler that is so much too short."""
    assert made.x_world is not None
    return replace(made, x_world=made.x_world * (1.0 + by))


def written(folder: Path, made: Trajectory) -> None:
    (folder / "recording").mkdir(parents=True, exist_ok=True)
    write_csv(made, folder / "recording")


def limits(folder: Path, made: Trajectory, *options: str) -> dict[str, Any]:
    """What limits velocities, by ``diagnose`` of one recording."""
    written(folder, made)
    assert main(["diagnose", str(folder / "recording"), GRAVITY, *options, "--out", str(folder / "out"), "-q"]) == 0
    return dict(read_document(folder / "out" / "diagnosis.json", "diagnosis")["limits"])


def velocity(folder: Path, made: Trajectory) -> np.ndarray:
    written(folder, made)
    assert main(["estimate", str(folder / "recording"), GRAVITY, "--out", str(folder / "out"), "-q"]) == 0
    middle = read_estimate(next((folder / "out").glob("*.estimate.json"))).middle
    assert middle is not None
    return middle.v_world


def of(told: dict[str, Any], name: str) -> dict[str, Any]:
    return next(thing for thing in told["unseen"]["things"] if thing["name"] == name)


def names(told: dict[str, Any]) -> list[str]:
    return [thing["name"] for thing in told["unseen"]["things"]]


def test_velocities_are_off_by_what_is_told(tmp_path: Path) -> None:
    """The same rows with lengths near the end of what is plausible, which no test shows."""
    made = few_rows()
    told = limits(tmp_path / "told", made)
    scale = of(told, "length_scale")["v"]
    assert scale["with"] == "4.9%"
    moved = velocity(tmp_path / "off", larger(made, scale["values"][0])) - velocity(tmp_path / "right", made)
    assert scale["off"] == pytest.approx(np.linalg.norm(moved), rel=0.02)
    assert scale["off"] > 5.0 * told["total"]["v_ms"]
    assert "with length scale of 4.9%" in told["unseen"]["sentence"]


def test_of_several_values_those_that_move_a_velocity_most_are_told(tmp_path: Path) -> None:
    """The tracked point put beside the centre of mass by just these values moves v by what is said of them."""
    made = few_rows()
    com = of(limits(tmp_path / "told", made), "centre_of_mass")["v"]
    assert made.q_world_tracked is not None
    assert made.x_world is not None
    tracked = replace(made, x_world=made.x_world - Rotation.from_quat(made.q_world_tracked).apply(com["values"]))
    moved = velocity(tmp_path / "off", tracked) - velocity(tmp_path / "right", made)
    assert com["off"] == pytest.approx(np.linalg.norm(moved), rel=0.05)


def test_what_is_stated_as_possible_is_in_the_error_bars_and_not_taken_for_granted(tmp_path: Path) -> None:
    made = few_rows()
    bare, stated = limits(tmp_path / "bare", made), limits(tmp_path / "stated", made, "--possible", "length_scale=±5%")
    assert "length_scale" not in names(stated)
    assert stated["total"]["v_ms"] == pytest.approx(np.hypot(bare["total"]["v_ms"], of(bare, "length_scale")["v"]["off"]), rel=0.02)


def test_what_is_stated_in_part_is_taken_for_granted_in_the_other_part(tmp_path: Path) -> None:
    told = limits(tmp_path, few_rows(), "--known", "centre_of_mass.c1=0±0.1mm")
    values = np.abs(of(told, "centre_of_mass")["v"]["values"])
    assert values[0] < 1e-3 < values[1:].max()


def test_what_is_found_is_not_said_to_be_unseen(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither beside a model that lacks it, of which nothing is said, nor beside the one that has it under one of its names."""
    for made in campaign(8, Hidden(drag=0.3), Tracker(rows=20), sequences=3):
        written(tmp_path, made)
    source, options = str(tmp_path / "recording"), [GRAVITY]
    assert main(["diagnose", source, *options, "--out", str(tmp_path / "lacks")]) == 0
    assert read_document(tmp_path / "lacks" / "diagnosis.json", "diagnosis")["limits"]["unseen"] is None
    assert main(["explain", source, *options, "--out", str(tmp_path / "has")]) == 0
    told = read_document(tmp_path / "has" / "diagnosis.json", "diagnosis")
    assert told["model"] == ["quadratic_drag"]
    assert "length_scale" in names(told["limits"])
    assert not {"quadratic_drag", *(name["effect"] for group in told["names"] for name in group["names"])} & set(names(told["limits"]))
    assert "takes for granted" in capsys.readouterr().out


def test_a_law_of_ones_own_that_nothing_limits_is_left_out(tmp_path: Path) -> None:
    plug_in = tmp_path / "nought.py"
    plug_in.write_text(NOUGHT)
    assert "nought" not in names(limits(tmp_path, few_rows(), "--also", f"{plug_in}:Nought"))


def test_of_two_particles_the_one_that_shows_less_counts() -> None:
    effect, columns = catalogue()["spin_damping"], (Column(0, 0, 0, 0), Column(0, 0, 0, 1))
    both = SimpleNamespace(facts=(), sharing=lambda scope: (0, 1))
    for variances in ([1e-4, 1e2], [1e2, 1e-4]):
        test = ScoreTest(effect, columns, np.zeros(2), np.diag(variances), 0.0, 1.0, {})
        (limit,) = (max(map(abs, p.plausible)) for p in effect.entry.parameters)
        assert _covariance(both, test) == pytest.approx(1.0 / (1.0 / (3.3**2 * 1e2) + limit**-2.0))


@pytest.fixture
def found() -> tuple[Unseen, Unseen]:
    by_key = catalogue()
    com = Unseen(by_key["centre_of_mass"], Moved(0.11, (0.03, 0.04, 0.0)), Moved(1e-9, (0.03, 0.04, 0.0)))
    return com, Unseen(by_key["frame_rate"], Moved(0.06, (0.05,)), Moved(0.08, (0.05,)))


def test_what_matters_is_told_with_its_size_and_what_to_do(found: tuple[Unseen, Unseen]) -> None:
    sentence = unseen_sentence(found, (0.001, 0.01))
    assert "v would be off by 0.11 m/s with centre of mass of 0.05 m, 0.06 m/s with frame rate of 5%" in sentence
    assert "ω would be off by 0.08 rad/s with frame rate of 5%" in sentence
    assert "--possible EFFECT=±SIGMA" in sentence
    assert "frame_rate=0±1e-5" in sentence


def test_nothing_is_told_where_it_is_within_the_error_bars_or_not_measured(found: tuple[Unseen, Unseen]) -> None:
    assert unseen_sentence(found, (0.2, 0.1)) == ""
    entry = unseen_entry(found, {"v_ms": float("nan"), "omega_rads": 0.01})
    assert [(thing["name"], thing["v"]) for thing in entry["things"]] == [("frame_rate", None)]
    assert entry["sentence"].startswith("That takes for granted what these data would not show: ω would be off")


def test_values_without_a_common_unit_are_told_each() -> None:
    assert with_words(catalogue()["inertia_ratios"].entry, (0.02, -0.3)) == "inertia ratios of e1 0.02, e2 -0.3"


NOUGHT = '''"""Nothing at all."""

import numpy as np

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import EffectModel


class Nought(EffectModel):
    """An acceleration that is none, of any size."""

    entry = EffectEntry(
        "nought", Stage.DYNAMICS, Scope.CAMPAIGN, (Parameter("size", "1", (-np.inf, np.inf), 1e-3, "of nothing"),), "nothing", "made up"
    )

    def acceleration(self, theta, moment, setting):
        return 0.0 * theta[:, :1] * moment.v

'''
