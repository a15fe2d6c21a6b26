"""Outlines of a recording of either tier: pictures are measured, outlines are only checked."""

from collections.abc import Sequence

from datasets.errors import InputError
from datasets.observation import CalibratedView, Frames, Recording
from datasets.vocabulary.camera import Intrinsics
from datasets.vocabulary.outline import Outline, oriented, signed_area
from estimator.outlines.result import FrameOutline, FrameStatus, OutlineTrack, left_out
from estimator.outlines.sampling import evenly_sampled
from estimator.outlines.track import extract_outlines
from estimator.outlines.views import extract_view_outlines


def outlines_of(recording: Recording, intrinsics: Intrinsics, *, name: str = "recording") -> OutlineTrack:
    """Outlines (px) of what one camera recorded; ``intrinsics`` says the size of its pictures.

    Raises
    ------
    datasets.errors.InputError
        Where a picture's size is not the camera's; the message names ``name`` and the frame.
    """
    if isinstance(recording, Frames):
        return extract_outlines(recording, image_size=(intrinsics.width_px, intrinsics.height_px), name=name)
    return OutlineTrack(tuple(checked(outline, intrinsics) for outline in recording))


def view_outlines_of(recording: Recording, views: Sequence[CalibratedView], *, name: str = "views") -> OutlineTrack:
    """Outlines (px) of the calibrated views, one entry per view.

    Raises
    ------
    datasets.errors.InputError
        Where the numbers of pictures or outlines and of views differ, or a picture's size is not its camera's.
    """
    if isinstance(recording, Frames):
        return extract_view_outlines(recording, views, name=name)
    if len(recording) != len(views):
        raise InputError(f"{name}: expected one outline for each of the {len(views)} calibrated views, got {len(recording)}")
    return OutlineTrack(tuple(checked(o, v.intrinsics) for o, v in zip(recording, views, strict=True)))


def checked(outline: Outline, intrinsics: Intrinsics) -> FrameOutline:
    """An outline that came as such, in even samples: absent when empty or without area, cut off when it reaches the picture's edge."""
    if len(outline.points_px) < 3 or signed_area(outline.points_px) == 0.0:
        return left_out(FrameStatus.ABSENT)
    points = evenly_sampled(outline.points_px)
    low, high = points.min(axis=0), points.max(axis=0)
    cut = low.min() <= 0 or high[0] >= intrinsics.width_px - 1 or high[1] >= intrinsics.height_px - 1
    return FrameOutline(Outline(oriented(points)), FrameStatus.CUT_OFF if cut else FrameStatus.USED)
