"""Draws the flights of silhouette campaigns: a stone, its calibrated views, and flights that stay in the picture.

The picture is about 12 cm wide: a flight is as slow as its frames ask for.
"""

import numpy as np

from tumble.challenge.field_case import FieldCase, FlightPlan, Noise, Scene
from tumble.challenge.field_spans import ROUNDED_FROM_S, log_uniform

FLIGHTS = (1, 8)
RATES_HZ = (200.0, 4000.0)
LONGEST_S = 0.08
"""Of a flight: by then it has fallen by 3 cm."""
MOST_FRAMES = 240
"""Of all flights of a campaign, so that it is made and solved within a minute."""
TRAVEL_M = 0.05
"""That a flight may go with its first speed."""
SPEED_MS = (0.3, 4.0)
SPINS_PER_FRAME, MOST_SPIN_RADS = (0.01, 0.08), 300.0
"""Turns (rad) from frame to frame, and the fastest spin."""
DROPS = (3, 6)
SIGMA_PX = {"outline": (0.1, 0.4), "view": (0.1, 0.3)}


def draw_silhouettes(name: str, flights: tuple[int, int], rows: tuple[int, int], rng: np.random.Generator) -> FieldCase:
    """A campaign with its noise, nothing hidden; states of flights are still unknown."""
    rate = log_uniform(RATES_HZ, rng)
    most = max(rows[0], min(rows[1], int(LONGEST_S * rate)))
    count = round(log_uniform((max(flights[0], FLIGHTS[0]), max(flights[0], min(flights[1], FLIGHTS[1]))), rng))
    frames = [round(log_uniform((rows[0], most), rng)) for _ in range(count)]
    while sum(frames) > MOST_FRAMES:
        frames.pop()
    longest = max(frames) / rate
    fastest = float(np.clip(TRAVEL_M / longest, *SPEED_MS))
    spins = tuple(min(each * rate, MOST_SPIN_RADS) for each in SPINS_PER_FRAME)
    scene = Scene(
        family="cut_stone" if rng.random() < 0.5 else "jagged",
        irregularity=float(rng.uniform(0.3, 0.8)),
        drops=int(rng.integers(DROPS[0], DROPS[1] + 1)),
        speed_ms=(min(SPEED_MS[0], 0.5 * fastest), fastest),
        spin_rads=spins,
    )
    noise = Noise(
        {channel: log_uniform(span, rng) for channel, span in SIGMA_PX.items()},
        repeats=int(rng.integers(2, 4)),
        outliers=float(rng.uniform(0.01, 0.02)),
        rounded=1.0 / rate >= ROUNDED_FROM_S,
        stated=False,
    )
    still = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    plans = tuple(FlightPlan(f"{name}-{i + 1}", each, rate, *still) for i, each in enumerate(frames))
    return FieldCase(name, int(rng.integers(2**31)), "silhouettes", (), plans, noise, {}, {}, {}, {}, {}, scene)
