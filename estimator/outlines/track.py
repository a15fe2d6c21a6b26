"""The particle through a sequence: each frame is searched where the last ones say it must be, else everywhere.

Frames are read one at a time and let go; memory is a few pictures and the outlines.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.observation import Frames
from estimator.outlines.pictures.background import Background, background_of_sequence, read_picture
from estimator.outlines.pictures.component import Place
from estimator.outlines.pictures.frame import Sighting, Window, look, whole
from estimator.outlines.result import FrameOutline, FrameStatus, OutlineTrack
from estimator.outlines.settings import OutlineSettings

_LEAST_WINDOW_PX = 24
"""Shorter side of a window below which the whole picture is searched: it shows no background."""


@dataclass(frozen=True)
class _Memory:
    """The last two places and how many frames ago the latest one was."""

    last: Place | None = None
    before: Place | None = None
    age: int = 0

    def expected(self) -> Place | None:
        """Where the particle should be now, at constant velocity."""
        if self.last is None:
            return None
        step = np.zeros(2) if self.before is None else self.last.centre_px - self.before.centre_px
        shift = (self.age + 1) * step
        left, top, right, bottom = self.last.box
        dx, dy = (round(s) for s in shift)
        return replace(self.last, centre_px=self.last.centre_px + shift, box=(left + dx, top + dy, right + dx, bottom + dy))

    def after(self, place: Place | None) -> "_Memory":
        """The memory one frame later."""
        if place is None:
            return replace(self, age=self.age + 1)
        return _Memory(place, self.last if self.age == 0 else None, 0)


def extract_outlines(
    frames: Frames,
    *,
    image_size: tuple[int, int] | None = None,
    name: str = "frames",
    settings: OutlineSettings | None = None,
) -> OutlineTrack:
    """Outline of the one particle in each frame of a sequence.

    Parameters
    ----------
    frames
        The pictures, read lazily.
    image_size
        (width, height) in px that the camera says its pictures have; unchecked but equal among frames when ``None``.
    name
        What messages call this recording (a file).
    settings
        Thresholds; the defaults when ``None``.

    Returns
    -------
    OutlineTrack
        Per frame an outline (px) and its status.

    Raises
    ------
    datasets.errors.InputError
        Where there are no frames, or one is not of the size expected.
    """
    if len(frames) == 0:
        raise InputError(f"{name}: expected at least one frame, got none")
    settings = settings or OutlineSettings()
    shape = (image_size[1], image_size[0]) if image_size else read_picture(frames, 0, name=name).shape
    background = background_of_sequence(frames, name=name, shape=shape, samples=settings.background_samples)
    seen: list[FrameOutline] = []
    memory = _Memory()
    for index in range(len(frames)):
        sighting = _search(read_picture(frames, index, name=name, shape=shape), background, memory, settings)
        memory = memory.after(sighting.place)
        seen.append(sighting.seen)
    return OutlineTrack(without_blurred(tuple(seen), settings))


def without_blurred(seen: tuple[FrameOutline, ...], settings: OutlineSettings) -> tuple[FrameOutline, ...]:
    """Mark frames out of focus: the edge is far wider than in the sharp ones, or wide against the particle itself."""
    widths = np.array([f.edge_width_px for f in seen if f.used])
    sharp = float(np.percentile(widths, 25)) if len(widths) else 0.0
    limit = max(settings.widest_edge * sharp, settings.least_blur_px)
    return tuple(
        replace(f, status=FrameStatus.OUT_OF_FOCUS) if f.seen and f.edge_width_px > min(limit, _widest(f, settings)) else f for f in seen
    )


def _widest(frame: FrameOutline, settings: OutlineSettings) -> float:
    extent = np.ptp(frame.outline.points_px, axis=0)
    return settings.widest_edge_share * float(extent.max())


def _search(picture: NDArray[np.uint16], background: Background, memory: _Memory, settings: OutlineSettings) -> Sighting:
    """Look where the particle is expected; where that fails, in the whole picture."""
    expected = memory.expected()
    if expected is not None:
        window = _window(expected, picture.shape, settings.crop_margin_px * (1 + memory.age))
        if _roomy(window):
            near = look(picture, background, window, settings, expected=expected)
            if near.place is not None and _inside(near.place, window, picture.shape):
                return near
    return look(picture, background, whole(picture.shape), settings, expected=expected)


def _window(place: Place, shape: tuple[int, int], margin: int) -> Window:
    left, top, right, bottom = place.box
    return (max(left - margin, 0), max(top - margin, 0), min(right + margin, shape[1]), min(bottom + margin, shape[0]))


def _roomy(window: Window) -> bool:
    """Whether a window lies in the picture and shows some background; not when the particle should have left."""
    left, top, right, bottom = window
    return min(right - left, bottom - top) > _LEAST_WINDOW_PX


def _inside(place: Place, window: Window, shape: tuple[int, int]) -> bool:
    """Whether the place keeps off those sides of the window that are not the picture's own."""
    near = 4
    clear_low = all(window[k] == 0 or place.box[k] >= window[k] + near for k in (0, 1))
    clear_high = all(window[k + 2] == shape[1 - k] or place.box[k + 2] <= window[k + 2] - near for k in (0, 1))
    return clear_low and clear_high
