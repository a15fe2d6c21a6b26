"""Angular velocities that contradict orientations: mistakes that are known are refused with their cure, others noted, a mess is neither."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from datasets.plausible_turns import Spin, check_turns
from datasets.trajectory import Trajectory
from datasets.trajectory_files import read_trajectory

Array = NDArray[np.float64]
RATE_HZ, ROWS = 148.0, 30
MOMENTS = np.array([1.0, 0.8, 0.5])
WORLD, BODY = "wx_{0},wy_{0},wz_{0}", "gyro_x_{0},gyro_y_{0},gyro_z_{0}"


def tumbling(rads: float, seed: int = 3) -> tuple[Array, Rotation, Array]:
    """Times (n,) s, attitude and angular velocity (n, 3) rad/s, world frame, of a free body with three moments."""
    rng, times = np.random.default_rng(seed), np.arange(ROWS) / RATE_HZ

    def rate(_: float, y: Array) -> Array:
        q, w = y[:4], y[4:]
        turn = 0.5 * np.concatenate([q[3] * w + np.cross(q[:3], w), [-q[:3] @ w]])
        return np.concatenate([turn, np.cross(MOMENTS * w, w) / MOMENTS])

    spin = rng.normal(size=3)
    start = np.concatenate([Rotation.random(rng=rng).as_quat(), rads * spin / np.linalg.norm(spin)])
    y = solve_ivp(rate, (0.0, times[-1]), start, method="DOP853", t_eval=times, rtol=1e-9, atol=1e-9).y.T
    R = Rotation.from_quat(y[:, :4])
    return times, R, R.apply(y[:, 4:])


def read(folder: Path, times: Array, q: Array, columns: str, omega: Array) -> Trajectory:
    table = np.column_stack([times, q, omega])
    rows = [",".join("" if np.isnan(value) else repr(float(value)) for value in row) for row in table]
    path = folder / "toss.csv"
    path.write_text("\n".join([f"t_s,qx,qy,qz,qw,{columns}", *rows]) + "\n", encoding="utf-8")
    return read_trajectory(path, {})


@pytest.mark.parametrize("rads", [0.5, 4.0, 40.0, 150.0, 400.0])
@pytest.mark.parametrize(("columns", "of_body"), [(WORLD, False), (BODY, True)])
def test_what_is_right_is_read_without_a_word(tmp_path: Path, rads: float, columns: str, *, of_body: bool) -> None:
    """Of a body that tumbles, up to some turns per row, of which orientations tell a fraction alone."""
    times, R, omega = tumbling(rads)
    omega = R.inv().apply(omega) if of_body else omega
    assert read(tmp_path, times, R.as_quat(), columns.format("rads"), omega).notes == ()
    assert read(tmp_path, times, R.as_quat(), columns.format("degs"), np.degrees(omega)).notes == ()


MISTAKES = {
    "degrees": (WORLD, "Taken as degrees per second they are off by", "call the columns wx_degs, wy_degs, wz_degs."),
    "degrees of a gyroscope": (
        BODY,
        "Taken as degrees per second they are off by",
        "call the columns gyro_x_degs, gyro_y_degs, gyro_z_degs.",
    ),
    "radians": (WORLD, "Taken as radians per second they are off by", "call the columns wx_rads, wy_rads, wz_rads."),
    "degrees of degrees": (WORLD, "Taken as degrees per second they are off by", "divide them by 57.3."),
    "body axes": (WORLD, "Taken along the tracked frame's axes they are off by", "call the columns gyro_x_rads, gyro_y_rads, gyro_z_rads"),
    "world axes": (BODY, "Taken along the world's axes they are off by", "call the columns wx_rads, wy_rads, wz_rads"),
    "inverted": (WORLD, "With the orientations inverted they are off by", "give -qx, -qy, -qz, qw"),
    "scalar first": (WORLD, "With the scalar of the quaternions first they are off by", "the order is qx, qy, qz, qw"),
}


def mistaken(name: str, R: Rotation, omega: Array) -> tuple[Array, str, Array]:
    """Orientations, unit and angular velocity as somebody wrote them who made a mistake."""
    q, along_body = R.as_quat(), R.inv().apply(omega)
    return {
        "degrees": (q, "rads", np.degrees(omega)),
        "degrees of a gyroscope": (q, "rads", np.degrees(along_body)),
        "radians": (q, "degs", omega),
        "degrees of degrees": (q, "degs", np.degrees(np.degrees(omega))),
        "body axes": (q, "rads", along_body),
        "world axes": (q, "rads", omega),
        "inverted": (R.inv().as_quat(), "rads", omega),
        "scalar first": (q[:, [3, 0, 1, 2]], "rads", omega),
    }[name]


@pytest.mark.parametrize("messy", [False, True], ids=["clean", "messy"])
@pytest.mark.parametrize("name", MISTAKES)
def test_a_known_mistake_is_refused_with_its_cure(tmp_path: Path, name: str, *, messy: bool) -> None:
    columns, found, cure = MISTAKES[name]
    times, R, omega = tumbling(4.0)
    if messy:
        times, R, omega = spoiled(times, R, omega)
    q, unit, omega = mistaken(name, R, omega)
    with pytest.raises(InputError, match=re.escape(found)) as caught:
        read(tmp_path, times, q, columns.format(unit), omega)
    said = str(caught.value)
    assert said.startswith(f"{tmp_path / 'toss.csv'}: {columns.format(unit).replace(',', ', ')}: expected the angular velocity")
    assert cure in said
    assert "rad/s in the median, got" in said


def spoiled(times: Array, R: Rotation, omega: Array, noise: float = 2e-3) -> tuple[Array, Rotation, Array]:
    """The same with noise, rows that are missing and some that are far off."""
    rng = np.random.default_rng(5)
    R = Rotation.from_rotvec(rng.normal(0.0, noise, omega.shape)) * R
    omega = omega + rng.normal(0.0, 0.05 * np.linalg.norm(omega, axis=1).mean(), omega.shape)
    omega[7] *= -30.0
    far = R.as_quat()
    far[19] = Rotation.random(rng=rng).as_quat()
    kept = np.delete(np.arange(len(times)), [3, 11, 12, 24])
    return times[kept], Rotation.from_quat(far[kept]), omega[kept]


@pytest.mark.parametrize("rads", [0.05, 0.5, 4.0, 40.0, 400.0])
@pytest.mark.parametrize("noise", [1e-6, 2e-3, 3e-2])
def test_a_mess_is_no_contradiction(rads: float, noise: float) -> None:
    """Noise that hides turns, missing rows, rows that are far off, spins faster than half a turn per row."""
    times, R, omega = spoiled(*tumbling(rads), noise)
    spins = [Spin(("wx_rads",), omega, False), Spin(("gyro_x_rads",), R.inv().apply(omega), True)]
    assert check_turns(Path("toss.csv"), times, R.as_quat(), spins) == ()


def test_orientations_that_are_stored_twice_are_no_contradiction() -> None:
    times, R, omega = tumbling(4.0)
    q = np.repeat(R.as_quat()[::2], 2, axis=0)
    assert check_turns(Path("toss.csv"), times, q, [Spin(("wx_rads",), omega, False)]) == ()


def test_what_nothing_mends_is_noted_and_read(tmp_path: Path) -> None:
    times, R, omega = tumbling(4.0)
    found = read(tmp_path, times, R.as_quat(), WORLD.format("rads"), omega[:, [1, 2, 0]])
    (note,) = found.notes
    assert note.startswith(f"{tmp_path / 'toss.csv'}: wx_rads, wy_rads, wz_rads: expected the angular velocity, along the world's axes")
    assert "are axes swapped" in note
    assert found.omega_world is not None


def test_of_few_rows_nothing_is_said(tmp_path: Path) -> None:
    times, R, omega = tumbling(4.0)
    q, wrong = R.as_quat(), np.degrees(omega)
    assert read(tmp_path, times[:6], q[:6], WORLD.format("rads"), wrong[:6]).notes == ()
    q[6:] = np.nan
    assert read(tmp_path, times, q, WORLD.format("rads"), wrong).notes == ()
    assert read(tmp_path, times, R.as_quat(), "wx_rads", wrong[:, :1]).notes == ()


@pytest.mark.parametrize("of_body", [False, True])
@pytest.mark.parametrize("size", [0.0, 1e-320, 1e9, 1e300, 1.7e308])
def test_numbers_of_any_size_are_no_fault(size: float, *, of_body: bool) -> None:
    times, R, _ = tumbling(4.0)
    changing = np.where(np.arange(ROWS)[:, None] % 2, size, -size) * np.ones(3)
    with np.errstate(all="ignore"):
        for omega in (np.full((ROWS, 3), size), changing):
            assert len(check_turns(Path("toss.csv"), times, R.as_quat(), [Spin(("wx_rads",), omega, of_body)])) <= 1
