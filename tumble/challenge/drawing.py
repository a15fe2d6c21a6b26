"""What is hidden: kinds and sizes of effects, drawn at random.

A size is drawn log-uniformly between multiples of the 95% detection limit along its direction; directions are isotropic in units of the
catalogue's plausible ranges. Dropped frames come in whole numbers, a vibration's frequency is log-uniform within the range that is
searched, and no size passes what nature can be told to do (``LARGEST``).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.recipes.effects import KNOWN
from datasets.recipes.recipe import DropperRecipe, EffectRecipe, MotionRecipe, ParticleRecipe, PlateRecipe, Recipe, RigRecipe
from datasets.recipes.synth_only import SYNTH_ONLY
from datasets.vocabulary.effects import EFFECTS, PICTURED, EffectEntry, Stage
from estimator.effects.choosing import contradiction
from estimator.effects.link import Setting
from estimator.effects.registry import MODELS
from tumble.challenge.cases import Case, Kind
from tumble.challenge.limits import LimitTable, limit_along, outside_limit

Array = NDArray[np.float64]

LARGEST = {
    "frame_rate": 0.3,
    "centre_of_mass": 1e-3,
    "inertia_ratios": 0.5,
    "length_scale": 0.3,
    "view_outline_offset": 10.0,
    "radial_distortion": 4.0,
    "tangential_distortion": 4.0,
    "principal_point": 400.0,
    "focal_length": 0.7,
    "camera_vibration": 20.0,
    "defocus_growth": 300.0,
    "motion_blur_threshold": 0.4,
    "rolling_shutter": 1e-6,
    "trigger_jitter": 1e-4,
    "outline_offset": 4.0,
    "blooming": 4.0,
    "rim_light_leak": 4.0,
}
"""Largest size of any parameter: beyond it a picture has no outline, a body no mass, a lens no inverse. Distortions: times plausible."""
RELATIVE_TO_PLAUSIBLE = ("radial_distortion", "tangential_distortion")
MOST_DROPPED = 3
VIEWS_PER_DROP = 6
DROPPED = (Stage.CLOCK, Stage.BODY, Stage.DYNAMICS, Stage.OPTICS)
"""Stages of the effects that are hidden in drops onto a plate: clock, flight and optics."""
SHORTEST_FLIGHT = 0.75
"""A flight of a drop has at least this share of the frames that are asked for, and at most all of them."""
WALL_M = (0.075, 0.095)
"""Distance of a wall from the optical axis: just outside the picture's corners."""
WALL_REFERENCE_M = 0.05
"""Distance from the wall at which the size of its attraction is stated."""
THRUST_ARM_M = (2e-4, 1e-3)
DRIFT_TIME_S = (0.003, 0.01)
"""Less than a recording lasts: the rest of a slower drift is a parabola in time, which the pictures cannot tell from gravity."""
LARGEST_OUTSIDE = {"wall_attraction": 100.0, "outgassing_thrust": 100.0, "thermal_focus_drift": 0.3}
"""m/s², m/s² and relative change of the focal length."""


@dataclass(frozen=True)
class Shape:
    """What every campaign consists of.

    ``particles``: mesh files, none for bodies of the procedural family; ``drops``: onto a plate, ``frames`` before and after the impact;
    ``views_off_px``: by how much the stated poses of the views are off.
    """

    sequences: int = 4
    frames: int = 80
    views: int = 40
    rendered: bool = False
    particles: tuple[str, ...] = ()
    drops: bool = False
    views_off_px: float = 0.0


@dataclass(frozen=True)
class Counts:
    """How many cases of each kind."""

    singles: int = 350
    controls: int = 120
    pairs: int = 65
    outside: int = 60


@dataclass(frozen=True)
class Sizes:
    """Range of sizes over the 95% detection limit: of single effects, of each of a pair, of what is outside of the catalogue."""

    single: tuple[float, float] = (0.5, 10.0)
    pair: tuple[float, float] = (1.0, 10.0)
    outside: tuple[float, float] = (1.0, 10.0)


DRAWS = 50
"""Drawn at most until one is worth a look."""
RENDERED = (Counts(singles=20, controls=4, pairs=0, outside=0), Sizes(single=(1.0, 10.0)))
"""Counts and sizes where pictures are rendered, which costs more: fewer cases, all of them above the limit."""
DROPS = (Counts(singles=40, controls=20, pairs=0, outside=0), Sizes(single=(2.0, 10.0)))
"""Counts and sizes where particles are dropped onto a plate. The limits of the table are those of flights twice as long."""


