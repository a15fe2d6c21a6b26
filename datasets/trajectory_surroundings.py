"""What a trajectory's numbers do not say: gravity, the body, the noise; from a side-car in TOML.

``trajectory.toml`` in a trajectory's folder holds for all files of the folder, ``<name>.toml`` beside ``<name>.csv`` for one; what the
latter says goes before. Gravity has no default: where down lies in somebody else's world frame nobody can guess.
"""

import difflib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.plausibility import FARTHEST_M, STRONGEST_GRAVITY_MS2
from datasets.toml_text import read_toml
from datasets.trajectory import Surroundings
from datasets.vocabulary.body import Body

Array = NDArray[np.float64]
FOLDER_FILE = "trajectory.toml"
KEYS = {
    "gravity_world": "three numbers, m/s2",
    "inertia_ratios": "three numbers, principal moments along the tracked frame's axes over the largest",
    "com_tracked_m": "three numbers, m",
    "sigma_x_m": "a number, m",
    "sigma_theta_rad": "a number, rad",
    "sigma_omega_rads": "a number, rad/s",
    "sigma_gyro_rads": "a number, rad/s",
    "sigma_length_scale": "a number, relative",
    "spin_world_rads": "three numbers, rad/s",
    "sigma_spin_rads": "a number above 0 or three, rad/s",
    "world": "a name",
    "tracked": "a name",
    "particle": "a name",
}
VECTORS = ("gravity_world", "inertia_ratios", "com_tracked_m", "spin_world_rads")
LARGEST = {"gravity_world": (STRONGEST_GRAVITY_MS2, "m/s2", "mm/s2"), "com_tracked_m": (FARTHEST_M, "m", "mm")}
"""Length of a vector at most, its unit, and the unit that is mistaken for it."""
NAMES = ("world", "tracked", "particle")
ISOTROPIC = (1.0, 1.0, 1.0)


def read_surroundings(path: Path, given: Mapping[str, Any], *, falls: bool = True) -> Surroundings:
    """The surroundings of the trajectory at ``path``; ``given`` goes before every side-car.

    ``falls``: whether there are positions, which need gravity to be stated; a gyroscope alone does not feel it.

    Raises
    ------
    InputError
        Naming the file and the key; where gravity is needed and nobody states it.
    """
    known: dict[str, Any] = {}
    for file in (path.parent / FOLDER_FILE, path.with_suffix(".toml")):
        if file.is_file():
            known.update(_checked(read_toml(file), str(file)))
    known.update(_checked(given, "the command line"))
    if "gravity_world" not in known and falls:
        raise InputError(
            f"{path}: expected gravity in the trajectory's frame, got none: state gravity_world = [0.0, 0.0, -9.81] in "
            f"{path.with_suffix('.toml').name} or {FOLDER_FILE} beside it, or type --gravity 0,0,-9.81."
        )
    if "spin_world_rads" in known and "sigma_spin_rads" not in known:
        raise InputError(f"{path}: expected sigma_spin_rads beside spin_world_rads, got none: one value does not show its own noise.")
    return _surroundings(known)


def _checked(entries: Mapping[str, Any], where: str) -> dict[str, Any]:
    for key, value in entries.items():
        if key not in KEYS:
            near = difflib.get_close_matches(key, KEYS, n=1, cutoff=0.5)
            raise InputError(f"{where}: unknown key {key!r}; " + (f"did you mean {near[0]}?" if near else f"known: {', '.join(KEYS)}."))
        if not _fits(key, value):
            raise InputError(f"{where}: at {key}: expected {KEYS[key]}, got {value!r}{_too_large(key, value)}.")
    return dict(entries)


def _too_large(key: str, value: Any) -> str:
    """That a vector is too large for its unit, where that is what is wrong with it."""
    if key not in LARGEST or not isinstance(value, list | tuple) or len(value) != 3 or not _are_numbers(value):
        return ""
    largest, unit, smaller = LARGEST[key]
    return f", which is too large (at most {largest:g} {unit}); it looks like {smaller}"


def _fits(key: str, value: Any) -> bool:
    if key in NAMES:
        return isinstance(value, str)
    numbers = value if key in VECTORS or (key == "sigma_spin_rads" and isinstance(value, list | tuple) and len(value) == 3) else [value]
    if not isinstance(numbers, list | tuple) or (key in VECTORS and len(numbers) != 3):
        return False
    if not _are_numbers(numbers):
        return False
    match key:
        case "gravity_world" | "com_tracked_m":
            return math.hypot(*numbers) <= LARGEST[key][0]
        case "spin_world_rads":
            return True
        case "inertia_ratios":
            low, middle, high = sorted(numbers)
            return low > 0 and high <= (low + middle) * (1 + 1e-9)
    return bool(min(numbers) > 0)


def _are_numbers(values: Sequence[Any]) -> bool:
    return all(isinstance(n, int | float) and not isinstance(n, bool) and np.isfinite(n) for n in values)


def _surroundings(known: Mapping[str, Any]) -> Surroundings:
    ratios = np.array(known.get("inertia_ratios", ISOTROPIC), dtype=np.float64)
    order = np.argsort(ratios, kind="stable")
    axes = np.eye(3)[:, order]
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    body = Body(np.array(known.get("com_tracked_m", (0.0, 0.0, 0.0)), dtype=np.float64), axes, ratios[order] / ratios.max())
    spin, sigma_spin = known.get("spin_world_rads"), known.get("sigma_spin_rads")
    return Surroundings(
        gravity_world=np.array(known.get("gravity_world", (0.0, 0.0, 0.0)), dtype=np.float64),
        body=body,
        sigma_x_m=known.get("sigma_x_m"),
        sigma_theta_rad=known.get("sigma_theta_rad"),
        sigma_omega_rads=known.get("sigma_omega_rads"),
        sigma_gyro_rads=known.get("sigma_gyro_rads"),
        sigma_length_scale=known.get("sigma_length_scale"),
        spin_world=None if spin is None else np.array(spin, dtype=np.float64),
        sigma_spin=None if sigma_spin is None else np.broadcast_to(np.asarray(sigma_spin, dtype=np.float64), (3,)).copy(),
        world=known.get("world", "world"),
        tracked=known.get("tracked", "tracked"),
        particle=known.get("particle", ""),
    )
