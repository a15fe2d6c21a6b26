"""Points over two axes as SVG text, without Matplotlib, which takes twenty times longer for each of a report's many small charts.

Coordinates are points (1/72 inch), y downwards. Colours are those of the page. Ticks stand at multiples of 1, 2 or 5 times a power of ten.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import escape

SOFT, MEASURED, NOISE, BAD = "var(--soft)", "var(--observed)", "var(--left-out)", "var(--estimated)"
"""Colours of the page."""
WIDTH, HEIGHT = 266.4, 180.0
"""Of a small chart."""
FONT, LETTER = 9.0, 5.6
"""Size of the letters, and about how wide a digit is."""
EDGE, TICK, GAP = 4.0, 3.5, 3.0
"""Margin of the picture, length of a tick, and from there to its label."""
BESIDE = 0.05
"""Share of the range that is left free at both ends of an axis."""
MOST_X, MOST_Y = 6, 7
"""Ticks for which there is room."""
SMALL, LARGE = 1e-4, 1e5
"""Sizes of a tick's number between which it is written without an exponent."""


@dataclass(frozen=True)
class Axis:
    """A stretch ``low`` to ``high`` of numbers that lies between the points ``first`` and ``last`` of the picture, and its ``ticks``."""

    low: float
    high: float
    first: float
    last: float
    ticks: tuple[float, ...]

    def at(self, value: float) -> float:
        """Where a number lies."""
        return self.first + (value - self.low) / (self.high - self.low) * (self.last - self.first)


@dataclass(frozen=True)
class Frame:
    """Two axes with what is written beside them."""

    x: Axis
    y: Axis
    x_label: str
    y_label: str
    title: str = ""
    size: tuple[float, float] = (WIDTH, HEIGHT)

    def drawn(self, inside: Sequence[str], says: str) -> str:
        """The picture: axes, labels and what is ``inside``; ``says`` what it shows, for who cannot see it."""
        left, bottom = self.x.first, self.y.first
        parts = [
            f'<path d="M{left:.2f} {self.y.last:.2f}V{bottom:.2f}H{self.x.last:.2f}" fill="none" stroke="{SOFT}" stroke-width="0.8"/>',
            *(_tick(self.x.at(v), bottom, _number(v, self.x.ticks), down=True) for v in self.x.ticks),
            *(_tick(left, self.y.at(v), _number(v, self.y.ticks), down=False) for v in self.y.ticks),
            *inside,
            text(0.5 * (left + self.x.last), self.size[1] - EDGE, self.x_label),
            text(EDGE + FONT - 2.0, 0.5 * (bottom + self.y.last), self.y_label, turned=True),
            *([text(0.5 * (left + self.x.last), EDGE + FONT, self.title, SOFT)] if self.title else []),
        ]
        head = f'<svg role="img" aria-label="{escape(says)}" class="chart" xmlns="http://www.w3.org/2000/svg"'
        box = f'viewBox="0 0 {self.size[0]:g} {self.size[1]:g}" font-size="{FONT:g}" font-family="sans-serif"'
        return f"{head} {box}>{''.join(parts)}</svg>"


def frame_about(
    x: tuple[float, float],
    y: tuple[float, float],
    labels: tuple[str, str],
    *,
    title: str = "",
    alike: bool = False,
    size: tuple[float, float] = (WIDTH, HEIGHT),
    named: bool = False,
) -> Frame:
    """Axes about the ranges ``x`` and ``y``, as wide as their labels leave room.

    ``alike``: one scale for both, y downwards; ``named``: places along x have names that are drawn beside the frame, and no numbers.
    """
    ticks = ticks_in(*y, MOST_Y)
    left = EDGE + FONT + GAP + TICK + GAP + LETTER * max((len(_number(v, ticks)) for v in ticks), default=1)
    right, top, bottom = size[0] - EDGE, EDGE + (FONT + 2 * GAP if title else 0.0), size[1] - EDGE - 2 * FONT - 2 * GAP - TICK
    if alike:
        scale = max((x[1] - x[0]) / (right - left), (y[1] - y[0]) / (bottom - top))
        x, y = _widened(x, scale * (right - left)), _widened(y, scale * (bottom - top))[::-1]
    across = Axis(*x, left, right, () if named else ticks_in(min(x), max(x), MOST_X))
    return Frame(across, Axis(*y, bottom, top, ticks_in(min(y), max(y), MOST_Y)), *labels, title, size)


