"""Silhouette campaigns of the field challenge: drawn, written without what is hidden, solved, scored like trajectories."""

import json
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy.spatial.transform import Rotation

from datasets.observation_files import read_observation
from datasets.recipes.effects import KNOWN
from tumble.challenge.field_case import FieldCase, case_from_dict, read_field_cases
from tumble.challenge.field_drawing import PUSH, STRAY
from tumble.challenge.field_flights import DENSE, nominal_times
from tumble.challenge.field_noise import far_off, heavy_tailed
from tumble.challenge.field_picture_drawing import LONGEST_S, MOST_FRAMES, draw_silhouettes
from tumble.challenge.field_scoring import axes_apart, parameter_rows
from tumble.challenge.field_silhouettes import as_flown, flown_in_pictures, messy, observed, planned
from tumble.cli import main as command_line

CIRCLE = 40.0 * np.column_stack([np.cos(a := np.linspace(0.0, 2.0 * np.pi, 400, endpoint=False)), np.sin(a)])


def tumble(*words: str | Path) -> int:
    return command_line.main(["challenge", *(str(word) for word in words)])


@pytest.fixture(scope="module")
def root(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One campaign of one short flight, and its answer, found where the truth tree does not exist."""
    root = tmp_path_factory.mktemp("silhouettes")
    small = ["--campaigns", "1", "--most-flights", "1", "--most-rows", "9", "--seed", "6", "--jobs", "1", "-q"]
    small += ["--measured", "silhouettes"]
    assert tumble("make", "--field", "--out", root / "made", *small) == 0
    (root / "made" / "truth").rename(root / "elsewhere")
    assert tumble("solve", root / "made", "--out", root / "answers", "--jobs", "1", "-q") == 0
    (root / "elsewhere").rename(root / "made" / "truth")
    return root


def bare(seed: int, rows: tuple[int, int] = (8, 120)) -> FieldCase:
    return draw_silhouettes("f", (1, 40), rows, np.random.default_rng(seed))


def test_flights_are_unequal_and_short_enough() -> None:
    cases = [bare(seed) for seed in range(60)]
    for case in cases:
        frames = [flight.rows for flight in case.flights]
        assert 1 <= len(frames) <= 8
        assert sum(frames) <= MOST_FRAMES
        assert all(8 <= n <= max(8, LONGEST_S * case.flights[0].rate_hz) for n in frames)
        assert case.noise.rounded == (case.flights[0].rate_hz <= 250.0)
    assert max(len(case.flights) for case in cases) >= 6
    assert max(flight.rows for case in cases for flight in case.flights) > 80


def test_files_say_nothing_of_what_is_hidden(root: Path) -> None:
    (case,) = read_field_cases(root / "made")
    files = [path for path in (root / "made" / "campaigns").rglob("*") if path.is_file()]
    assert files
    for path in files:
        content = path.read_bytes().replace(b"gravity_world", b"").replace(b"sigma_length_scale", b"")
        assert [word for word in (*KNOWN, str(case.seed), "cut_stone", "jagged") if word.encode() in content] == []
    seen = read_observation(root / "made" / "campaigns" / case.name / "observations" / case.flights[0].name)
    assert case.scene is not None
    assert (len(seen.clock.times_s), len(seen.views), seen.mass_kg) == (case.flights[0].rows, 6 * case.scene.drops, None)
    assert (seen.sigma_length_scale is not None) is ("length_scale" in case.mess)
    stated = seen.cameras[0].lens_covariance
    assert bool(stated is not None and stated[0, 0] > 0.0) is ("focal_length" in case.mess)
    assert bool(stated is not None and stated[2, 2] > 0.0) is ("principal_point" in case.mess)


def test_the_mess_is_below_its_limits(root: Path) -> None:
    (case,) = read_field_cases(root / "made")
    assert case_from_dict(json.loads(json.dumps(asdict(case)))) == case
    assert {"uniform_acceleration", "length_scale", "focal_length", "principal_point"} - set(case.hidden) <= set(case.mess)
    assert all(over <= PUSH * (1 + 1e-9) for over in case.mess_over_limit.values())
    assert any(over <= STRAY * (1 + 1e-9) for over in case.mess_over_limit.values())


def test_answers_are_scored_by_kind(root: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert tumble("score", root / "made", root / "answers", "--out", root / "scored", "--jobs", "1") == 0
    printed = capsys.readouterr().out
    for line in ("silhouettes: campaigns with a false name", "silhouettes: v inside its 95% ellipsoid", "where noise is not stated"):
        assert line in printed
    assert "1 silhouettes" in (root / "scored" / "field.md").read_text()
    assert len(pd.read_csv(root / "scored" / "velocities.csv")) == 4  # v and omega, before and after


def test_the_true_motion_is_that_of_the_frames() -> None:
    case = as_flown(bare(4, (8, 12)))
    plan, flight = planned(case, 0), flown_in_pictures(case, 0, DENSE)
    np.testing.assert_allclose(flight.motion.v_world[::DENSE], plan.motion.v_world, atol=1e-9)
    np.testing.assert_allclose(flight.nominal_s, nominal_times(case.flights[0], DENSE))
    assert case.flights[0].omega_world == pytest.approx(tuple(plan.motion.omega_world[0]))


def test_the_same_case_is_seen_the_same_and_stamps_are_rounded_where_frames_are_far_apart() -> None:
    case = bare(4, (8, 8))
    case = replace(case, flights=tuple(replace(flight, rate_hz=230.0) for flight in case.flights[:1]))
    (first,), (again,) = observed(case), observed(case)
    rounded = replace(case, noise=replace(case.noise, rounded=True))
    np.testing.assert_array_equal(first.recordings[0][5].points_px, again.recordings[0][5].points_px)  # type: ignore[index,union-attr]
    np.testing.assert_allclose(observed(rounded)[0].clock.times_s, np.round(first.clock.times_s, 3), atol=1e-12)


def test_noise_is_as_large_as_told_alike_over_frames_and_some_outlines_are_off() -> None:
    def radii(outliers: float) -> list[np.ndarray]:
        shown = messy([CIRCLE] * 120, 0.2, 3, outliers, np.random.default_rng(0))
        return [np.linalg.norm(outline.points_px, axis=1) - 40.0 for outline in shown]

    assert np.std(np.concatenate(radii(0.0))) == pytest.approx(0.2, rel=0.05)
    shown = messy([CIRCLE] * 120, 0.2, 3, 0.05, np.random.default_rng(1))
    off = [np.linalg.norm(outline.points_px.mean(axis=0)) > 0.5 for outline in shown]
    assert 1 <= sum(off) <= 20
    field = heavy_tailed(np.random.default_rng(2), 400, 50, 2)
    assert np.mean(field[1:] * field[:-1]) == pytest.approx(0.5, abs=0.05)
    assert np.mean(field[2:] * field[:-2]) == pytest.approx(0.0, abs=0.05)
    shifts = np.linalg.norm(far_off(np.random.default_rng(3), np.array([True, False]), 2), axis=1)
    assert 5.0 <= shifts[0] <= 20.0
    assert shifts[1] == 0.0


def test_a_centre_of_mass_is_judged_along_the_axes_that_were_found() -> None:
    turned = Rotation.from_euler("z", 90.0, degrees=True).as_matrix()
    case = bare(1)
    assert case.scene is not None
    scene = replace(case.scene, R_particle_body=tuple(tuple(row) for row in np.eye(3)))
    values = {name: (value,) * len(case.flights) for name, value in zip(("c1", "c2", "c3"), (1e-5, 0.0, 0.0), strict=True)}
    case = replace(case, scene=scene, hidden={"centre_of_mass": values})
    row = {"effect": "centre_of_mass", "parameter": "c2", "value": -1e-5, "sigma": 1e-6, "is_size": True, "sequence": None}
    answer = {"found": ["centre_of_mass"], "axes": {"f-1": turned.tolist()}, "parameters": [row]}
    np.testing.assert_allclose(axes_apart(case, answer), turned.T, atol=1e-12)
    assert parameter_rows(case, answer)[0]["pull"] == pytest.approx(0.0, abs=1e-9)
