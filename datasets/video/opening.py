"""Which reader a recording's file or folder needs, by the end of its name."""

from collections.abc import Callable, Mapping
from pathlib import Path

from datasets.errors import InputError
from datasets.trajectory_files import is_trajectory
from datasets.video.film import SUFFIXES as FILM_SUFFIXES
from datasets.video.film import read_film
from datasets.video.header import Video
from datasets.video.images import TIFF_SUFFIXES, read_image_folder, read_tiff
from datasets.video.phantom import read_cine
from datasets.video.photron import SIDE_CARS, read_mraw

READERS: Mapping[str, Callable[[Path], Video]] = {
    ".cine": read_cine,
    **dict.fromkeys((".mraw", *SIDE_CARS), read_mraw),
    **dict.fromkeys(TIFF_SUFFIXES, read_tiff),
    **dict.fromkeys(FILM_SUFFIXES, read_film),
}


def open_video(path: Path) -> Video:
    """Open a recording: its header is read and checked, pictures when they are asked for.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    if not path.exists():
        raise InputError(f"{path}: there is no such file or folder.")
    if path.is_dir():
        return read_image_folder(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        known = ", ".join(READERS)
        came = path.suffix or "a name without an ending"
        needless = "; trajectories need no import: tumble diagnose takes them" if is_trajectory(path) else ""
        raise InputError(f"{path}: expected a recording ({known}) or a folder of pictures, got {came}{needless}.")
    return reader(path)
