"""Trajectories from files: what is read, and what is said of what cannot be."""

import re
from pathlib import Path

import numpy as np
import pytest

from datasets.errors import InputError
from datasets.trajectory import Trajectory
from datasets.trajectory_files import read_trajectory, trajectories_in

TUM = "# timestamp tx ty tz qx qy qz qw\n" + "\n".join(f"{1.5e9 + 0.01 * i} {0.1 * i} 0.2 {-0.01 * i} 0 0 0 1" for i in range(6)) + "\n"
HEADER = "t_s,x_m,y_m,z_m"
GRAVITY = {"gravity_world": (0.0, 0.0, -9.81)}


def written(folder: Path, text: str, name: str = "toss.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def rows(columns: int = 3, count: int = 6) -> str:
    return "".join(",".join([f"{0.01 * i:g}", *(f"{0.001 * i * (c + 1):g}" for c in range(columns))]) + "\n" for i in range(count))


def test_a_tum_file_is_read(tmp_path: Path) -> None:
    found = read_trajectory(written(tmp_path, TUM, "flight.tum"), GRAVITY)
    assert found.name == "flight"
    np.testing.assert_allclose(found.times_s, 0.01 * np.arange(6), atol=1e-6)
    np.testing.assert_allclose(found.x_world[:, 0], 0.1 * np.arange(6))
    assert found.q_world_tracked is not None
    assert found.q_world_tracked[0].tolist() == [0.0, 0.0, 0.0, 1.0]
    assert found.omega_world is None
    assert found.sigma_x is None
    assert found.surroundings.gravity_world.tolist() == [0.0, 0.0, -9.81]
    assert found.surroundings.body.inertia_ratios.tolist() == [1.0, 1.0, 1.0]


def test_units_stand_in_the_names_of_columns(tmp_path: Path) -> None:
    header = "t_ms,x_mm,y_mm,z_mm,wx_degs,wy_degs,wz_degs,sigma_x_mm,sigma_y_mm,sigma_z_mm"
    lines = "".join(f"{10 * i},{i},{2 * i},0,180,0,0,0.5,0.5,1\n" for i in range(6))
    found = read_trajectory(written(tmp_path, f"{header}\n{lines}"), GRAVITY)
    np.testing.assert_allclose(np.diff(found.times_s), 0.01)
    np.testing.assert_allclose(found.x_world[-1], [0.005, 0.01, 0.0])
    assert found.omega_world is not None
    np.testing.assert_allclose(found.omega_world, np.tile([np.pi, 0.0, 0.0], (6, 1)))
    assert found.sigma_x is not None
    np.testing.assert_allclose(found.sigma_x[0], [5e-4, 5e-4, 1e-3])
    assert found.q_world_tracked is None


def test_side_cars_say_what_numbers_do_not_and_the_nearest_one_counts(tmp_path: Path) -> None:
    path = written(tmp_path, f"{HEADER}\n{rows()}")
    written(tmp_path, 'gravity_world = [0.0, 9.8, 0.0]\nsigma_x_m = 1e-3\nworld = "room"\n', "trajectory.toml")
    written(tmp_path, 'sigma_x_m = 2e-3\ninertia_ratios = [1.0, 0.5, 0.8]\nparticle = "cork"\n', "toss.toml")
    found = read_trajectory(path, {})
    assert found.surroundings.particle == "cork"
    assert found.surroundings.gravity_world.tolist() == [0.0, 9.8, 0.0]
    assert found.surroundings.world == "room"
    assert found.sigma_x is not None
    assert (found.sigma_x == 2e-3).all()
    body = found.surroundings.body
    assert body.inertia_ratios.tolist() == [0.5, 0.8, 1.0]
    assert np.linalg.det(body.R_particle_body) == pytest.approx(1.0)
    np.testing.assert_allclose(body.R_particle_body @ np.diag(body.inertia_ratios) @ body.R_particle_body.T, np.diag([1.0, 0.5, 0.8]))
    assert read_trajectory(path, GRAVITY).surroundings.gravity_world.tolist() == [0.0, 0.0, -9.81]


def test_a_folder_has_its_trajectories_in_order(tmp_path: Path) -> None:
    for name in ("b.csv", "a.tum", "notes.md", "trajectory.toml"):
        written(tmp_path, "", name)
    assert [path.name for path in trajectories_in(tmp_path)] == ["a.tum", "b.csv"]
    assert trajectories_in(tmp_path / "absent") == ()
    written(tmp_path, "{}", "dataset.json")
    assert trajectories_in(tmp_path) == ()


def test_a_gyroscope_alone_needs_neither_positions_nor_gravity(tmp_path: Path) -> None:
    lines = "".join(f"{10 * i},0,{90 + i % 2},{180 if i != 2 else ''},1,1,1\n" for i in range(6))
    header = "t_ms,gyro_x_degs,gyro_y_degs,gyro_z_degs,sigma_gyro_x_degs,sigma_gyro_y_degs,sigma_gyro_z_degs"
    found = read_trajectory(written(tmp_path, f"{header}\n{lines}"), {})
    assert found.gyro is not None
    assert found.sigma_gyro is not None
    np.testing.assert_allclose(found.gyro[0], np.radians([0.0, 90.0, 180.0]))
    np.testing.assert_allclose(found.sigma_gyro[0], np.radians(1.0))
    assert np.isnan(found.gyro[2]).tolist() == [False, False, True]
    assert np.isnan(found.x_world).all()
    assert not found.surroundings.gravity_world.any()
    assert not found.whole


def test_a_gyroscope_at_its_limit_is_refused_until_those_cells_are_empty(tmp_path: Path) -> None:
    """What lies still, or is quantised, repeats readings, too: only the largest one, row after row, is a limit."""
    rng = np.random.default_rng(3)
    turning = np.column_stack(
        [np.round(rng.normal(0.0, 2.0, (40, 1))), np.zeros(40), 1500.0 + 40.0 * np.arange(40) + rng.normal(0.0, 5.0, 40)]
    )

    def read(values: np.ndarray) -> Trajectory:
        lines = "".join(f"{10 * k},{a:g},{b:g},{'' if np.isnan(c) else f'{c:.3f}'}\n" for k, (a, b, c) in enumerate(values))
        return read_trajectory(written(tmp_path, f"t_ms,gyro_x_degs,gyro_y_degs,gyro_z_degs\n{lines}"), {})

    assert read(turning).gyro is not None
    turning[10:18, 0] = turning[:, 0].max()
    turning[[9, 18], 0] -= turning[[9, 18], 0] - turning[10, 0] + 1.0
    assert read(turning).gyro is not None
    for sign in (1.0, -1.0):
        clipped = np.clip(sign * turning, -2000.0, 2000.0)
        limit = np.abs(clipped[:, 2]) == 2000.0
        with pytest.raises(
            InputError, match=rf"to 41: gyro_z_degs: expected readings that scatter, got {sign * 2000:g} in .* in all {limit.sum()} rows"
        ):
            read(clipped)
        clipped[limit, 2] = np.nan
        assert np.isfinite(np.asarray(read(clipped).gyro)[:, 2]).sum() == 40 - limit.sum()


def test_empty_cells_were_not_measured(tmp_path: Path) -> None:
    lines = "".join(f"{0.01 * i:g},{0.01 * i:g},,{0 if i else ''},{'0,0,0,1' if i != 3 else ',,,'}\n" for i in range(7))
    found = read_trajectory(written(tmp_path, f"{HEADER},qx,qy,qz,qw\n{lines}"), {**GRAVITY, "sigma_x_m": 1e-3})
    assert np.isfinite(found.x_world).sum(axis=0).tolist() == [7, 0, 6]
    assert found.q_world_tracked is not None
    assert np.flatnonzero(np.isnan(found.q_world_tracked).all(axis=1)).tolist() == [3]


@pytest.mark.parametrize(("header", "measured"), [("t_s,x_m,y_m", [7, 7, 0]), ("t_s,z_mm", [0, 0, 7])])
def test_an_axis_without_a_column_was_not_measured(tmp_path: Path, header: str, measured: list[int]) -> None:
    """A film from the side tells two coordinates, a ruler one."""
    found = read_trajectory(written(tmp_path, f"{header}\n{rows(count=7, columns=header.count(','))}"), GRAVITY)
    assert np.isfinite(found.x_world).sum(axis=0).tolist() == measured


def test_a_gyroscope_of_one_axis_is_read(tmp_path: Path) -> None:
    found = read_trajectory(written(tmp_path, f"t_s,gyro_z_rads\n{rows(count=7, columns=1)}"), {})
    assert found.gyro is not None
    assert np.isfinite(found.gyro).sum(axis=0).tolist() == [0, 0, 7]


def test_a_spin_that_is_known_once_is_that_of_the_middle_row(tmp_path: Path) -> None:
    written(tmp_path, "spin_world_rads = [1.0, 2.0, 300.0]\nsigma_spin_rads = [4.0, 4.0, 3.0]\n", "toss.toml")
    found = read_trajectory(written(tmp_path, f"{HEADER}\n{rows(count=7)}"), GRAVITY)
    assert found.omega_world is not None
    assert found.sigma_omega is not None
    assert np.flatnonzero(np.isfinite(found.omega_world).all(axis=1)).tolist() == [3]
    assert found.omega_world[3].tolist() == [1.0, 2.0, 300.0]
    assert found.sigma_omega[3].tolist() == [4.0, 4.0, 3.0]


BAD = {
    "half a quaternion in a row": (
        f"{HEADER},qx,qy,qz,qw\n" + "".join(f"{0.01 * i:g},0,0,0,0,{'' if i == 3 else 0},0,1\n" for i in range(6)),
        "line 5: expected all of qx, qy, qz, qw or none, got some of them empty",
    ),
    "an axis seen too rarely": (
        f"{HEADER}\n" + "".join(f"{0.01 * i:g},0,{0 if i < 3 else ''},0\n" for i in range(6)),
        "positions along y: expected at least 5 values or none, got 3",
    ),
    "a time that is empty": (f"{HEADER}\n{rows()},0,0,0\n", "line 8: t_s: expected a number, got an empty cell"),
    "noise of an unknown size": (
        f"{HEADER},sigma_x_m,sigma_y_m,sigma_z_m\n" + "".join(f"{0.01 * i:g},0,0,0,1,{'' if i == 2 else 1},1\n" for i in range(6)),
        "expected a standard deviation beside every measured value, got an empty cell",
    ),
    "an unknown column": ("t_s,x_m,y_m,z_m,sigmax_m\n", 'line 1: unknown column "sigmax_m"; did you mean sigma_x_m?'),
    "a column twice": ("t_s,x_m,y_m,z_m,x_m\n", 'line 1: expected every column once, got "x_m" twice'),
    "a truncated row": (f"{HEADER}\n{rows()}0.07,0.1\n", "line 8: expected 4 values (t_s, x_m, y_m, z_m), got 2"),
    "a word": (f"{HEADER}\n{rows()}0.07,0.1,lost,0\n", 'line 8: y_m: expected a number, got "lost"'),
    "NaN": (f"{HEADER}\n{rows()}0.07,0.1,nan,0\n", 'line 8: y_m: expected a finite number, got "nan"'),
    "time that goes back": (f"{HEADER}\n{rows()}0.02,0.1,0,0\n", "line 8: expected times that increase, got 0.02 after 0.05"),
    "too few rows": (f"{HEADER}\n{rows(count=3)}", "expected at least 5 rows, got 3"),
    "no times": (f"x_m,y_m,z_m\n{rows(columns=2)}", "expected one column of times (t_s, t_ms or t_us), got 0"),
    "no positions": (f"t_s,sigma_theta_rad\n{rows(columns=1)}", "expected positions x_m, y_m, z_m"),
    "an axis in two units": (f"t_s,x_m,x_mm\n{rows(columns=2)}", "expected one column for each axis, got x_m and x_mm"),
    "a column without its unit": ("t_s,x,y\n", 'line 1: unknown column "x"; did you mean x_m or x_mm or x_um?'),
    "a time without its unit": ("Time,x_m\n", 'line 1: unknown column "Time"; did you mean t_s or t_ms or t_us?'),
    "a sensor's own name": ("t_s,Gyroscope x (rad/s)\n", "did you mean gyro_x_rads?"),
    "half a quaternion": (f"{HEADER},qx,qy\n{rows(columns=5)}", "expected all of qx, qy, qz, qw or none, got no qz"),
    "a quaternion that is none": (
        f"{HEADER},qx,qy,qz,qw\n" + "".join(f"{0.01 * i:g},0,0,0,0,0,0,{1 + (i == 3)}\n" for i in range(6)),
        "line 5: expected a unit quaternion (qx, qy, qz, qw), got one of length 2",
    ),
    "millimetres": (f"{HEADER}\n" + "".join(f"{0.01 * i:g},{5 * i},0,0\n" for i in range(6)), "are they millimetres?"),
    "milliseconds": (f"{HEADER}\n" + "".join(f"{10 * i},{0.01 * i},0,0\n" for i in range(6)), "is it t_ms or t_us?"),
    "seconds called milliseconds": (
        f"t_ms,x_m,y_m,z_m\n{rows()}",
        "t_ms: expected times of a flight below 150 m/s, got 0.015 m, which is plausible, at 374.2 m/s, which is not; is it t_s?",
    ),
    "milliseconds called microseconds": ("t_us,x_m\n" + "".join(f"{i},{0.01 * i:g}\n" for i in range(6)), "is it t_s or t_ms?"),
    "semicolons": ("t_s;x_m\n" + "".join(f"{0.01 * i:g};0\n" for i in range(6)), 'commas, got semicolons in "t_s;x_m"; write commas for'),
    "decimal commas": (
        "t_s;x_m\n0,01;0,1\n",
        'line 1: expected columns separated by commas, got semicolons in "t_s;x_m"; write points for decimal commas, then commas for semi',
    ),
    "tabs": ("t_s\tx_m\n0.01\t0.1\n", "write commas for tabs"),
    "a negative deviation": (
        f"{HEADER},sigma_x_m,sigma_y_m,sigma_z_m\n" + "".join(f"{0.01 * i:g},0,0,0,1,1,-1\n" for i in range(6)),
        "expected positive standard deviations, got -1",
    ),
    "nothing": ("", "expected a header such as t_s,x_m,y_m,z_m"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_wrong_is_said_with_its_place(tmp_path: Path, name: str) -> None:
    text, said = BAD[name]
    path = written(tmp_path, text)
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        read_trajectory(path, GRAVITY)
    assert str(caught.value).startswith(str(path))


SIDE_CARS = {
    "gravity = [0, 0, -9.81]": "unknown key 'gravity'; did you mean gravity_world?",
    "gravity_world = [0, 0]": "at gravity_world: expected three numbers, m/s2, got [0, 0]",
    "gravity_world = [0, 0, -9810]": "m/s2, got [0, 0, -9810], which is too large (at most 300 m/s2); it looks like mm/s2.",
    "com_tracked_m = [0, 0, 70]": "at com_tracked_m: expected three numbers, m, got [0, 0, 70], which is too large (at most 50 m); it",
    "inertia_ratios = [1, 0.2, 0.3]": "at inertia_ratios: expected three numbers",
    "sigma_x_m = -1": "at sigma_x_m: expected a number, m, got -1",
    "spin_world_rads = [1, 2, 3]": "expected sigma_spin_rads beside spin_world_rads, got none",
    "sigma_spin_rads = [1, 2]": "at sigma_spin_rads: expected a number above 0 or three",
    "world = 3": "at world: expected a name, got 3",
    "gravity_world": "expected TOML",
}


@pytest.mark.parametrize("text", SIDE_CARS)
def test_a_wrong_side_car_is_named(tmp_path: Path, text: str) -> None:
    path = written(tmp_path, f"{HEADER}\n{rows()}")
    side_car = path if text.startswith("spin_world") else path.with_suffix(".toml")
    written(tmp_path, text, "toss.toml")
    with pytest.raises(InputError, match=re.escape(SIDE_CARS[text])) as caught:
        read_trajectory(path, GRAVITY)
    assert str(side_car) in str(caught.value)


def test_gravity_is_never_guessed(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=re.escape("state gravity_world = [0.0, 0.0, -9.81] in toss.toml or trajectory.toml")):
        read_trajectory(written(tmp_path, f"{HEADER}\n{rows()}"), {})


def test_text_that_is_none_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "toss.csv"
    path.write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="expected a trajectory as text"):
        read_trajectory(path, GRAVITY)
