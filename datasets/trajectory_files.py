"""Trajectories from files: TUM (``timestamp tx ty tz qx qy qz qw``) and CSV with a header whose names carry units.

Nothing here knows of truth or recipes: an estimator's application may read it. See ``docs/format.md``.
"""

import csv
import difflib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.names import file_name
from datasets.plausibility import FARTHEST_M
from datasets.plausible_pace import FASTEST_MS, LONGEST_INTERVAL_S
from datasets.plausible_turns import Spin, check_turns
from datasets.schema_errors import shown
from datasets.trajectory import Surroundings, Trajectory
from datasets.trajectory_surroundings import read_surroundings

Array = NDArray[np.float64]
TUM_COLUMNS = ("t_s", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw")
TUM_SUFFIXES, CSV_SUFFIX = (".tum", ".txt"), ".csv"
TIMES = {"t_s": 1.0, "t_ms": 1e-3, "t_us": 1e-6}
LENGTHS = {"m": 1.0, "mm": 1e-3, "um": 1e-6}
SPINS = {"rads": 1.0, "degs": np.pi / 180.0}
ANGLES = {"rad": 1.0, "deg": np.pi / 180.0}
OF_PICTURES = ("observation.json", "*/observation.json", "dataset.json")
"""What a folder of observations holds; tables that lie beside them are no trajectories."""
SEPARATORS = {";": "semicolons", "\t": "tabs"}
"""Other separators of columns than commas, as programs write them."""
LEAST_ROWS = 5
"""Rows of a file, and values of a position that is measured at all."""
OFF_GRID = 0.01
"""Of a step, by how much rounded readings may lie beside multiples of it, as they were written with few digits."""
NOTHING_MEASURED = (
    "expected positions x_m, y_m, z_m (or _mm, _um), orientations qx, qy, qz, qw, or a gyroscope's gyro_x_rads, gyro_y_rads, gyro_z_rads "
    "(or _degs), got none."
)
NORM_TOLERANCE = 1e-2
KNOWN_COLUMNS = "t_s, x_m, ..., qx, ..., wx_rads, gyro_x_rads, ..., sigma_x_m, ..."


def is_trajectory(path: Path) -> bool:
    """Whether a file is a trajectory by its suffix."""
    return path.is_file() and path.suffix.lower() in (*TUM_SUFFIXES, CSV_SUFFIX)


def trajectories_in(source: Path) -> tuple[Path, ...]:
    """Trajectory files of a folder, in the order of their names, or the file itself; none where there is none, or pictures are."""
    if is_trajectory(source):
        return (source,)
    if any(any(source.glob(pattern)) for pattern in OF_PICTURES):
        return ()
    return tuple(sorted(path for path in source.glob("*") if is_trajectory(path))) if source.is_dir() else ()


def read_trajectory(path: Path, given: Mapping[str, Any]) -> Trajectory:
    """Read one trajectory; ``given`` surroundings go before those of side-cars.

    Raises
    ------
    InputError
        Naming the file, the line, what was expected and what came.
    """
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a trajectory as text, got a file that cannot be read: {error}.") from error
    columns = _csv(path, lines) if path.suffix.lower() == CSV_SUFFIX else _tum(path, lines)
    return _trajectory(path, columns, given)


Columns = dict[str, Array]


def _tum(path: Path, lines: Sequence[str]) -> Columns:
    rows = [(i + 1, line.replace(",", " ").split()) for i, line in enumerate(lines) if line.strip() and not line.lstrip().startswith("#")]
    return _table(path, TUM_COLUMNS, rows)


def _csv(path: Path, lines: Sequence[str]) -> Columns:
    reader = csv.reader(lines)
    try:
        rows = [(reader.line_num, row) for row in reader if row and not row[0].lstrip().startswith("#")]
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: expected comma-separated values, got a line that is none ({error}).") from None
    if not rows:
        raise InputError(f"{path}: expected a header such as t_s,x_m,y_m,z_m and rows of numbers, got an empty file.")
    (number, header), *rest = rows
    _check_separators(path, number, header, rest)
    names = [name.strip() for name in header]
    known = _known_names()
    for name in names:
        if name not in known:
            raise InputError(f"{path}: line {number}: unknown column {shown(name)}; {_offered(name, known)}")
        if names.count(name) > 1:
            raise InputError(f"{path}: line {number}: expected every column once, got {shown(name)} twice.")
    return _table(path, names, rest)


def _check_separators(path: Path, number: int, header: Sequence[str], rest: Sequence[tuple[int, Sequence[str]]]) -> None:
    """Columns are separated by commas, though spreadsheets of many countries write semicolons and decimal commas."""
    for separator, word in SEPARATORS.items():
        if any(separator in name for name in header):
            cells = [cell for _, row in rest[:1] for cell in ",".join(row).split(separator)]
            first = "points for decimal commas, then " if any("," in cell for cell in cells) else ""
            came = shown(",".join(header))
            raise InputError(
                f"{path}: line {number}: expected columns separated by commas, got {word} in {came}; write {first}commas for {word}."
            )


def _offered(name: str, known: Sequence[str]) -> str:
    """What a column that nobody knows may be: the nearest name, or, where it lacks a unit, the nearest quantity in all of them."""
    near = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
    if not near:
        word = name.lower().split("(")[0].strip().replace(" ", "_")
        quantities = [each.rpartition("_")[0] or each for each in known]
        of = difflib.get_close_matches("t" if word.startswith("time") else word, quantities, n=1, cutoff=0.75)
        near = [each for each, quantity in zip(known, quantities, strict=True) if quantity in of]
    near = near or difflib.get_close_matches(name, known, n=1, cutoff=0.4)
    return f"did you mean {' or '.join(near)}?" if near else f"known: {KNOWN_COLUMNS}"


def _known_names() -> list[str]:
    names = [*TIMES, "qx", "qy", "qz", "qw"]
    for prefix in ("", "sigma_"):
        names += [f"{prefix}{axis}_{unit}" for axis in "xyz" for unit in LENGTHS]
        names += [f"{prefix}{sensor}{axis}_{unit}" for sensor in ("w", "gyro_") for axis in "xyz" for unit in SPINS]
    return names + [f"sigma_theta_{unit}" for unit in ANGLES]


def _table(path: Path, names: Sequence[str], rows: Sequence[tuple[int, Sequence[str]]]) -> Columns:
    """Columns of numbers by name, with ``line`` beside them."""
    values = np.empty((len(rows), len(names)))
    for k, (number, row) in enumerate(rows):
        if len(row) != len(names):
            raise InputError(f"{path}: line {number}: expected {len(names)} values ({', '.join(names)}), got {len(row)}.")
        for j, text in enumerate(row):
            values[k, j] = _number(text, f"{path}: line {number}: {names[j]}")
    if len(rows) < LEAST_ROWS:
        raise InputError(f"{path}: expected at least {LEAST_ROWS} rows, got {len(rows)}: too few for a motion.")
    return {**dict(zip(names, values.T, strict=True)), "line": np.array([number for number, _ in rows], dtype=np.float64)}


def _number(text: str, where: str) -> float:
    """A finite number, or NaN for an empty cell."""
    if not text.strip():
        return float("nan")
    try:
        value = float(text) if text.isascii() and "_" not in text else None  # Python also reads 1_0 and other scripts' digits
    except ValueError:
        value = None
    if value is None:
        raise InputError(f"{where}: expected a number, got {shown(text.strip())}.")
    if not np.isfinite(value):
        raise InputError(f"{where}: expected a finite number, got {shown(text.strip())}; leave cells empty that were not measured.")
    return value


@np.errstate(all="ignore")  # what overflows is refused by its size
def _trajectory(path: Path, columns: Columns, given: Mapping[str, Any]) -> Trajectory:
    lines = columns["line"].astype(np.int64)
    times = _times(path, columns, lines)
    x, q = _vector(path, columns, "", LENGTHS), _quaternions(path, columns, lines)
    omega, gyro = _vector(path, columns, "w", SPINS), _vector(path, columns, "gyro_", SPINS)
    _check_limits(path, columns, lines)
    if x is None and q is None and omega is None and gyro is None:
        raise InputError(f"{path}: {NOTHING_MEASURED}")
    surroundings = read_surroundings(path, given, falls=x is not None)
    if x is None:
        x = np.full((len(times), 3), np.nan)
    _check_lengths(path, x, times, next(name for name in TIMES if name in columns))
    spins = (Spin(_of_axes(columns, prefix), each, prefix != "w") for prefix, each in (("w", omega), ("gyro_", gyro)) if each is not None)
    notes = check_turns(path, times, q, tuple(spins))
    theta = next(
        (np.tile(columns[f"sigma_theta_{u}"][:, None] * scale, 3) for u, scale in ANGLES.items() if f"sigma_theta_{u}" in columns), None
    )
    sigma_x = _sigma(path, _vector(path, columns, "sigma_", LENGTHS), surroundings.sigma_x_m, x)
    sigma_omega = _sigma(path, _vector(path, columns, "sigma_w", SPINS), surroundings.sigma_omega_rads, omega)
    sigma_gyro = _sigma(path, _vector(path, columns, "sigma_gyro_", SPINS), surroundings.sigma_gyro_rads, gyro)
    for name, values, sigma in (("positions along {}", x, sigma_x), ("w{}", omega, sigma_omega), ("gyro_{}", gyro, sigma_gyro)):
        _check_seen(path, name, values, stated=sigma is not None and name[0] != "p")
    if surroundings.spin_world is not None:
        omega, sigma_omega = _measured_once(path, surroundings, omega, len(times))
    return Trajectory(
        name=file_name(path.stem),
        times_s=times,
        x_world=x,
        q_world_tracked=q,
        omega_world=omega,
        sigma_x=sigma_x,
        sigma_theta=None if q is None else _sigma(path, theta, surroundings.sigma_theta_rad, q[:, :3]),
        sigma_omega=sigma_omega,
        surroundings=surroundings,
        gyro=gyro,
        sigma_gyro=sigma_gyro,
        notes=notes,
    )


def _check_seen(path: Path, name: str, values: Array | None, *, stated: bool) -> None:
    """Values along an axis are none, or so many that noise can be told; of ``stated`` noise one is enough."""
    for axis, column in zip("xyz", () if values is None else values.T, strict=False):
        count = int(np.isfinite(column).sum())
        if 0 < count < (1 if stated else LEAST_ROWS):
            raise InputError(f"{path}: {name.format(axis)}: expected at least {LEAST_ROWS} values or none, got {count}.")


def _check_limits(path: Path, columns: Columns, lines: NDArray[np.int64]) -> None:
    """A gyroscope that reads its largest value row after row is at its limit: the body turns at least as fast."""
    for name in (name for name in columns if name.startswith("gyro_")):
        run, everywhere = _at_limit(columns[name])
        if len(run):
            raise InputError(
                f"{path}: lines {lines[run[0]]} to {lines[run[-1]]}: {name}: expected readings that scatter, got "
                f"{columns[name][run[0]]:g} in {len(run)} rows, its largest: is that the sensor's limit? Leave its cells empty in all "
                f"{everywhere} rows where it is reached."
            )


def _at_limit(read: Array) -> tuple[NDArray[np.int64], int]:
    """Rows of the longest run of ``LEAST_ROWS`` and more that reads the largest value, and how many rows read it; none as a rule.

    Where readings come and go by one step of theirs, they are rounded, not limited.
    """
    size = np.abs(read)
    largest = np.max(size, where=np.isfinite(size), initial=0.0)
    at = np.flatnonzero((size == largest) & (largest > 0.0))
    run = max(np.split(at, np.flatnonzero((np.diff(at) > 1) | (np.diff(read[at]) != 0.0)) + 1), key=len)
    if len(run) < LEAST_ROWS:
        return run[:0], len(at)
    values = np.unique(read[np.isfinite(read)])
    steps = (values - values[0]) / np.min(np.diff(values), initial=np.inf)
    beside = [row for row in (run[0] - 1, run[-1] + 1) if 0 <= row < len(read) and np.isfinite(read[row])]
    one = any(np.ptp(steps[np.searchsorted(values, read[[row, run[0]]])]) < 1.0 + OFF_GRID for row in beside)
    rounded = one and np.allclose(steps, np.rint(steps), rtol=0.0, atol=OFF_GRID)
    return (run[:0] if rounded else run), len(at)


def _measured_once(path: Path, surroundings: Surroundings, omega: Array | None, rows: int) -> tuple[Array, Array]:
    """An angular velocity that was measured once in a flight, as that of its middle row, and its standard deviations."""
    if omega is not None:
        raise InputError(f"{path}: expected either columns wx_rads, wy_rads, wz_rads or spin_world_rads, got both.")
    values, sigma = np.full((rows, 3), np.nan), np.full((rows, 3), np.nan)
    values[rows // 2], sigma[rows // 2] = surroundings.spin_world, surroundings.sigma_spin
    return values, sigma


def _times(path: Path, columns: Columns, lines: NDArray[np.int64]) -> Array:
    names = [name for name in TIMES if name in columns]
    if len(names) != 1:
        raise InputError(f"{path}: expected one column of times (t_s, t_ms or t_us), got {len(names)}.")
    empty = np.flatnonzero(np.isnan(columns[names[0]]))
    if len(empty):
        raise InputError(f"{path}: line {lines[empty[0]]}: {names[0]}: expected a number, got an empty cell.")
    times = (columns[names[0]] - columns[names[0]][0]) * TIMES[names[0]]
    steps = np.diff(times)
    if not (steps > 0).all():
        k = int(np.flatnonzero(~(steps > 0))[0])
        raise InputError(
            f"{path}: line {lines[k + 1]}: expected times that increase, got {columns[names[0]][k + 1]:g} after {columns[names[0]][k]:g}."
        )
    if not np.median(steps) <= LONGEST_INTERVAL_S:
        raise InputError(
            f"{path}: expected seconds between rows below {LONGEST_INTERVAL_S:g}, got {np.median(steps):g}; is it t_ms or t_us?"
        )
    return np.asarray(times)


def _vector(path: Path, columns: Columns, prefix: str, units: Mapping[str, float]) -> Array | None:
    """The columns ``<prefix>x_<unit>`` and so on, in SI; ``None`` where there is none of them. An axis without one was not measured."""
    present = {axis: [u for u in units if f"{prefix}{axis}_{u}" in columns] for axis in "xyz"}
    if not any(present.values()):
        return None
    twice = [axis for axis, found in present.items() if len(found) > 1]
    if twice:
        came = " and ".join(f"{prefix}{twice[0]}_{u}" for u in present[twice[0]])
        raise InputError(f"{path}: expected one column for each axis, got {came}.")
    empty = np.full(len(columns["line"]), np.nan)
    return np.column_stack([columns[f"{prefix}{axis}_{found[0]}"] * units[found[0]] if found else empty for axis, found in present.items()])


def _of_axes(columns: Columns, prefix: str) -> tuple[str, ...]:
    """The names of the columns of an angular velocity."""
    return tuple(name for axis in "xyz" for unit in SPINS if (name := f"{prefix}{axis}_{unit}") in columns)


def _quaternions(path: Path, columns: Columns, lines: NDArray[np.int64]) -> Array | None:
    names = ("qx", "qy", "qz", "qw")
    missing = [name for name in names if name not in columns]
    if len(missing) == 4:
        return None
    if missing:
        raise InputError(f"{path}: expected all of {', '.join(names)} or none, got no {missing[0]}.")
    q = np.column_stack([columns[name] for name in names])
    norm = np.linalg.norm(q, axis=1)
    half = np.flatnonzero(np.isnan(norm) & ~np.isnan(q).all(axis=1))
    if len(half):
        raise InputError(f"{path}: line {lines[half[0]]}: expected all of {', '.join(names)} or none, got some of them empty.")
    odd = ~(np.abs(norm - 1.0) <= NORM_TOLERANCE) & ~np.isnan(q).all(axis=1)
    if odd.any():
        k = int(np.argmax(odd))
        raise InputError(f"{path}: line {lines[k]}: expected a unit quaternion (qx, qy, qz, qw), got one of length {norm[k]:.4g}.")
    return np.asarray(q / norm[:, None])


def _check_lengths(path: Path, x: Array, times: Array, clock: str) -> None:
    """Millimetres taken for metres show in how far and how fast things are, seconds that are called ``t_ms`` in how fast alone."""
    if not np.isfinite(x).any():
        return
    far = max(float(np.ptp(column[np.isfinite(column)])) for column in x.T if np.isfinite(column).any())
    steps = np.linalg.norm(np.where(np.isnan(np.diff(x, axis=0)), 0.0, np.diff(x, axis=0)), axis=1)
    fast = float(np.median(steps / np.diff(times)))
    if far <= FARTHEST_M and fast <= FASTEST_MS:
        return
    slower = [name for name, unit in TIMES.items() if unit > TIMES[clock] and fast * TIMES[clock] / unit <= FASTEST_MS]
    if far <= FARTHEST_M and slower:
        raise InputError(
            f"{path}: {clock}: expected times of a flight below {FASTEST_MS:g} m/s, got {far:.4g} m, which is plausible, at {fast:.4g} "
            f"m/s, which is not; is it {' or '.join(slower)}?"
        )
    raise InputError(
        f"{path}: expected metres (a flight below {FARTHEST_M:g} m and {FASTEST_MS:g} m/s), got {far:.4g} m at {fast:.4g} m/s; "
        f"are they millimetres? Then call the columns x_mm, y_mm, z_mm.{' Or are the times not in seconds?' if far <= FARTHEST_M else ''}"
    )


def _sigma(path: Path, columns: Array | None, stated: float | None, values: Array | None) -> Array | None:
    """Standard deviations of ``values``, from columns or alike for all; ``None`` where they are not known or nothing was measured."""
    if values is None:
        return None
    if columns is not None:
        seen = columns[np.isfinite(values)]
        if np.isnan(seen).any():
            raise InputError(f"{path}: expected a standard deviation beside every measured value, got an empty cell or no column.")
        if (seen <= 0).any():
            raise InputError(f"{path}: expected positive standard deviations, got {seen.min():g}.")
        return columns
    return None if stated is None else np.full(values.shape, stated)
