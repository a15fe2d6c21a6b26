"""One case of the field challenge: trajectories of a thing, what is hidden in them, and the mess that is always there.

``campaigns/<name>/observations/`` holds what the solver reads: ``<flight>.csv`` and ``trajectory.toml``. ``truth/<name>/case.json`` holds
the case, ``truth/<name>/<flight>.csv`` the true motion.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.json_documents import plain
from tumble.challenge.cases import CASE_FILE, TRUTH

Measured = Literal["poses", "positions_and_spin", "positions", "gyroscope"]
MEASURED: tuple[Measured, ...] = ("poses", "positions_and_spin", "positions", "gyroscope")
CHANNELS: Mapping[str, tuple[str, ...]] = {
    "poses": ("x", "theta"),
    "positions_and_spin": ("x", "omega"),
    "positions": ("x",),
    "gyroscope": ("gyro",),
}
"""What each kind of campaign measures."""
CALIBRATION = 1e-3
"""Standard deviation that a calibration states of its lengths, relative."""
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

    ``sigma``: standard deviation by channel (m, rad, rad/s) of the noise without its outliers; ``repeats``: over how many rows it is alike;
    ``outliers``: share of rows that are far off; ``rounded``: whether time stamps are rounded to 1 ms; ``stated``: whether the files say
    ``sigma``.
    """

    sigma: dict[str, float]
    repeats: int
    outliers: float
    rounded: bool
    stated: bool


@dataclass(frozen=True)
class FieldCase:
    """One campaign.

    ``ratios``: inertia ratios of the body. ``hidden``: effects above their limit; ``over_limit``: their sizes over it. ``mess``: small
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
    flights = tuple(FlightPlan(**{k: _fixed(v) for k, v in each.items()}) for each in values["flights"])
    effects = {
        part: {key: {name: tuple(v) for name, v in parameters.items()} for key, parameters in values[part].items()}
        for part in ("hidden", "mess", "outside")
    }
    return FieldCase(**{**values, **effects, "flights": flights, "noise": Noise(**values["noise"]), "ratios": tuple(values["ratios"])})


def _fixed(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


def write_case(case: FieldCase, path: Path) -> None:
    """Write what is hidden."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with written_whole(path) as temporary:
        temporary.write_text(json.dumps(plain(asdict(case)), indent=1) + "\n", encoding="utf-8")


def read_field_cases(root: Path) -> tuple[FieldCase, ...]:
    """Every case whose truth lies under ``root``.

    Raises
    ------
    InputError
        Where there is none, or a file is not one of ours.
    """
    files = sorted((root / TRUTH).glob(f"*/{CASE_FILE}"))
    if not files:
        raise InputError(f"{root}: expected the folder of a challenge with {TRUTH}/<campaign>/{CASE_FILE} in it, found none.")
    return tuple(_read(path) for path in files)


def _read(path: Path) -> FieldCase:
    try:
        return case_from_dict(json.loads(path.read_text(encoding="utf-8")))
    except (ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: expected a case written by `tumble challenge make --field` ({type(error).__name__}: {error}).") from None
