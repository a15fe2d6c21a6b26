"""Rendering only the crop around the particle beside rendering the full frame: time, and whether the pictures agree within noise.

``python -m scripts.benchmarks.bench_crop [--json]`` or ``tumble bench --only crop``; about two minutes. The default camera and recipe, but
a lens so long that the bounding box of the particle covers 1/16 of the picture; and, the stricter reading of "covers", its silhouette. Both
ways take the same rays per pixel of the same sub-frames and end with the picture's light, static background included, before the sensor,
which costs both the same. They run in turn in one process; times are processor time of one thread, medians, after one run of each that
compiles. Every picture has seeds of its own.

The test of agreement. With ``d`` the difference of the mean pictures of both ways, pixel by pixel, and ``v`` its variance, taken from
the repetitions: ``z = sum d / sqrt(sum v)`` is normal with mean 0 and standard deviation 1, and ``s² = sum d² / sum v`` has the mean 1.
A displacement of the one against the other is the regression of ``d`` on the picture's gradient, with its error, in x and y.
Outside the crop the full frame must be the static background exactly.
"""

import argparse
import json
import os
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from tumble.one_thread import keep_to_one_thread

keep_to_one_thread(os.environ)

import numpy as np  # noqa: E402 - after the threads are limited
from numpy.typing import NDArray  # noqa: E402

from datasets.atomic_files import written_whole  # noqa: E402
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RenderingRecipe  # noqa: E402
from datasets.vocabulary.outline import signed_area  # noqa: E402
from synth.rendering.exposure import background_light, compose, expose  # noqa: E402
from synth.rendering.sequence import Studio  # noqa: E402
from synth.rendering.shots import Shot, frame_shots, hull_points, ray_seeds  # noqa: E402
from synth.rendering.variant import activate, available_variants  # noqa: E402
from synth.rendering.window import Window  # noqa: E402
from synth.sequence import plan_sequence  # noqa: E402
from synth.silhouette import exact_outline, outline_mesh  # noqa: E402

Array = NDArray[np.float64]

SHARE = 1 / 16
"""Bounding box, or silhouette, of the particle over the picture."""
LONG_LENS = HsvRecipe(focal_mm=800 / 3)
"""0.025 mm per pixel at 0.6 m: particles of usual size fill a sixteenth of the picture."""
MOTION = MotionRecipe(frames=1, speed_ms=(1.0, 1.0), spin_rads=(100.0, 100.0))
LEAST_RATIO, MOST_SIGMAS, MOST_EXCESS = 5.0, 3.3, 0.1
REPETITIONS = 7


@dataclass(frozen=True)
class Case:
    """What is rendered, with which variant; ``limit``: whether the ratio has to reach :data:`LEAST_RATIO`.

    ``covering``: what of the particle covers :data:`SHARE` of the picture.
    """

    material: str
    variant: str
    subframes: int
    limit: bool
    covering: Literal["bounding box", "silhouette"] = "bounding box"

    @property
    def name(self) -> str:
        """How figures call it."""
        by = "" if self.covering == "bounding box" else f", {self.covering} 1/{1 / SHARE:.0f}"
        return f"{self.material}, {self.variant}{by}"


@dataclass(frozen=True)
class Measured:
    """Seconds and pictures (repetition, height, width) of both ways, and the crop."""

    crop_s: Array
    full_s: Array
    crop: Array
    full: Array
    window: Window
    share: float


def cases() -> tuple[Case, ...]:
    """The best variant that works here with a matte particle, small and larger, and a diamond; the scalar one where it is not the best."""
    working = [variant.name for variant in available_variants() if variant.works]
    best, last = working[0], working[-1]
    larger = Case("matte", best, 8, limit=False, covering="silhouette")
    first = (Case("matte", best, 8, limit=True), larger, Case("diamond", best, 4, limit=False))
    return first if best == last else (*first, Case("matte", last, 2, limit=True))


def recipe_of(case: Case) -> Recipe:
    """The recipe whose particle covers :data:`SHARE` of the picture with what the case says."""
    size = 7.5
    for _ in range(4):
        recipe = Recipe(
            seed=3,
            tier="rendered",
            particle=ParticleRecipe(size_mm=(size, size), material=case.material),  # type: ignore[arg-type]
            motion=MOTION,
            hsv=LONG_LENS,
            rendering=RenderingRecipe(subframes=case.subframes),
        )
        size *= float(np.sqrt(SHARE / covered_share(recipe, case.covering)))
    return recipe


def covered_share(recipe: Recipe, covering: Literal["bounding box", "silhouette"] = "bounding box") -> float:
    """The particle's bounding box or silhouette, blur left out, as a share of the picture."""
    plan = plan_sequence(recipe, 0)
    camera, hull = plan.hsv.intrinsics, hull_points(plan.vertices)
    (R, t), *_ = next(iter(frame_shots(plan, recipe, 0))).poses
    if covering == "silhouette":
        area = signed_area(exact_outline(outline_mesh(plan.vertices, plan.faces), camera, R, t))
    else:
        area = float(np.prod(np.ptp(camera.project(hull @ R.T + t), axis=0)))
    return area / (camera.width_px * camera.height_px)


