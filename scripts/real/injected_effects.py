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

from scripts.real.real_tosses import RATE_HZ, free_flights, write_flights

Array = NDArray[np.float64]
SEED = 7
"""Of the rows that are off."""
Flight = tuple[Array, Array]
"""Positions (n, 3) m and quaternions (n, 4), scalar last, of rows at ``RATE_HZ``."""


def forced(force: Callable[[Array], Array]) -> Callable[[Flight], Flight]:
    """With an acceleration (n, 3) m/s² put in that is a ``force`` of the velocity (n, 3) m/s."""

    def put_in(flight: Flight) -> Flight:
        x, q = flight
        t = np.arange(len(x)) / RATE_HZ
        fits = [np.polynomial.Polynomial.fit(t, each, 2).deriv() for each in x.T]
        pushed = force(np.column_stack([each(t) for each in fits]))
        for _ in range(2):
            pushed = cumulative_trapezoid(pushed, t, axis=0, initial=0.0)
        return x + pushed, q

    return put_in


def short_lengths(flight: Flight) -> Flight:
    """Lengths 5 % shorter."""
    return 0.95 * flight[0], flight[1]


def shifted_point(flight: Flight) -> Flight:
    """Another point of the cube, 8 mm along its first axis."""
    x, q = flight
    return x + Rotation.from_quat(q).apply([0.008, 0.0, 0.0]), q


def tilted_world(flight: Flight) -> Flight:
    """The tracker's world turned by 2 degrees about y: gravity is not where it is stated."""
    turn = Rotation.from_euler("y", 2.0, degrees=True)
    return turn.apply(flight[0]), (turn * Rotation.from_quat(flight[1])).as_quat()


def outliers(share: float, off_m: float, rows: int = 1, *, turned_deg: float = 0.0) -> Callable[[Flight], Flight]:
    """With a ``share`` of the rows off by ``off_m`` in a direction drawn for each, and turned about one; ``rows`` of them in a run."""
    rng = np.random.default_rng(SEED)

    def put_in(flight: Flight) -> Flight:
        x, q = flight
        bad = np.convolve(rng.uniform(size=len(x)) < share / rows, np.ones(rows))[: len(x)] > 0.0
        directions = rng.normal(size=(2, len(x), 3))
        off, about = directions / np.linalg.norm(directions, axis=2, keepdims=True) * bad[:, None]
        return x + off_m * off, (Rotation.from_rotvec(np.radians(turned_deg) * about) * Rotation.from_quat(q)).as_quat()

    return put_in


def as_it_is(flight: Flight) -> Flight:
    """Nothing put in."""
    return flight


PUT_IN: dict[str, Callable[[Flight], Flight]] = {
    "nothing": as_it_is,
    "frame_rate": as_it_is,
    "length_scale": short_lengths,
    "centre_of_mass": shifted_point,
    "gravity_tilted": tilted_world,
    "linear_drag": forced(lambda v: -0.3 * v),
    "quadratic_drag": forced(lambda v: -0.25 * np.linalg.norm(v, axis=1, keepdims=True) * v),
    "wind": forced(lambda v: -0.2 * (v - np.array([2.0, 0.0, 0.0]))),
    "acceleration": forced(lambda v: np.tile([0.4, 0.0, 0.0], (len(v), 1))),
    "outliers_1_20mm": outliers(0.01, 0.020),
    "outliers_3_5mm": outliers(0.03, 0.005),
    "outliers_3_20mm": outliers(0.03, 0.020),
    "outliers_8_20mm": outliers(0.08, 0.020),
    "outliers_3_100mm": outliers(0.03, 0.100),
    "outliers_8_100mm_runs": outliers(0.08, 0.100, rows=3),
    "outliers_3_turned": outliers(0.03, 0.0, turned_deg=20.0),
    "outliers_3_flipped": outliers(0.03, 0.0, turned_deg=180.0),
    "outliers_8_turned_runs": outliers(0.08, 0.020, rows=2, turned_deg=20.0),
}
"""0.3 1/s; 0.25 1/m; 0.2 1/s in a wind of 2 m/s along x; 0.4 m/s² along x; shares of rows that are off."""
TOLD_RATE_HZ = {"frame_rate": RATE_HZ / 1.02}
"""Times 2 % longer."""


def main() -> int:
    """Write all campaigns."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="the folder that holds tosses/")
    parser.add_argument("--out", type=Path, required=True, help="where the campaigns are written")
    given = parser.parse_args()
    flights = free_flights(given.data / "tosses" / "cube_tosses.npz")
    for name, put_in in PUT_IN.items():
        write_flights([put_in(each) for each in flights], given.out / name, TOLD_RATE_HZ.get(name, RATE_HZ))
        print(f"{given.out / name}: {len(flights)} trajectories")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
