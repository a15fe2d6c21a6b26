"""Files of a field campaign: trajectories as CSV with their side-car for the solver, true motion as CSV for the score."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from datasets.atomic_files import written_whole
from datasets.trajectory import Trajectory
from datasets.trajectory_surroundings import FOLDER_FILE
from tumble.challenge.field_case import CALIBRATION, FieldCase
from tumble.challenge.field_flights import Flown

Array = NDArray[np.float64]
QUATERNION = ("qx", "qy", "qz", "qw")
TRUE_COLUMNS = ("t_s", *(f"{name}_{axis}" for name in ("v", "omega", "omega_tracked") for axis in "xyz"))


def write_trajectory(trajectory: Trajectory, folder: Path) -> None:
    """Write one trajectory as ``<name>.csv``."""
    columns: dict[str, Array] = {"t_s": trajectory.times_s}
    for names, values in (
        ([f"{a}_m" for a in "xyz"], trajectory.x_world),
        (QUATERNION, trajectory.q_world_tracked),
        ([f"w{a}_rads" for a in "xyz"], trajectory.omega_world),
        ([f"gyro_{a}_rads" for a in "xyz"], trajectory.gyro),
    ):
        if values is not None and np.isfinite(values).any():
            columns.update(zip(names, values.T, strict=True))
    _write(folder / f"{trajectory.name}.csv", columns)


def write_surroundings(case: FieldCase, folder: Path) -> None:
    """Write ``trajectory.toml``: gravity where something falls, inertia ratios, and the noise where it is stated."""
    named = {"x": "sigma_x_m", "theta": "sigma_theta_rad", "omega": "sigma_omega_rads", "gyro": "sigma_gyro_rads"}
    lines = [] if case.measured == "gyroscope" else ["gravity_world = [0.0, 0.0, -9.81]"]
    lines += [f"inertia_ratios = {list(case.ratios)}", 'particle = "thing"']
    if case.noise.stated:
        lines += [f"{named[channel]} = {sigma!r}" for channel, sigma in case.noise.sigma.items()]
    if "length_scale" in case.mess:
        lines.append(f"sigma_length_scale = {CALIBRATION['length_scale']!r}")
    with written_whole(folder / FOLDER_FILE) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_true_motion(flight: Flown, path: Path) -> None:
    """Write velocities of the centre of mass and angular velocities, world frame and tracked frame, by the recorder's clock."""
    motion = flight.motion
    tracked = Rotation.from_quat(motion.q_world_body).inv().apply(motion.omega_world)
    rows = np.column_stack([flight.nominal_s, motion.v_world, motion.omega_world, tracked])
    _write(path, dict(zip(TRUE_COLUMNS, rows.T, strict=True)))


def true_state(path: Path, time_s: float, *, tracked: bool) -> Array:
    """V (m/s) and omega (rad/s), (6,), at a time by the recorder's clock; omega in the world frame or in the ``tracked`` one."""
    rows = np.loadtxt(path, delimiter=",", skiprows=1)
    at = CubicSpline(rows[:, 0], rows[:, 1:])(time_s)
    return np.concatenate([at[:3], at[6:9] if tracked else at[3:6]])


def _write(path: Path, columns: dict[str, Array]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    lines = [",".join(columns), *(",".join(f"{value:.9g}" for value in row) for row in zip(*columns.values(), strict=True))]
    with written_whole(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