def measure(case: Case) -> Measured:
    """Render both ways in turn, :data:`REPETITIONS` times."""
    recipe = recipe_of(case)
    plan = plan_sequence(recipe, 0)
    whole = replace(recipe, rendering=replace(recipe.rendering, full_frames=True))
    crop, full = (next(iter(frame_shots(plan, each, 0))) for each in (recipe, whole))
    tracer, optics = Studio(activate(case.variant), plan, recipe).camera("hsv")
    background = background_light(optics)

    def render(shot: Shot, seed: int) -> Array:
        seeds = ray_seeds(np.random.SeedSequence([recipe.seed, seed]), len(shot.poses))
        return compose(optics, background, shot.window, expose(tracer, optics, shot.window, shot.poses, samples=shot.samples, seeds=seeds))

    ways: tuple[Callable[[int], Array], ...] = (lambda seed: render(crop, 2 * seed), lambda seed: render(full, 2 * seed + 1))
    runs = [[timed(way, number) for way in ways] for number in range(REPETITIONS + 1)][1:]
    seconds, pictures = (np.array([[run[k][part] for run in runs] for k in (0, 1)]) for part in (0, 1))
    return Measured(seconds[0], seconds[1], pictures[0], pictures[1], crop.window, covered_share(recipe, case.covering))


def timed(way: Callable[[int], Array], seed: int) -> tuple[float, Array]:
    """Processor seconds and picture."""
    began = time.process_time()
    picture = way(seed)
    return time.process_time() - began, picture


def agreement(first: Array, second: Array) -> dict[str, float]:
    """``z``, ``s`` and the displacement (px) of ``first`` against ``second`` along x and y with its errors.

    Both are pictures, (repetition, height, width), in any unit.
    """
    mean, other = first.mean(axis=0), second.mean(axis=0)
    d = mean - other
    v = first.var(axis=0, ddof=1) / len(first) + second.var(axis=0, ddof=1) / len(second)
    values = {"z": float(d.sum() / np.sqrt(v.sum())), "s": float(np.sqrt((d**2).sum() / v.sum()))}
    for axis, slope in zip("yx", np.gradient(0.5 * (mean + other)), strict=True):
        power = (slope**2).sum()
        values[f"shift_{axis}_px"] = float(-(slope * d).sum() / power)
        values[f"shift_{axis}_error_px"] = float(np.sqrt((slope**2 * v).sum()) / power)
    return values


def case_figures(case: Case) -> list[dict[str, Any]]:
    """The figures of one case."""
    seen = measure(case)
    rows, columns = seen.window.slices
    inside = agreement(seen.crop[:, rows, columns], seen.full[:, rows, columns])
    apart = np.abs(seen.full - seen.crop)
    apart[:, rows, columns] = 0.0
    sigmas = max(abs(inside["z"]), *(abs(inside[f"shift_{k}_px"]) / inside[f"shift_{k}_error_px"] for k in "xy"))
    pixels = seen.full[0].size / (seen.window.width * seen.window.height)
    ratio = figure("full frame over crop", float(np.median(seen.full_s) / np.median(seen.crop_s)), "ratio")
    entries = [
        figure(f"{case.covering} over picture, inverse", 1 / seen.share, "ratio"),
        figure("pixels of the full frame over those of the crop", pixels, "ratio"),
        figure("crop", float(np.median(seen.crop_s)), "s of one core"),
        figure("full frame", float(np.median(seen.full_s)), "s of one core"),
        {**ratio, "limit": LEAST_RATIO, "direction": "higher"} if case.limit else ratio,
        figure("smallest ratio of the pairs", float((seen.full_s / seen.crop_s).min()), "ratio"),
        figure("mean of crop - full", inside["z"], "sigma"),
        figure("displacement along x", inside["shift_x_px"], "px"),
        figure("its error", inside["shift_x_error_px"], "px"),
        figure("displacement along y", inside["shift_y_px"], "px"),
        figure("its error", inside["shift_y_error_px"], "px"),
        {**figure("largest of mean and displacements", sigmas, "sigma"), "limit": MOST_SIGMAS, "direction": "lower"},
        figure("standard deviation of crop - full", inside["s"], "sigma"),
        {**figure("its distance from 1", abs(inside["s"] - 1), "sigma"), "limit": MOST_EXCESS, "direction": "lower"},
        {**figure("difference outside the crop", float(apart.max()), "of full light"), "limit": 0.0, "direction": "lower"},
    ]
    return [{**entry, "name": f"{case.name}: {entry['name']}"} for entry in entries]


def figure(name: str, value: float, unit: str) -> dict[str, Any]:
    """A figure without a limit."""
    return {"name": name, "value": value, "unit": unit}


def main() -> int:
    """Measure every case; print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--result", type=Path, metavar="FILE", help="write the figures as JSON here too")
    arguments = parser.parse_args()
    figures = [entry for case in cases() for entry in case_figures(case)]
    if arguments.result:
        with written_whole(arguments.result) as temporary:
            temporary.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")
    if arguments.json:
        print(json.dumps(figures))
    else:
        for entry in figures:
            sign = {"higher": ">=", "lower": "<="}.get(entry.get("direction", ""), "")
            print(f"{entry['name']}: {entry['value']:.4g} {entry['unit']} {sign} {entry.get('limit', '')}".rstrip())
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
