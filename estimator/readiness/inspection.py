"""What one camera recorded: outlines, contrast, saturation, size, motion and blur, and how smooth the path is.

In free flight the outline's centre moves on a parabola but for a wobble of a fraction of a pixel, so a lost picture or a wrong time stamp
shows as one step that is a multiple of its neighbours. Impacts are kinks of the path (:mod:`estimator.impacts.impact_search`); what is said
of a flight is said of the longest stretch without any. Valid for any recording; nothing is known here of camera, particle or
gravity.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.observation import Frames, Recording
from datasets.vocabulary.camera import Intrinsics
from estimator.impacts.impact_search import CentroidPath, centroid_path, clear_kinks, find_kinks
from estimator.outlines.pictures.background import SATURATED
from estimator.outlines.recording import outlines_of
from estimator.outlines.result import OutlineTrack

Array = NDArray[np.float64]
AROUND = 3
"""Steps to either side that a step is compared with."""
WHOLE = 0.25
"""How far a step may be from a multiple of its neighbours, as a share: a lost picture makes 2, a picture that is there twice 0."""
ALIKE = 0.5
"""How far its neighbours may be from one another for a step to be odd beside them, as a share."""
FROM_KINK = 3.0
"""Frames about a kink in which a step is no odd one, and that belong to no free flight: an irregular body may touch twice within them."""
LEAST_STEP_PX = 0.5
"""Motion from frame to frame below which a step disappears in noise and wobble."""


@dataclass(frozen=True)
class Inspection:
    """What one camera recorded in n frames.

    ``track``: outlines. ``times_s`` (n,) s or ``None``. ``extent_px`` (n,): largest side of the upright box about each
    outline, NaN where there is none.
    ``path``: centres of the used outlines. ``saturated`` (n,): share of each picture's pixels at full scale, NaN for outlines.
    ``free``: the longest stretch of the path without a kink. ``kinks`` (frames): where it has one.
    ``smear_px``: motion during an exposure, where it is known. ``odd_steps``: pairs of frames between which the centre moved
    ``times`` as far as between their neighbours.
    """

    track: OutlineTrack
    times_s: Array | None
    extent_px: Array
    path: CentroidPath
    free: CentroidPath
    kinks: tuple[float, ...]
    saturated: Array
    smear_px: float | None
    odd_steps: tuple["OddStep", ...]

    @property
    def step_px(self) -> float:
        """Median motion (px) from one frame to the next; NaN where fewer than two are seen."""
        steps = self.path.c[1:] - self.path.c[:-1]
        gaps = np.diff(self.path.frame)
        return float(np.median(np.hypot(*steps.T) / gaps)) if len(gaps) else float("nan")

    @property
    def bend_px(self) -> float:
        """RMS distance (px) of the centres in free flight from the parabola in time that fits them best; NaN for fewer than five."""
        if len(self.free.frame) < 5:
            return float("nan")
        rest = parabola(self)[1]
        return float(np.sqrt(np.mean(np.sum(rest**2, axis=1))))


@dataclass(frozen=True)
class OddStep:
    """Between frames ``first`` and ``second`` the centre moved ``times`` as far per unit of time as between their neighbours."""

    first: int
    second: int
    times: float


def inspect_recording(
    recording: Recording, size_px: tuple[int, int], *, times_s: Array | None = None, exposure_s: float | None = None, name: str = "frames"
) -> Inspection:
    """Inspect a recording of pictures of ``size_px`` (width, height).

    ``times_s`` (f,).

    Raises
    ------
    datasets.errors.InputError
        Naming ``name`` and the frame where a picture is of another size or damaged.
    """
    track = outlines_of(recording, Intrinsics(*size_px, 1.0, 1.0, 0.0, 0.0), name=name)
    path = centroid_path(track, in_part=True)
    extent = np.array([np.ptp(f.outline.points_px, axis=0).max() if len(f.outline.points_px) else np.nan for f in track.frames])
    saturated = _saturated(recording) if isinstance(recording, Frames) else np.full(len(track), np.nan)
    smear = _smear_px(path, times_s, exposure_s)
    kinks = tuple(kink.frame for kink in clear_kinks(find_kinks(path)))
    odd = tuple(s for s in _odd_steps(path, times_s) if all(abs(0.5 * (s.first + s.second) - k) > FROM_KINK for k in kinks))
    return Inspection(track, times_s, extent, path, _free(path, kinks), kinks, saturated, smear, odd)


def _free(path: CentroidPath, kinks: tuple[float, ...]) -> CentroidPath:
    """The longest stretch of the path between kinks; all of it where there is none."""
    if not kinks:
        return path
    ends = [-np.inf, *kinks, np.inf]
    rows = [np.flatnonzero((path.frame > a + FROM_KINK) & (path.frame < b - FROM_KINK)) for a, b in pairwise(ends)]
    longest = max(rows, key=len)
    return CentroidPath(path.frame[longest], path.c[longest])


def parabola(inspection: Inspection) -> tuple[Float[NDArray[np.float64], "3 2"], Float[NDArray[np.float64], "n 2"]]:
    """Coefficients (3, 2) px, px/s, px/s² of the parabola of the centres in free flight about its middle, and the distances (n, 2) px.

    Without times a frame counts as a second.
    """
    when = inspection.free.frame.astype(np.float64) if inspection.times_s is None else inspection.times_s[inspection.free.frame]
    t = when - when.mean()
    A = np.column_stack([np.ones_like(t), t, 0.5 * t**2])
    scale = np.abs(A).max(axis=0)
    coefficients = np.linalg.lstsq(A / scale, inspection.free.c, rcond=None)[0] / scale[:, None]
    return coefficients, inspection.free.c - A @ coefficients


def _saturated(frames: Frames) -> Float[NDArray[np.float64], " frame"]:
    """Share of the pixels of each picture at full scale."""
    least = SATURATED * (2**frames.bit_depth - 1)
    return np.array([float(np.mean(frames.read(k) >= least)) for k in range(len(frames))])


def _smear_px(path: CentroidPath, times_s: Array | None, exposure_s: float | None) -> float | None:
    if times_s is None or exposure_s is None or len(path.frame) < 2:
        return None
    speed = np.hypot(*np.diff(path.c, axis=0).T) / np.diff(times_s[path.frame])
    return float(np.median(speed)) * exposure_s


def _odd_steps(path: CentroidPath, times_s: Array | None) -> tuple[OddStep, ...]:
    """Single steps that are a whole multiple of what their neighbours are per unit of time, or nothing."""
    when = path.frame.astype(np.float64) if times_s is None else times_s[path.frame]
    if len(when) < 2 + AROUND:
        return ()
    gaps = np.diff(when)
    steps = np.diff(path.c, axis=0) / gaps[:, None] * float(np.median(gaps))
    found = []
    for k in range(len(steps)):
        near = np.delete(steps[max(0, k - AROUND) : k + AROUND + 1], min(k, AROUND), axis=0)
        usual = np.median(near, axis=0)
        size = float(np.hypot(*usual))
        times = float(steps[k] @ usual) / max(size, 1e-9) ** 2
        whole = float(np.linalg.norm(steps[k] - round(times) * usual)) <= WHOLE * size * max(times, 1.0)
        alike = float(np.linalg.norm(near - usual, axis=1).max()) <= ALIKE * size
        if size >= LEAST_STEP_PX and round(times) != 1 and whole and alike:
            found.append(OddStep(int(path.frame[k]), int(path.frame[k + 1]), times))
    return tuple(found)
