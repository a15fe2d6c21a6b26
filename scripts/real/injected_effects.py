"""Real tosses with an effect of known size put in, as campaigns for ``tumble explain``: to see what is found beside a real mess.

``python -m scripts.real.injected_effects --data FOLDER --out OUT``, then ``tumble explain OUT/linear_drag`` and the like; FOLDER holds
``tosses/`` as its publishers gave it, which is not part of Tumble. ``OUT/nothing`` are the tosses as they are.

A force displaces positions by its second integral along the measured path, ``x + ∫∫ a dt²`` with velocities of a parabola through all rows:
to first order in the force, half a second at most.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import cumulative_trapezoid
from scipy.spatial.transform import Rotation

from scripts.real.real_tosses import GRAVITY_MS2, RATE_HZ, free_flights

Array = NDArray[np.float64]
Rows = tuple[Array, Array, Array]
"""Times (n,) s, positions (n, 3) m and quaternions (n, 4), scalar last."""


def forced(force: Callable[[Array], Array]) -> Callable[[Rows], Rows]:
    """With an acceleration (n, 3) m/s² put in that is a ``force`` of the velocity (n, 3) m/s."""

    def put_in(rows: Rows) -> Rows:
        t, x, q = rows
        fits = [np.polynomial.Polynomial.fit(t, each, 2).deriv() for each in x.T]
        pushed = force(np.column_stack([each(t) for each in fits]))
        for _ in range(2):
            pushed = cumulative_trapezoid(pushed, t, axis=0, initial=0.0)
        return t, x + pushed, q

    return put_in


def slow_clock(rows: Rows) -> Rows:
    """Times 2 % longer."""
    return 1.02 * rows[0], *rows[1:]


def short_lengths(rows: Rows) -> Rows:
    """Lengths 5 % shorter."""
    return rows[0], 0.95 * rows[1], rows[2]


def shifted_point(rows: Rows) -> Rows:
    """Another point of the cube, 8 mm along its first axis."""
    t, x, q = rows
    return t, x + Rotation.from_quat(q).apply([0.008, 0.0, 0.0]), q


def tilted_world(rows: Rows) -> Rows:
    """The tracker's world turned by 2 degrees about y: gravity is not where it is stated."""
    t, x, q = rows
    turn = Rotation.from_euler("y", 2.0, degrees=True)
    return t, turn.apply(x), (turn * Rotation.from_quat(q)).as_quat()


PUT_IN: dict[str, Callable[[Rows], Rows]] = {
    "nothing": lambda rows: rows,
    "frame_rate": slow_clock,
    "length_scale": short_lengths,
    "centre_of_mass": shifted_point,
    "gravity_tilted": tilted_world,
    "linear_drag": forced(lambda v: -0.3 * v),
    "quadratic_drag": forced(lambda v: -0.25 * np.linalg.norm(v, axis=1, keepdims=True) * v),
    "wind": forced(lambda v: -0.2 * (v - np.array([2.0, 0.0, 0.0]))),
    "acceleration": forced(lambda v: np.tile([0.4, 0.0, 0.0], (len(v), 1))),
}
"""0.3 1/s; 0.25 1/m; 0.2 1/s in a wind of 2 m/s along x; 0.4 m/s² along x."""


def write(flights: list[Rows], folder: Path) -> None:
    """One TUM file for each flight, and what holds for all of them beside them."""
    folder.mkdir(parents=True, exist_ok=True)
    for number, rows in enumerate(flights):
        np.savetxt(folder / f"toss_{number:02d}.tum", np.column_stack(rows), header="timestamp tx ty tz qx qy qz qw")
    (folder / "trajectory.toml").write_text(f"gravity_world = [0.0, 0.0, -{GRAVITY_MS2}]\ninertia_ratios = [1.0, 1.0, 1.0]\n")


def main() -> int:
    """Write all campaigns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="the folder that holds tosses/")
    parser.add_argument("--out", type=Path, required=True, help="where the campaigns are written")
    given = parser.parse_args()
    flights = [(np.arange(len(x)) / RATE_HZ, x, q) for x, q in free_flights(given.data / "tosses" / "cube_tosses.npz")]
    for name, put_in in PUT_IN.items():
        write([put_in(rows) for rows in flights], given.out / name)
        print(f"{given.out / name}: {len(flights)} trajectories")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