def range_of(values: Sequence[float], beside: float = BESIDE) -> tuple[float, float]:
    """From the least to the largest of some numbers, if there are any, with a share left free at both ends; none of length zero."""
    low, high = min(values, default=0.0), max(values, default=0.0)
    room = beside * (high - low) or 0.5 * abs(low) or 1.0
    return low - room, high + room


def ticks_in(low: float, high: float, most: int) -> tuple[float, ...]:
    """At most so many multiples of 1, 2 or 5 times a power of ten between two numbers."""
    power = 10.0 ** math.floor(math.log10((high - low) / most))
    step = next(power * n for n in (1.0, 2.0, 5.0, 10.0, 20.0) if math.floor(high / (power * n)) - math.ceil(low / (power * n)) < most)
    return tuple(step * n for n in range(math.ceil(low / step), math.floor(high / step) + 1))


def dot(x: float, y: float, radius: float, colour: str, opacity: float = 1.0) -> str:
    """A filled circle."""
    faint = "" if opacity == 1.0 else f' fill-opacity="{opacity:g}"'
    return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{radius:.2f}" fill="{colour}"{faint}/>'


def line(start: tuple[float, float], end: tuple[float, float], colour: str, width: float) -> str:
    """A straight line."""
    (a, b), (c, d) = start, end
    return f'<path d="M{a:.2f} {b:.2f}L{c:.2f} {d:.2f}" stroke="{colour}" stroke-width="{width:g}"/>'


def path(points: Sequence[tuple[float, float]], colour: str, width: float, *, dashed: bool = False) -> str:
    """A line through points."""
    through = "L".join(f"{x:.2f} {y:.2f}" for x, y in points)
    dashes = ' stroke-dasharray="4 2"' if dashed else ""
    return f'<path d="M{through}" fill="none" stroke="{colour}" stroke-width="{width:g}"{dashes}/>'


def _widened(ends: tuple[float, float], length: float) -> tuple[float, float]:
    middle = 0.5 * (ends[0] + ends[1])
    return middle - 0.5 * length, middle + 0.5 * length


def _tick(x: float, y: float, label: str, *, down: bool) -> str:
    if down:
        return line((x, y), (x, y + TICK), SOFT, 0.8) + text(x, y + TICK + GAP + 0.75 * FONT, label, SOFT)
    beside = text(x - TICK - GAP, y + 0.36 * FONT, label, SOFT, anchor="end")
    return line((x, y), (x - TICK, y), SOFT, 0.8) + beside


def text(x: float, y: float, words: str, colour: str = "currentColor", *, anchor: str = "middle", turned: bool = False) -> str:
    """Words at a place."""
    turn = f' transform="rotate(-90 {x:.2f} {y:.2f})"' if turned else ""
    return f'<text x="{x:.2f}" y="{y:.2f}" text-anchor="{anchor}" fill="{colour}"{turn}>{escape(words)}</text>'


def _number(value: float, ticks: Sequence[float]) -> str:
    """A tick's number, as exact as the step between ticks asks for."""
    largest = max(map(abs, ticks))
    step = ticks[1] - ticks[0] if len(ticks) > 1 else largest or 1.0
    if largest and not SMALL <= step <= LARGE:
        words = f"{value:.{max(math.floor(math.log10(largest)) - math.floor(math.log10(step)), 0)}e}" if value else "0"
    else:
        words = f"{value:.{max(-math.floor(math.log10(step) + 1e-9), 0)}f}"
    return words.replace("-", "−")
