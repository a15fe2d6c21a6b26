"""Figure 5 of the published method: random free flights whose length, linear and angular momentum are all varied.

The paper has 1200 of them at 4000 frames/s with 0 to 4 m/s. Here frames are uniform over 10 to 200, the speed over 0 to 4 m/s (as far as
the flight stays in the picture, :mod:`synth.motion.random_flight`), the spin over 0 to 300 rad/s, and the noise of outlines, which decides
the epipolar tangency error, is drawn on a logarithmic scale. Bodies come in turn, regular and irregular.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from datasets.recipes.recipe import MotionRecipe, NoiseRecipe, Recipe
from studies.flights.bodies import bodies, drawn_seed
from studies.flights.scored import flight, scored_flight
from studies.frame.study import Case, Plan, Settings


@dataclass(frozen=True)
class Figure5(Settings):
    """Ranges of what is drawn for each flight; ``noise_px``: standard deviation of outlines' samples, of frames and of views alike."""

    frames: tuple[int, int] = (10, 200)
    speed_ms: tuple[float, float] = (0.0, 4.0)
    spin_rads: tuple[float, float] = (0.0, 300.0)
    noise_px: tuple[float, float] = (0.1, 0.3)


def cases(settings: Figure5, particles: Path | None) -> list[Case]:
    """One flight of each repetition."""
    return [_case(settings, k, particles) for k in range(settings.count)]


def _case(settings: Figure5, k: int, particles: Path | None) -> Case:
    six, rng = bodies(particles), np.random.default_rng(np.random.SeedSequence([settings.seed, k, 1]))
    frames = int(rng.integers(*settings.frames, endpoint=True))
    noise_px = round(float(np.exp(rng.uniform(*np.log(settings.noise_px)))), 4)
    recipe = Recipe(
        seed=drawn_seed(settings.seed, k),
        particle=six[k % len(six)],
        motion=MotionRecipe(frames=frames, speed_ms=settings.speed_ms, spin_rads=settings.spin_rads),
        noise=NoiseRecipe(noise_px, noise_px),
    )
    return Case(f"{k:04d}", {"repetition": k, "regular": k % 2 == 0, "noise_px": noise_px}, flight(recipe))


PLAN = Plan(
    small=Figure5(seed=1, count=12),
    full=Figure5(seed=1, count=1200),
    cases=cases,
    task=scored_flight,
    modules=("studies.plans.figure_5", "studies.flights.bodies", "studies.flights.scored"),
)
