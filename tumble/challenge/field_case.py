"""One case of the field challenge: trajectories or silhouettes of a thing, what is hidden in them, and the mess that is always there.

``campaigns/<name>/observations/`` holds what the solver reads: ``<flight>.csv`` and ``trajectory.toml``, or a folder for
each flight's outlines. ``truth/<name>/case.json`` holds
the case, ``truth/<name>/<flight>.csv`` the true motion.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from tumble.challenge.cases import CASE_FILE, TRUTH, cases_in, write_truth_document

Measured = Literal["poses", "positions_and_spin", "positions", "gyroscope", "silhouettes"]
MEASURED: tuple[Measured, ...] = ("poses", "positions_and_spin", "positions", "gyroscope", "silhouettes")
TRAJECTORIES = MEASURED[:4]
CHANNELS: Mapping[str, tuple[str, ...]] = {
    "poses": ("x", "theta"),
    "positions_and_spin": ("x", "omega"),
    "positions": ("x",),
    "gyroscope": ("gyro",),
    "silhouettes": ("outline", "view"),
}
"""What each kind of campaign measures."""
CALIBRATION = {"length_scale": 1e-3, "focal_length": 1e-3, "principal_point": 1.0}
"""Standard deviations that a calibration has: of lengths and of the focal length, relative, and of the principal point, px."""
Effects = dict[str, dict[str, tuple[float, ...]]]
"""Values of every flight by effect and parameter."""
Vector = tuple[float, ...]


@dataclass(frozen=True)
class FlightPlan:
    """One flight: ``rows`` at ``rate_hz``, and its state at the first row (m/s, rad/s, unit quaternion, world frame)."""

    name: str
    rows: int
    rate_hz: float
    v_world: Vector
    omega_world: Vector
    q_world_body: Vector


@dataclass(frozen=True)
class Noise:
    """Noise of every channel, and of the clock.

    ``sigma``: standard deviation by channel (m, rad, rad/s, px) of the noise without its outliers; ``repeats``: over how many rows or
    frames it is alike; ``outliers``: share of rows or whole outlines that are far off; ``rounded``: whether time stamps are rounded to
    1 ms; ``stated``: whether the files say ``sigma``.
    """

    sigma: dict[str, float]
    repeats: int
    outliers: float
    rounded: bool
    stated: bool


@dataclass(frozen=True)
class Scene:
    """What silhouettes show: a body of a procedural ``family``, seen from the calibrated views of ``drops`` placements in the rig.

    Flights have speeds (m/s) and spins (rad/s) in these ranges. ``R_particle_body``: rows of the true principal axes.
    """

    family: Literal["cut_stone", "jagged"]
    irregularity: float
    drops: int
    speed_ms: Vector
    spin_rads: Vector
    R_particle_body: tuple[Vector, ...] = ()


@dataclass(frozen=True)
class FieldCase:
    """One campaign.

    ``ratios``: inertia ratios of the body. ``scene``: what silhouettes show, ``None`` where trajectories are measured.
    ``hidden``: effects above their limit; ``over_limit``: their sizes over it. ``mess``: small
    effects below it (a push of every flight, lengths off by what a calibration states, a stray effect) and ``mess_over_limit``.
    ``outside``: a force that the catalogue lacks. ``seed`` of the noise.
    """

    name: str
    seed: int
    measured: Measured
    ratios: Vector
    flights: tuple[FlightPlan, ...]
    noise: Noise
    hidden: Effects
    over_limit: dict[str, float]
    mess: Effects
    mess_over_limit: dict[str, float]
    outside: Effects
    scene: Scene | None = None

    def values(self, number: int) -> dict[str, dict[str, float]]:
        """Everything that acts in one flight, values of one parameter added up."""
        found: dict[str, dict[str, float]] = {}
        for effects in (self.hidden, self.mess, self.outside):
            for key, parameters in effects.items():
                there = found.setdefault(key, dict.fromkeys(parameters, 0.0))
                for name, values in parameters.items():
                    there[name] += values[number]
        return found


def is_field(root: Path) -> bool:
    """Whether the challenge in a folder is a field challenge."""
    first = next(iter(sorted((root / TRUTH).glob(f"*/{CASE_FILE}"))), None)
    return first is not None and '"measured"' in first.read_text(encoding="utf-8")


def case_from_dict(values: Mapping[str, Any]) -> FieldCase:
    """A case from plain values, as :func:`dataclasses.asdict` and JSON make them."""
    flights = tuple(FlightPlan(**_fixed(each)) for each in values["flights"])
    parts = {part: _fixed(values[part]) for part in ("hidden", "mess", "outside", "ratios")}
    scene = Scene(**_fixed(values["scene"])) if values.get("scene") else None
    return FieldCase(**{**values, **parts, "flights": flights, "noise": Noise(**values["noise"]), "scene": scene})


def _fixed(value: Any) -> Any:
    """The same with tuples for lists, however deep."""
    if isinstance(value, dict):
        return {key: _fixed(each) for key, each in value.items()}
    return tuple(_fixed(each) for each in value) if isinstance(value, list | tuple) else value


def write_case(case: FieldCase, path: Path) -> None:
    """Write what is hidden."""
    write_truth_document(asdict(case), path)


def read_field_cases(root: Path) -> tuple[FieldCase, ...]:
    """Every case whose truth lies under ``root``.

    Raises
    ------
    InputError
        Where there is none, or a file is not one of ours.
    """
    return cases_in(root, case_from_dict, "tumble challenge make --field")
