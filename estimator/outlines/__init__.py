"""Frames to outlines: background model, sub-pixel contour, the particle tracked through the sequence."""

from estimator.outlines.recording import outlines_of, view_outlines_of
from estimator.outlines.result import FrameOutline, FrameStatus, OutlineTrack
from estimator.outlines.settings import OutlineSettings
from estimator.outlines.track import extract_outlines
from estimator.outlines.views import extract_view_outlines

__all__ = [
    "FrameOutline",
    "FrameStatus",
    "OutlineSettings",
    "OutlineTrack",
    "extract_outlines",
    "extract_view_outlines",
    "outlines_of",
    "view_outlines_of",
]