@dataclass(frozen=True)
class Plan:
    """Everything that decides a challenge but the seed.

    ``keys``: the effects drawn from; ``plausible``: whether sizes stay within the catalogue's plausible ranges, however small
    these are against the detection limit.
    """

    shape: Shape
    counts: Counts
    sizes: Sizes
    table: LimitTable
    keys: tuple[str, ...] = tuple(PICTURED)
    plausible: bool = False


def draw_cases(plan: Plan, seed: int) -> tuple[Case, ...]:
    """All cases in their shuffled order; effects take turns, so each is hidden equally often.

    Pairs whose sizes start at the limit leave out effects that nature cannot make so large.
    """
    rng = np.random.default_rng([seed, 0])
    seen = [key for key in plan.keys if not plan.counts.pairs or plan.sizes.pair[0] < 1.0 or can_reach_limit(plan.table, key)]
    if plan.counts.pairs and not pairs_of(seen):
        raise InputError(f"pairs: expected two effects that nature can make as large as their limits, got {', '.join(seen) or 'none'}.")
    chosen: list[tuple[Kind, tuple[str, ...]]] = [("control", ())] * plan.counts.controls
    chosen += [("single", keys) for keys in _single(plan, rng)]
    chosen += [("pair", keys) for keys in _in_turn(pairs_of(seen), plan.counts.pairs, rng)]
    chosen += [("outside", keys) for keys in _in_turn([(key,) for key in SYNTH_ONLY], plan.counts.outside, rng)]
    order = rng.permutation(len(chosen))
    width = max(3, len(str(len(chosen))))
    return tuple(
        draw_case(plan, chosen[which], f"c{number + 1:0{width}d}", np.random.default_rng([seed, 1, number]))
        for number, which in enumerate(order)
    )


def worth_a_look(plan: Plan, seed: int) -> Case:
    """The first case drawn from ``seed`` whose effect is of a size that nature gives it and that the data show; the last if none is.

    What nature cannot make as large as it was drawn is drawn smaller, perhaps below its limit.
    """
    seeds = (seed, *(int(each) for each in np.random.SeedSequence(seed).generate_state(DRAWS)))
    for each in seeds:
        (case,) = draw_cases(plan, each)
        if all(is_plausible(effect) for effect in case.recipe.effects) and min(case.ratios.values()) >= 1.0:
            break
    return case


def pairs_of(keys: Sequence[str]) -> list[tuple[str, ...]]:
    """All pairs but those that no data resolve: what the estimator refuses to fit together, and an acceleration with what it contains."""
    return [pair for pair in combinations(keys, 2) if contradiction(pair) is None and not nested(pair)]


def nested(pair: tuple[str, ...]) -> bool:
    """Whether an effect contains another one."""
    return any(other in MODELS[key].contains for key in pair for other in pair)


def _single(plan: Plan, rng: np.random.Generator) -> list[tuple[str, ...]]:
    """The effects hidden alone; where there are fewer cases than effects, one of every stage comes before a second of any."""
    if plan.counts.singles >= len(plan.keys):
        return _in_turn([(key,) for key in plan.keys], plan.counts.singles, rng)
    order = [plan.keys[i] for i in rng.permutation(len(plan.keys))]
    first = set({EFFECTS[key].stage: key for key in reversed(order)}.values())
    chosen: list[tuple[str, ...]] = [(key,) for key in sorted(order, key=lambda key: key not in first)]
    return chosen[: plan.counts.singles]


