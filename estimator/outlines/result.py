"""What is seen in one frame, and in a sequence of them: an outline or the reason why there is none to use."""

from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np
from jaxtyping import Bool, Float
from numpy.typing import NDArray

from datasets.vocabulary.outline import Outline


class FrameStatus(StrEnum):
    """Whether a frame's outline is used, or a part of it; every other value is the reason why it is left out."""

    USED = "used"
    IN_PART = "partly beside a plate or other dark scenery"
    CUT_OFF = "cut off by the picture's edge"
    HIDDEN = "partly hidden by the plate"
    BEFORE_SCENERY = "too near a plate's edge or other dark scenery"
    OUT_OF_FOCUS = "out of focus"
    ABSENT = "absent"
    BLACK = "black picture"
    OVEREXPOSED = "overexposed picture"
    SEVERAL = "several objects"
    NO_EDGE = "no closed edge"
    MERGED = "merged with the other particle's outline"
    BRIEFLY_APART = "apart from the other particle too briefly to be followed"
    UNEVENLY_LIT = "unevenly lit: more of the particle outside of the half level"


EMPTY = Outline(np.zeros((0, 2)))


@dataclass(frozen=True)
class FrameOutline:
    """One frame: its outline (px) and how well it could be seen.

    An outline that is left out is kept where there is one, for looking at. ``edge_width_px``: 10-90% width of the edge,
    pixel integration included, across the smear of the motion if there is any (NaN where nothing was measured).
    ``contrast``: brightness difference between background and particle as a share of full scale. ``noise``: standard
    deviation of one pixel as a share of that difference.
    ``sigma_px``: standard deviation of one outline point along the normal (px): what this noise gives it, or what
    the outline's own roughness shows where that is more (grain, specks, detail finer than a pixel).
    ``misfit``: RMS difference between the picture and the re-imaged outline near the edge, as a share of the contrast;
    much above ``noise`` the edge is not that of an opaque body (light leaking through facets, glare).
    ``unsure``: which outline points (n,) are not the particle's edge or may not be; empty where all are.
    """

    outline: Outline
    status: FrameStatus
    edge_width_px: float = float("nan")
    contrast: float = float("nan")
    noise: float = float("nan")
    sigma_px: float = float("nan")
    misfit: float = float("nan")
    unsure: Bool[NDArray[np.bool_], " n"] = field(default_factory=lambda: np.zeros(0, dtype=bool))

    @property
    def used(self) -> bool:
        """Whether the whole outline is fit for measuring."""
        return self.status is FrameStatus.USED

    @property
    def seen(self) -> bool:
        """Whether the outline or a part of it is fit for measuring."""
        return self.status in (FrameStatus.USED, FrameStatus.IN_PART)


@dataclass(frozen=True)
class OutlineTrack:
    """The outlines of a sequence, one entry per frame."""

    frames: tuple[FrameOutline, ...]

    def __len__(self) -> int:
        return len(self.frames)

    @property
    def outlines(self) -> tuple[Outline, ...]:
        """Per frame the outline, empty where the frame is left out."""
        return tuple(f.outline if f.used else EMPTY for f in self.frames)

    @property
    def used(self) -> Bool[NDArray[np.bool_], " frame"]:
        """Which frames are used whole."""
        return np.array([f.used for f in self.frames], dtype=bool)

    @property
    def seen(self) -> Bool[NDArray[np.bool_], " frame"]:
        """Which frames are used, whole or in part."""
        return np.array([f.seen for f in self.frames], dtype=bool)

    @property
    def reasons(self) -> tuple[str, ...]:
        """Per frame ``used`` or why it is left out."""
        return tuple(str(f.status) for f in self.frames)

    @property
    def sigmas_px(self) -> Float[NDArray[np.float64], " frame"]:
        """Per frame the expected standard deviation of an outline point along the normal (px), NaN where unknown."""
        return np.array([f.sigma_px for f in self.frames])


LEAST_CLEAR, DIRECTIONS = 0.5, 72
"""Share of the directions in which the outermost point of an outline has to be clear of scenery for it to be used; of so many.

See notebook 16."""


def in_part(frame: FrameOutline, unsure: Bool[NDArray[np.bool_], " n"], otherwise: FrameStatus, *, most_px: float) -> FrameOutline:
    """The frame with a part of its outline ``unsure``, or left out for the reason ``otherwise``; as it is up to ``most_px`` of length."""
    points = frame.outline.points_px
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    length = float(steps[unsure].sum())
    if length <= most_px:
        return frame
    unsure = unsure | frame.unsure if len(frame.unsure) else unsure
    angles = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    outermost = np.argmax(points @ np.array([np.cos(angles), np.sin(angles)]), axis=0)
    used = frame.seen and float(np.mean(~unsure[outermost])) >= LEAST_CLEAR
    return replace(frame, status=FrameStatus.IN_PART if used else otherwise, unsure=unsure)


def left_out(status: FrameStatus) -> FrameOutline:
    """A frame without an outline."""
    return FrameOutline(EMPTY, status)
