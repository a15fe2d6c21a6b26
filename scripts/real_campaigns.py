"""Four real campaigns as folders of trajectories that every verb reads.

``python -m scripts.real_campaigns tosses|table_tennis|spinning_disc|thrown_disc --data FOLDER --out OUT``; FOLDER holds ``tosses/``,
``table_tennis/`` and ``gyro/`` as their publishers gave them, which are not part of Tumble.

- ``tosses``: 60 tosses of an acrylic cube, poses at 148 Hz (Pfrommer, Halm and Posa 2020), the rows before its first contact.
- ``table_tennis``: 37 shots of a table tennis ball, positions and a spin of each, measured once (Gossard et al. 2023); time stamps are
  rounded to 1 ms.
- ``spinning_disc``: a flying disc with a gyroscope, spun on a table and left to slow down (liborw/instrumented_frisbee).
- ``thrown_disc``: the same disc thrown forehand and backhand, the rows of its flight; it spins faster than the gyroscope reads.
"""

import argparse
import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from scripts.real.real_tosses import free_flights, write_flights

Array = NDArray[np.float64]
SPIN_SIZE, SPIN_DIRECTION_DEG = 0.01, 2.4
"""Standard deviations of a spin's size, as a share, and of its direction about each axis across it (Gossard et al. 2023)."""
SATURATION_DEGS = 1990.0
"""Where the disc's sensor is at its limit; it stands at 1998 degrees per second."""
SPUN, SLOWED = 0.95, 0.5
"""The stretch of the disc: from the last row that spins with this share of the fastest row on, until the first that has this share left."""
HELD_G = 2.5
"""A disc whose accelerometer reads more is held or strikes something; in flight it reads what the air does and the spin, 1.1 to 2.2."""
DISC = (0.5, 0.5, 1.0)
"""Inertia ratios of a thin disc."""
AT_REST_DEGS = 5.0
"""A disc whose gyroscope reads less lies still: the mean reading is then the gyroscope's bias."""


def tosses(data: Path, out: Path) -> int:
    """Write the tosses; how many there are."""
    flights = free_flights(data / "tosses" / "cube_tosses.npz")
    write_flights(flights, out)
    return len(flights)


def table_tennis(data: Path, out: Path) -> int:
    """Write the shots, each with its spin beside it; how many there are."""
    spins = {row[0]: np.array(row[1:], dtype=np.float64) for row in _rows(data / "table_tennis" / "spins.csv")}
    shots: dict[str, list[list[str]]] = {}
    for shot, *row in _rows(data / "table_tennis" / "flights.csv"):
        shots.setdefault(shot, []).append(row)
    for shot, rows in shots.items():
        name = f"shot_{int(shot):03d}"
        _write(out / f"{name}.csv", ["t_s", "x_m", "y_m", "z_m"], rows)
        sigma = spin_sigma(spins[shot])
        (out / f"{name}.toml").write_text(f"spin_world_rads = {spins[shot].tolist()}\nsigma_spin_rads = {sigma.round(4).tolist()}\n")
    (out / "trajectory.toml").write_text('gravity_world = [0.0, 0.0, -9.81]\nparticle = "ball of 40 mm and 2.7 g"\n')
    return len(shots)


def spin_sigma(spin: Array) -> Array:
    """Standard deviation (3,) rad/s of each coordinate of a spin (3,) rad/s that is uncertain in size and direction."""
    size = float(np.linalg.norm(spin))
    along = (spin / size) ** 2
    return np.asarray(size * np.sqrt(SPIN_SIZE**2 * along + np.radians(SPIN_DIRECTION_DEG) ** 2 * (1.0 - along)))


