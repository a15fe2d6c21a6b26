"""Pictures of targets: single files, folders, stacks and films, as 8 bit grey with a name for messages."""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.video import open_video
from datasets.video.images import SUFFIXES, read_image
from datasets.vocabulary.board import Board
from estimator.calibration.sighting import BoardSighting, find_board

MOST_PICTURES = 1000
"""Of a camera; a film of thousands holds the same board again and again: take every tenth picture."""
WHITE_SHARE, WHITE_DN = 99.5, 230.0
"""Pictures deeper than 8 bit: this percentile of the grey values becomes this one of 255."""


@dataclass(frozen=True)
class Target:
    """One picture: ``name`` for messages, whether it was ``alone`` on the command line, 8 bit ``grey`` (height, width)."""

    name: str
    alone: bool
    grey: NDArray[np.uint8]


def targets_in(paths: Sequence[Path]) -> list[Target]:
    """All pictures of files, folders and recordings, in order.

    Raises
    ------
    InputError
        Where one cannot be read, sizes differ, or two are the same.
    """
    targets = [target for path in paths for target in _targets(path)]
    if len(targets) > MOST_PICTURES:
        raise InputError(f"{paths[0]}: expected at most {MOST_PICTURES} pictures of a camera, got {len(targets)}.")
    for target in targets:
        if target.grey.shape != targets[0].grey.shape:
            (height, width), (h, w) = targets[0].grey.shape, target.grey.shape
            raise InputError(f"{target.name}: expected {width} x {height} px as in {targets[0].name}, got {w} x {h}.")
    _refuse_twice(targets)
    return targets


def _targets(path: Path) -> Iterable[Target]:
    if not path.exists():
        raise InputError(f"{path}: there is no such file.")
    if path.suffix.lower() in SUFFIXES and not path.is_dir():
        return [Target(str(path), True, _grey(read_image(path), deep=False))]
    video = open_video(path)
    if video.header.count > MOST_PICTURES:
        raise InputError(f"{path}: expected at most {MOST_PICTURES} pictures of a camera, got {video.header.count}.")
    deep = video.header.bit_depth.value > 8
    count = video.header.count
    names = [str(path)] if count == 1 else [f"{path}, picture {k}" for k in range(count)]
    return [Target(name, count == 1, _grey(video.read(k), deep=deep)) for k, name in enumerate(names)]


def _grey(picture: NDArray[np.uint16], *, deep: bool) -> NDArray[np.uint8]:
    """Eight bits of a picture."""
    values = picture.astype(np.float64)
    if deep or values.max() > 255:
        values *= WHITE_DN / max(float(np.percentile(values, WHITE_SHARE)), 1.0)
    return np.clip(np.rint(values), 0, 255).astype(np.uint8)


def _refuse_twice(targets: Sequence[Target]) -> None:
    seen: dict[bytes, str] = {}
    for target in targets:
        digest = hashlib.sha256(target.grey.tobytes()).digest()
        if digest in seen:
            raise InputError(f"{target.name}: expected pictures that differ, got the same as {seen[digest]}; it would count twice.")
        seen[digest] = target.name


def sightings_of(targets: Sequence[Target], board: Board, camera: int = 0) -> tuple[tuple[BoardSighting, ...], tuple[str, ...]]:
    """What a camera sees of the board, numbered by pictures, and the names of pictures without it.

    Raises
    ------
    InputError
        Where none shows the board.
    """
    found = [find_board(target.grey, board) for target in targets]
    sightings = tuple(BoardSighting(camera, k, ids, points) for k, (ids, points) in enumerate(found) if len(ids))
    without = tuple(target.name for target, (ids, _) in zip(targets, found, strict=True) if len(ids) == 0)
    if not sightings:
        more = f" and {len(without) - 1} more" if len(without) > 1 else ""
        raise InputError(f"{without[0]}{more}: expected a picture of the board {board.words}, got none that shows it; is --board right?")
    return sightings, without
