"""A first look at what one camera recorded: outlines, contrast, saturation, size, motion and blur, and how smooth the path is.

In free flight the outline's centre moves on a parabola but for a wobble of a fraction of a pixel, so a lost picture or a wrong time stamp
shows as one step of another length than its neighbours. Valid for any recording; nothing is known here of camera, particle or gravity.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.observation import Frames, Recording
from datasets.vocabulary.camera import Intrinsics
from estimator.fitting.impact_search import CentroidPath, centroid_path
from estimator.outlines.background import SATURATED
from estimator.outlines.recording import checked
from estimator.outlines.result import OutlineTrack
from estimator.outlines.track import extract_outlines

Array = NDArray[np.float64]
AROUND = 3
"""Steps to either side that a step is compared with."""
ODD_STEP = 1.5
"""How many times longer than its neighbours (or shorter) a step is odd: a lost picture makes 2, a picture that is there twice 0."""
LEAST_STEP_PX = 0.5
"""Difference of a step from its neighbours below which it is noise of the outlines."""


@dataclass(frozen=True)
class Look:
    """What one camera recorded in n frames.

    ``track``: outlines. ``times_s`` (n,) s or ``None``. ``extent_px`` (n,): largest side of the upright box about each
    outline, NaN where there is none.
    ``path``: centres of the used outlines. ``saturated`` (n,): share of each picture's pixels at full scale, NaN for outlines.
    ``smear_px``: motion during an exposure, where it is known. ``odd_steps``: pairs of frames between which the centre moved
    ``times`` as far as between their neighbours.
    """

    track: OutlineTrack
    times_s: Array | None
    extent_px: Array
    path: CentroidPath
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
        """RMS distance (px) of the centres from the parabola in time that fits them best; NaN for fewer than five."""
        if len(self.path.frame) < 5:
            return float("nan")
        rest = parabola(self)[1]
        return float(np.sqrt(np.mean(np.sum(rest**2, axis=1))))


@dataclass(frozen=True)
class OddStep:
    """Between frames ``first`` and ``second`` the centre moved ``times`` as far per unit of time as between their neighbours."""

    first: int
    second: int
    times: float


def look_at(
    recording: Recording, size_px: tuple[int, int], *, times_s: Array | None = None, exposure_s: float | None = None, name: str = "frames"
) -> Look:
    """Look at a recording of pictures of ``size_px`` (width, height).

    Raises
    ------
    datasets.errors.InputError
        Naming ``name`` and the frame where a picture is of another size or damaged.
    """
    track = _track(recording, size_px, name)
    path = centroid_path(track, in_part=True)
    extent = np.array([np.ptp(f.outline.points_px, axis=0).max() if len(f.outline.points_px) else np.nan for f in track.frames])
    saturated = _saturated(recording) if isinstance(recording, Frames) else np.full(len(track), np.nan)
    smear = _smear_px(path, times_s, exposure_s)
    return Look(track, times_s, extent, path, saturated, smear, _odd_steps(path, times_s))


def parabola(look: Look) -> tuple[Float[NDArray[np.float64], "3 2"], Float[NDArray[np.float64], "n 2"]]:
    """Coefficients (3, 2) px, px/s, px/s² of the centres' parabola about the middle, and the distances (n, 2) px from it.

    Without times a frame counts as a second.
    """
    when = look.path.frame.astype(np.float64) if look.times_s is None else look.times_s[look.path.frame]
    t = when - when.mean()
    A = np.column_stack([np.ones_like(t), t, 0.5 * t**2])
    scale = np.abs(A).max(axis=0)
    coefficients = np.linalg.lstsq(A / scale, look.path.c, rcond=None)[0] / scale[:, None]
    return coefficients, look.path.c - A @ coefficients


def _track(recording: Recording, size_px: tuple[int, int], name: str) -> OutlineTrack:
    if isinstance(recording, Frames):
        return extract_outlines(recording, image_size=size_px, name=name)
    lens = Intrinsics(*size_px, 1.0, 1.0, 0.0, 0.0)
    return OutlineTrack(tuple(checked(outline, lens) for outline in recording))


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
    """Single steps that are much longer or shorter per unit of time than all of their neighbours."""
    when = path.frame.astype(np.float64) if times_s is None else times_s[path.frame]
    if len(when) < 2 + AROUND:
        return ()
    steps = np.diff(path.c, axis=0)
    gaps = np.diff(when)
    usual_gap = float(np.median(gaps))
    speed = np.hypot(*(steps / gaps[:, None] * usual_gap).T)
    found = []
    for k in range(len(speed)):
        near = np.delete(np.arange(max(0, k - AROUND), min(len(speed), k + AROUND + 1)), min(k, AROUND))
        usual = float(np.median(speed[near]))
        alike = float(np.ptp(speed[near])) < 0.5 * abs(speed[k] - usual)
        times = float(speed[k]) / max(usual, 1e-9)
        if alike and not 1.0 / ODD_STEP < times < ODD_STEP and abs(speed[k] - usual) > LEAST_STEP_PX:
            found.append(OddStep(int(path.frame[k]), int(path.frame[k + 1]), times))
    return tuple(found)