def spinning_disc(data: Path, out: Path) -> int:
    """Write the angular velocity while the disc spun and slowed down; one file.

    On its edge the disc rolls: the table's torque turns the spin in the body all the time, so a free body along whose axes it is read would
    be no model of it. In axes that stand still, the spin keeps its direction and falls. Both say the same, since the readings themselves
    tell how the body has turned since the first row.
    """
    rows = np.loadtxt(data / "gyro" / "frisbee_roztocenej-na-stole.csv", delimiter=",")
    first, last = slowing(rows[:, 4:7])
    still = np.linalg.norm(rows[:, 4:7], axis=1) < AT_REST_DEGS
    omega = standing_axes(rows[first:last, 0], np.radians(rows[first:last, 4:7] - rows[still, 4:7].mean(axis=0)))
    lines = [[repr(float(value)) for value in row] for row in np.column_stack([rows[first:last, 0], omega])]
    _write(out / "disc.csv", ["t_s", "wx_rads", "wy_rads", "wz_rads"], lines)
    (out / "trajectory.toml").write_text('particle = "flying disc"\nworld = "axes of the disc in the first row"\n')
    return 1


def thrown_disc(data: Path, out: Path) -> int:
    """Write what the gyroscope read in the flight of each throw, cells at its limit empty; how many throws."""
    for throw in ("forehand", "backhand"):
        rows = np.loadtxt(data / "gyro" / f"frisbee_{throw}.csv", delimiter=",")
        flight = rows[slice(*flying(rows[:, 1:4], rows[:, 4:7]))]
        read = [[repr(float(row[0])), *("" if abs(g) >= SATURATION_DEGS else repr(float(g)) for g in row[4:7])] for row in flight]
        _write(out / f"{throw}.csv", ["t_s", "gyro_x_degs", "gyro_y_degs", "gyro_z_degs"], read)
    (out / "trajectory.toml").write_text(f'inertia_ratios = {list(DISC)}\nparticle = "flying disc"\n')
    return 2


def flying(acceleration_g: Array, gyro_degs: Array) -> tuple[int, int]:
    """First and last row (the latter not among them) of the longest run in which the disc spins beyond the limit, held by nobody."""
    free = (np.abs(gyro_degs) >= SATURATION_DEGS).any(axis=1) & (np.linalg.norm(acceleration_g, axis=1) < HELD_G)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]]).astype(np.int64))).reshape(-1, 2)
    first, last = edges[int(np.argmax(edges[:, 1] - edges[:, 0]))].tolist()
    return first, last


def standing_axes(times_s: Array, gyro: Array) -> Array:
    """Angular velocities (n, 3) rad/s along the axes that the body has in the first row, from readings (n, 3) along its own."""
    turns = Rotation.from_rotvec(0.5 * (gyro[1:] + gyro[:-1]) * np.diff(times_s)[:, None])
    R = Rotation.identity()
    found = [gyro[0]]
    for turn, read in zip(turns, gyro[1:], strict=True):
        R = R * turn
        found.append(R.apply(read))
    return np.array(found)


def slowing(gyro_degs: Array) -> tuple[int, int]:
    """First and last row (the latter not among them) of the longest run without saturation in which a body that was spun slows down."""
    spin = np.linalg.norm(gyro_degs, axis=1)
    saturated = (np.abs(gyro_degs) >= SATURATION_DEGS).any(axis=1)
    first = int(np.flatnonzero(spin >= SPUN * spin.max())[-1])
    ends = [*np.flatnonzero(spin[first:] < SLOWED * spin.max())[:1], *np.flatnonzero(saturated[first:])[:1], len(spin) - first]
    return first, first + int(min(ends))


def _rows(path: Path) -> list[list[str]]:
    """Rows of a table without its header."""
    return list(csv.reader(path.read_text().splitlines()))[1:]


def _write(path: Path, header: list[str], rows: list[list[str]]) -> None:
    path.write_text("\n".join(",".join(row) for row in [header, *rows]) + "\n")


CAMPAIGNS: dict[str, Callable[[Path, Path], int]] = {
    "tosses": tosses,
    "table_tennis": table_tennis,
    "spinning_disc": spinning_disc,
    "thrown_disc": thrown_disc,
}


def main() -> int:
    """Write one campaign."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("campaign", choices=CAMPAIGNS)
    parser.add_argument("--data", type=Path, required=True, help="the folder that holds tosses/, table_tennis/ and gyro/")
    parser.add_argument("--out", type=Path, required=True, help="where the trajectories are written")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    count = CAMPAIGNS[arguments.campaign](arguments.data, arguments.out)
    print(f"{arguments.out}: {count} trajectories")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