def _in_turn(options: Sequence[tuple[str, ...]], count: int, rng: np.random.Generator) -> list[tuple[str, ...]]:
    """``count`` of the options, every one as often as any other or once more."""
    if not options:
        return []
    turns = [rng.permutation(len(options)) for _ in range(-(-count // len(options)))]
    return [options[i] for i in np.concatenate([np.zeros(0, dtype=np.int64), *turns])[:count].astype(int)]


def draw_case(plan: Plan, what: tuple[Kind, tuple[str, ...]], name: str, rng: np.random.Generator) -> Case:
    """One case: its particle, its flights' seed, and the sizes of what is hidden."""
    kind, keys = what
    span = {"pair": plan.sizes.pair, "outside": plan.sizes.outside}.get(kind, plan.sizes.single)
    drawn = [draw_effect(plan, key, span, rng) for key in keys]
    shape = plan.shape
    recipe = Recipe(
        name=name,
        seed=int(rng.integers(2**31)),
        sequences=shape.sequences,
        same_particle=True,
        tier="rendered" if shape.rendered else "silhouette",
        particle=_particle(shape, rng),
        motion=MotionRecipe(frames=shape.frames),
        rig=RigRecipe(drops=-(-shape.views // VIEWS_PER_DROP), calibration_px=shape.views_off_px),
        effects=tuple(effect for effect, _ in drawn),
    )
    if shape.drops:
        recipe = replace(recipe, plate=PlateRecipe(), dropper=dropper(shape.sequences, shape.frames))
    return Case(name, kind, recipe, shape.views, {effect.key: ratio for effect, ratio in drawn})


def dropper(sequences: int, frames: int) -> DropperRecipe:
    """Runs of one experiment with up to ``frames`` before and after the first impact."""
    span = (round(SHORTEST_FLIGHT * frames), frames)
    return DropperRecipe(runs=sequences, frames_before=span, frames_after=span)


def _particle(shape: Shape, rng: np.random.Generator) -> ParticleRecipe:
    draw, irregularity = float(rng.random()), float(rng.uniform(0.3, 0.8))
    if shape.particles:
        return ParticleRecipe(files=(shape.particles[int(draw * len(shape.particles))],))
    return ParticleRecipe(family="cut_stone" if draw < 0.5 else "jagged", irregularity=irregularity)


def draw_effect(plan: Plan, key: str, span: tuple[float, float], rng: np.random.Generator) -> tuple[EffectRecipe, float]:
    """An effect with its values, and its size over the detection limit."""
    if key in SYNTH_ONLY:
        limit = outside_limit(plan.table, key)
        ratio = min(_log_uniform(span, rng), LARGEST_OUTSIDE[key] / limit)
        return outside_effect(key, ratio * limit, rng), ratio
    entry = EFFECTS[key]
    amounts, ratio = _dropped(plan, rng) if key == "dropped_frames" else _amounts(plan, entry, span, rng)
    values: dict[str, float | tuple[float, ...]] = {}
    for name, column in zip(entry.sizes, amounts.T, strict=True):
        values[name] = tuple(float(v) for v in column) if entry.scope.own else float(column[0])
    return EffectRecipe(key, {**values, **_searched(plan, entry, rng)}), ratio


def _amounts(plan: Plan, entry: EffectEntry, span: tuple[float, float], rng: np.random.Generator) -> tuple[Array, float]:
    """Sizes (sequences or 1, q) in a random direction, and their length over the limit along it."""
    rows = plan.shape.sequences if entry.scope.own else 1
    directed = direction(entry, rows, rng)
    limit = limit_along(plan.table, entry.key, directed)
    wanted = float(np.exp(rng.uniform(*np.log(span))))
    reach = float(np.min(_largest(entry, plausible=plan.plausible) / np.maximum(np.abs(directed), 1e-300))) / limit
    if wanted > reach:
        low = span[0] if reach > span[0] else reach / 2
        wanted = float(np.exp(rng.uniform(np.log(low), np.log(reach))))
    return directed * limit * wanted, wanted


def can_reach_limit(table: LimitTable, key: str) -> bool:
    """Whether nature can make an effect as large as its limit, along every one of its parameters."""
    entry = EFFECTS[key]
    ranges, rows = _half_ranges(entry), int(table.campaign["sequences"]) if entry.scope.own else 1
    largest = _largest(entry, plausible=False) / ranges
    return all(limit_along(table, key, np.tile(np.eye(len(ranges))[i] * ranges, (rows, 1))) <= largest[i] for i in range(len(ranges)))


def large_effect(key: str, share: float, rng: np.random.Generator) -> EffectRecipe:
    """An effect of all sequences of which the largest parameter is log-uniform from ``share`` of what nature is given on."""
    entry = EFFECTS[key]
    directed = direction(entry, 1, rng)[0]
    reach = float(np.min(_largest(entry, plausible=False) / np.maximum(np.abs(directed), 1e-300)))
    values = directed * reach * _log_uniform((share, 1.0), rng)
    return EffectRecipe(key, dict(zip(entry.sizes, (float(v) for v in values), strict=True)))


def direction(entry: EffectEntry, rows: int, rng: np.random.Generator) -> Array:
    """Isotropic in units of the plausible ranges; positive where only positive values make sense."""
    low = np.array([p.plausible[0] for p in entry.parameters if p.name in entry.sizes])
    direction = rng.normal(size=(rows, len(low)))
    direction = np.where(low >= 0, np.abs(direction), direction)
    return np.asarray(direction / np.linalg.norm(direction) * _half_ranges(entry))


def _largest(entry: EffectEntry, *, plausible: bool) -> Array:
    """Largest size (q,) of each parameter."""
    ranges, largest = _half_ranges(entry), LARGEST.get(entry.key, np.inf)
    possible = largest * ranges if entry.key in RELATIVE_TO_PLAUSIBLE else np.full(len(ranges), largest)
    return np.minimum(possible, ranges) if plausible else possible


def is_plausible(effect: EffectRecipe) -> bool:
    """Whether all values of an effect of the catalogue lie within its plausible ranges."""
    for parameter in EFFECTS[effect.key].parameters:
        values = np.atleast_1d(np.array(effect.values.get(parameter.name, 0.0), dtype=np.float64))
        if np.any(values < parameter.plausible[0]) or np.any(values > parameter.plausible[1]):
            return False
    return True


def _half_ranges(entry: EffectEntry) -> Array:
    return np.array([p.plausible[1] for p in entry.parameters if p.name in entry.sizes])


def _dropped(plan: Plan, rng: np.random.Generator) -> tuple[Array, float]:
    """Whole numbers of frames, in at least one sequence; the ratio is what these numbers come to."""
    rows = plan.shape.sequences
    hit = rng.random(rows) < 0.5
    hit[rng.integers(rows)] = True
    count = np.where(hit, rng.integers(1, MOST_DROPPED + 1, size=rows), 0)[:, None].astype(np.float64)
    return count, 1.0 / limit_along(plan.table, "dropped_frames", count)


def _searched(plan: Plan, entry: EffectEntry, rng: np.random.Generator) -> dict[str, float | tuple[float, ...]]:
    """Values of the parameters that are searched for and are no sizes."""
    if entry.key == "dropped_frames":
        frames = plan.shape.frames
        return {"after_frame": tuple(float(f) for f in rng.integers(frames // 10, frames - frames // 10, size=plan.shape.sequences))}
    if entry.key == "camera_vibration":
        tried = MODELS[entry.key].starts(_setting(plan.shape))[:, -1]
        return {"frequency": float(np.exp(rng.uniform(np.log(tried.min()), np.log(tried.max()))))}
    return {}


def _setting(shape: Shape) -> Setting:
    times = np.arange(shape.frames) / MotionRecipe().frame_rate_hz
    return Setting(times, 0.0, np.zeros(3), np.ones(3))


def _log_uniform(span: tuple[float, float], rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(*np.log(span))))


def outside_effect(key: str, size: float, rng: np.random.Generator) -> EffectRecipe:
    """An effect that is outside of the catalogue, of a size in m/s² (wall, thrust) or relative (drift); the rest is drawn."""
    return EffectRecipe(key, {"wall_attraction": _wall, "outgassing_thrust": _thrust, "thermal_focus_drift": _drift}[key](size, rng))


def _wall(size: float, rng: np.random.Generator) -> dict[str, float | tuple[float, ...]]:
    """A wall beside the picture, at any angle about the optical axis."""
    angle = float(rng.uniform(0.0, 2.0 * np.pi))
    strength, position = size * WALL_REFERENCE_M**2, -float(rng.uniform(*WALL_M))
    return {"strength": strength, "normal_x": np.cos(angle).item(), "normal_y": np.sin(angle).item(), "normal_z": 0.0, "position": position}


def _thrust(size: float, rng: np.random.Generator) -> dict[str, float | tuple[float, ...]]:
    thrust, arm = rng.normal(size=3), rng.normal(size=3)
    thrust *= size / np.linalg.norm(thrust)
    arm *= float(rng.uniform(*THRUST_ARM_M)) / np.linalg.norm(arm)
    return {name: float(value) for name, value in zip(KNOWN["outgassing_thrust"].names, (*thrust, *arm), strict=True)}


def _drift(size: float, rng: np.random.Generator) -> dict[str, float | tuple[float, ...]]:
    sign = 1.0 if rng.random() < 0.5 else -1.0
    return {"relative": sign * size, "time_constant": _log_uniform(DRIFT_TIME_S, rng)}
