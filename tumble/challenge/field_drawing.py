"""Draws field cases: flights, noise, what is hidden above its limit, and the mess below it.

Zero to three effects are hidden at once, each log-uniform between one and ten of its detection limits in this very campaign
(:mod:`tumble.challenge.field_limits`) and within what the catalogue calls plausible. In one campaign of ten a force that the catalogue
lacks is hidden instead. The mess is in every campaign: pushes, lengths off, a stray effect at a tenth of its limit, noise with heavy
tails that is alike over rows, rows far off, and time stamps rounded to 1 ms where rows are at least 4 ms apart.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from datasets.errors import InputError
from estimator.effects.choosing import contradiction
from tumble.challenge.drawing import LARGEST, RELATIVE_TO_PLAUSIBLE, direction, nested
from tumble.challenge.field_case import CALIBRATION, CHANNELS, MEASURED, Effects, FieldCase, FlightPlan, Measured, Noise
from tumble.challenge.field_flights import flown
from tumble.challenge.field_limits import Known, known, limit_along
from tumble.challenge.field_outside import draw_outside
from tumble.challenge.field_picture_drawing import draw_silhouettes
from tumble.challenge.field_silhouettes import as_flown
from tumble.challenge.field_spans import ROUNDED_FROM_S, log_uniform

Array = NDArray[np.float64]
HIDDEN = (
    "frame_rate",
    "centre_of_mass",
    "inertia_ratios",
    "products_of_inertia",
    "length_scale",
    "gravity",
    "uniform_acceleration",
    "linear_drag",
    "quadratic_drag",
    "magnus_lift",
    "spin_damping",
    "nutation_damping",
    "gyroscope_bias",
    "gyroscope_scale",
)
"""Effects that are drawn. Not: jitter, which rounded stamps have anyway; missing frames, which come in whole numbers; a wind and a
saturating lift, which act beside other effects or in their place."""
HIDDEN_IN_PICTURES = (
    *HIDDEN,
    "focal_length",
    "principal_point",
    "radial_distortion",
    "tangential_distortion",
    "rolling_shutter",
    "outline_offset",
    "view_outline_offset",
    "motion_blur_threshold",
    "blooming",
    "rim_light_leak",
)
"""Of silhouettes. Not: a vibration, which is searched for, and a growing defocus, which shows by its square."""
MOST_HIDDEN = 3
OVER_LIMIT = (1.0, 10.0)
OUTSIDE_SHARE = 0.1
PUSH, STRAY = 0.3, 0.1
"""Sizes of pushes and of the stray effect over their limits; no part of the mess passes ``PUSH``."""
STATED_SHARE = 0.2
"""Campaigns whose files state their noise."""
ATTEMPTS = 10
RATES_HZ = {"poses": (60.0, 250.0), "positions_and_spin": (100.0, 500.0), "positions": (60.0, 500.0), "gyroscope": (50.0, 500.0)}
SPEEDS_MS = {"poses": (1.0, 4.0), "positions_and_spin": (3.0, 15.0), "positions": (1.0, 10.0), "gyroscope": (0.0, 0.0)}
SPINS_RADS = {"poses": (2.0, 15.0), "positions_and_spin": (20.0, 150.0), "positions": (0.0, 0.0), "gyroscope": (3.0, 25.0)}
NOISES = {"x": (2e-4, 2e-3), "theta": (2e-3, 1e-2), "omega": (0.3, 3.0), "gyro": (5e-3, 5e-2)}
"""m, rad, rad/s, rad/s."""


@dataclass(frozen=True)
class FieldPlan:
    """How many campaigns, the ranges of their flights and rows (or frames), and what they measure."""

    campaigns: int
    flights: tuple[int, int] = (1, 40)
    rows: tuple[int, int] = (8, 120)
    measured: tuple[Measured, ...] = MEASURED


def names_of(plan: FieldPlan) -> tuple[str, ...]:
    """Neutral names of all campaigns."""
    width = max(3, len(str(plan.campaigns)))
    return tuple(f"f{number + 1:0{width}d}" for number in range(plan.campaigns))


def draw_field_case(plan: FieldPlan, seed: int, number: int) -> FieldCase:
    """The campaign of a number.

    Raises
    ------
    InputError
        Where no flights could be flown with what was drawn.
    """
    failure: Exception | None = None
    outside = bool(np.random.default_rng([seed, number]).random() < OUTSIDE_SHARE)
    for attempt in range(ATTEMPTS):
        try:
            return _that_flies(_drawn(plan, names_of(plan)[number], np.random.default_rng([seed, number, attempt]), outside=outside))
        except (InputError, ArithmeticError, ValueError) as error:
            failure = error
    raise InputError(f"campaign {number + 1}: expected flights that can be flown, got none in {ATTEMPTS} attempts: {failure}") from failure


def _drawn(plan: FieldPlan, name: str, rng: np.random.Generator, *, outside: bool) -> FieldCase:
    case = draw_flights(plan, name, rng)
    of = known(case)
    if outside:
        force, over = draw_outside(case, of, OVER_LIMIT, rng)
        case = replace(case, outside=force, over_limit=over)
    else:
        hidden, over = draw_hidden(of, int(rng.integers(MOST_HIDDEN + 1)), rng)
        case = replace(case, hidden=hidden, over_limit=over)
    mess, over = draw_mess(of, tuple(case.hidden), rng)
    case = replace(case, mess=mess, mess_over_limit=over)
    return case if case.scene is None else as_flown(case)


def _that_flies(case: FieldCase) -> FieldCase:
    """The case, all of whose flights have been tried: what is hidden may be more than a body or an integrator can have."""
    if case.scene is None:
        for number in range(len(case.flights)):
            flown(case, number)
    return case


def draw_flights(plan: FieldPlan, name: str, rng: np.random.Generator) -> FieldCase:
    """A campaign with its noise, nothing hidden."""
    kind: Measured = plan.measured[int(rng.integers(len(plan.measured)))]
    if kind == "silhouettes":
        return draw_silhouettes(name, plan.flights, plan.rows, rng)
    rate = log_uniform(RATES_HZ[kind], rng)
    count = round(log_uniform(plan.flights, rng))
    flights = tuple(_flight(kind, f"{name}-{i + 1}", round(log_uniform(plan.rows, rng)), rate, rng) for i in range(count))
    sigma = {channel: log_uniform(NOISES[channel], rng) for channel in CHANNELS[kind]}
    noise = Noise(
        sigma,
        repeats=int(rng.integers(2, 4)),
        outliers=float(rng.uniform(0.01, 0.02)),
        rounded=1.0 / rate >= ROUNDED_FROM_S,
        stated=bool(rng.random() < STATED_SHARE),
    )
    return FieldCase(name, int(rng.integers(2**31)), kind, _ratios(kind, rng), flights, noise, {}, {}, {}, {}, {})


def _flight(kind: Measured, name: str, rows: int, rate: float, rng: np.random.Generator) -> FlightPlan:
    v, omega = (rng.uniform(*span) * _unit(rng) for span in (SPEEDS_MS[kind], SPINS_RADS[kind]))
    q = Rotation.random(rng=rng).as_quat() if "theta" in CHANNELS[kind] or kind == "gyroscope" else np.array([0.0, 0.0, 0.0, 1.0])
    return FlightPlan(name, rows, rate, *(tuple(float(value) for value in vector) for vector in (v, omega, q)))


def _ratios(kind: Measured, rng: np.random.Generator) -> tuple[float, ...]:
    """Of a stone or a brick where it tumbles, of a ball elsewhere."""
    if kind.startswith("positions"):
        return (1.0, 1.0, 1.0)
    least = float(rng.uniform(0.4, 0.9))
    return (round(least, 3), round(float(rng.uniform(max(least, 1.1 - least), 1.0)), 3), 1.0)


def draw_hidden(of: Known, count: int, rng: np.random.Generator) -> tuple[Effects, dict[str, float]]:
    """Up to ``count`` effects that these measurements can show beside one another, and their sizes over their limits."""
    offered = offered_in(of)
    tried = [offered[i] for i in rng.permutation(len(offered)) if offered[i] in of.of.keys]
    chosen: dict[str, Array] = {}
    for key in tried:
        if len(chosen) == count:
            break
        together = {**chosen, key: drawn_direction(of, key, rng)}
        if contradiction(tuple(together)) is None and not nested(tuple(together)) and _shown(of, together):
            chosen = together
    effects: Effects = {}
    over: dict[str, float] = {}
    for key, sizes in chosen.items():
        limit = limit_along(of, key, sizes, tuple(chosen))
        over[key] = log_uniform((OVER_LIMIT[0], min(OVER_LIMIT[1], reach(of, key, sizes) / limit)), rng)
        effects[key] = values_of(of, key, sizes * limit * over[key])
    return effects, over


def offered_in(of: Known) -> tuple[str, ...]:
    """The effects that may be hidden in such measurements, if they can be seen there."""
    return HIDDEN_IN_PICTURES if of.pictures else HIDDEN


def _shown(of: Known, together: dict[str, Array]) -> bool:
    """Whether all effects can be as large as their limits beside one another."""
    return all(limit_along(of, key, sizes, tuple(together)) < reach(of, key, sizes) for key, sizes in together.items())


def draw_mess(of: Known, hidden: tuple[str, ...], rng: np.random.Generator) -> tuple[Effects, dict[str, float]]:
    """Pushes of every flight, lengths off by what the calibration states, and one stray effect: all below their limits."""
    effects: Effects = {}
    over: dict[str, float] = {}
    shown = [key for key in offered_in(of) if key in of.of.keys and key not in hidden]

    def add(key: str, sizes: Array, wanted: float, largest: float = float("inf")) -> None:
        limit = limit_along(of, key, sizes)
        size = min(wanted * limit, largest, wanted * reach(of, key, sizes))
        effects[key], over[key] = values_of(of, key, sizes * size), size / limit

    if "uniform_acceleration" in shown:
        add("uniform_acceleration", rng.normal(size=(len(of.campaign.sequences), 3)), PUSH)
    for key in [key for key in CALIBRATION if key in shown]:
        off = rng.normal(size=(1, len(of.entry(key).sizes)))
        size = float(np.linalg.norm(off))
        add(key, off / size, PUSH, CALIBRATION[key] * size)
    strays = [key for key in shown if key not in effects]
    if strays:
        key = strays[int(rng.integers(len(strays)))]
        add(key, drawn_direction(of, key, rng), STRAY)
    return effects, over


def drawn_direction(of: Known, key: str, rng: np.random.Generator) -> Array:
    """A direction (flights or 1, q) of an effect, isotropic in its plausible ranges."""
    entry = of.entry(key)
    return direction(entry, len(of.campaign.sequences) if entry.scope.own else 1, rng)


def reach(of: Known, key: str, sizes: Array) -> float:
    """What ``sizes`` may be multiplied with before one is no longer plausible."""
    entry = of.entry(key)
    largest = np.array([p.plausible[1] for p in entry.parameters if p.name in entry.sizes])
    if of.pictures:
        largest = np.minimum(largest, LARGEST.get(key, np.inf)) if key not in RELATIVE_TO_PLAUSIBLE else largest
    return float(np.min(largest / np.maximum(np.abs(sizes), 1e-300)))


def values_of(of: Known, key: str, sizes: Array) -> dict[str, tuple[float, ...]]:
    """Values of every flight by parameter."""
    every = np.broadcast_to(sizes, (len(of.campaign.sequences), sizes.shape[1]))
    return {name: tuple(float(v) for v in column) for name, column in zip(of.entry(key).sizes, every.T, strict=True)}


def _unit(rng: np.random.Generator) -> Array:
    vector = rng.normal(size=3)
    return np.asarray(vector / np.linalg.norm(vector))
