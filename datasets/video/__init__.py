"""Recordings in the files of high-speed cameras: what their headers say, and their pictures one at a time."""

from datasets.video.header import Header, Moment, Origin, Stated, Video
from datasets.video.opening import open_video

__all__ = ["Header", "Moment", "Origin", "Stated", "Video", "open_video"]
