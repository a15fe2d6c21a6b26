"""Outlines of the calibrated views: single pictures of the particle at rest, several cameras, no motion to follow."""

from collections.abc import Sequence

from datasets.errors import InputError
from datasets.observation import CalibratedView, Frames
from estimator.outlines.pictures.background import background_of_picture, measured, read_picture
from estimator.outlines.pictures.frame import look, whole
from estimator.outlines.result import OutlineTrack
from estimator.outlines.settings import OutlineSettings
from estimator.outlines.track import without_blurred


def extract_view_outlines(frames: Frames, views: Sequence[CalibratedView], *, name: str = "views") -> OutlineTrack:
    """Outline of the particle in each calibrated view; one picture per view, read one at a time.

    The background is the one taken with that view's camera where there is one, otherwise the smooth light in the
    picture itself.

    Raises
    ------
    datasets.errors.InputError
        Where the numbers of pictures and views differ, or a picture has not the size its camera says.
    """
    if len(frames) != len(views):
        raise InputError(f"{name}: expected one picture for each of the {len(views)} calibrated views, got {len(frames)} pictures")
    settings = OutlineSettings()
    seen = []
    for index, view in enumerate(views):
        shape = (view.intrinsics.height_px, view.intrinsics.width_px)
        picture = read_picture(frames, index, name=name, shape=shape)
        taken = frames.background_of(index)
        if taken is None:
            background = background_of_picture(picture, frames.bit_depth)
        else:
            background = measured(taken, [picture], frames.bit_depth, name=f"{name}: background of picture {index}")
        seen.append(look(picture, background, whole(shape), settings).seen)
    return OutlineTrack(without_blurred(tuple(seen), settings))
