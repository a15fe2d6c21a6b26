"""``tumble calibrate``: cameras, rigs and the direction of gravity, with their uncertainty and whether it is honest."""

import argparse
import json
import re
from collections.abc import Sequence
from pathlib import Path

from rich.table import Table

from datasets.calibration_files import FILE, write_calibration
from datasets.errors import InputError
from datasets.plausibility import STRONGEST_GRAVITY_MS2
from datasets.rig_files.opening import SUFFIXES, UNITS_M, Convention, is_rig_file, read_rig
from datasets.vocabulary.board import FORMS, board_of
from datasets.vocabulary.calibration import Calibration
from datasets.vocabulary.camera import HsvCamera
from estimator.calibration.fitting import RigFit
from tumble.calibrating.cameras import calibrate_camera, calibrate_rig
from tumble.calibrating.checking import check_calibration
from tumble.calibrating.gravity import calibrate_gravity, level_of, levelled
from tumble.calibrating.words import camera_rows, gravity_rows, verdict_of
from tumble.cli.console import console
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.options import Part, add_output, add_parts, run_part, verb_parser
from tumble.importing.gathering import STANDARD_GRAVITY_MS2
from tumble.output_directory import Run, output_directory
from tumble.reports.calibration_page import write_calibration_page

PAGE = "calibration.html"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "calibrate",
        description="Calibrate cameras from pictures of a flat board, rigs of several cameras, and the direction of gravity.\n"
        "Each part writes calibration.json, which `tumble import --camera` and `--gravity` take, and a page.",
        example="tumble calibrate camera boards --board charuco:12x9:5mm:3.7mm:DICT_5X5_250 --out out/camera",
    )
    for part in add_parts(verb, PARTS):
        part.add_argument("--json", action="store_true", help="print the result as JSON on standard output")
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Run one part."""
    return run_part(arguments, PARTS)


def _board_option(part: argparse.ArgumentParser) -> None:
    part.add_argument("--board", required=True, metavar="BOARD", help=FORMS)


def _camera_options(part: argparse.ArgumentParser) -> None:
    part.add_argument("pictures", type=Path, nargs="+", metavar="BOARD", help="pictures of the board: files, folders, stacks, films")
    _board_option(part)
    add_output(part, default="out/camera")


def _camera(arguments: argparse.Namespace) -> int:
    board = board_of(arguments.board)
    content = {"pictures": [str(path.resolve()) for path in arguments.pictures], "board": board.words}
    described = Run("calibrate camera", content, reads=tuple(arguments.pictures))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        made = calibrate_camera(arguments.pictures, board)
        _write(made.calibration, made.fit, out)
    return say(made.calibration, arguments)


def _rig_options(part: argparse.ArgumentParser) -> None:
    part.add_argument(
        "cameras",
        type=Path,
        nargs="+",
        metavar="CAMERA",
        help=f"with --board: a folder, stack or film for each, pictures of one number belong together; else files: {', '.join(SUFFIXES)}",
    )
    part.add_argument("--board", metavar="BOARD", help=FORMS)
    part.add_argument("--unit", choices=tuple(UNITS_M), default="m", help="files of others: of lengths (default: %(default)s)")
    part.add_argument("--size", type=_size, metavar="WIDTHxHEIGHT", help="files of others: of pictures, where they do not say it")
    part.add_argument(
        "--first-pixel", type=int, choices=(0, 1), help="files of others: what the first pixel is called (default: 1 for .mat, else 0)"
    )
    add_output(part, default="out/rig")


def _size(text: str) -> tuple[int, int]:
    found = re.fullmatch(r"([1-9][0-9]{0,4})x([1-9][0-9]{0,4})", text)
    if found is None:
        raise argparse.ArgumentTypeError(f"expected WIDTHxHEIGHT, as in 1024x768, got {text}")
    return int(found[1]), int(found[2])


def _rig(arguments: argparse.Namespace) -> int:
    board = None if arguments.board is None else board_of(arguments.board)
    convention = Convention(arguments.unit, arguments.size, arguments.first_pixel)
    content = {"cameras": [str(path.resolve()) for path in arguments.cameras], "board": board and board.words, **vars(convention)}
    described = Run("calibrate rig", content, reads=tuple(arguments.cameras))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        if board is not None:
            made = calibrate_rig(arguments.cameras, board)
            calibration, fit = made.calibration, made.fit
        else:
            cameras, notes = _read(arguments.cameras, convention)
            calibration, fit = Calibration(cameras=cameras, notes=notes), None
        _write(calibration, fit, out)
    return say(calibration, arguments)


def _read(paths: Sequence[Path], convention: Convention) -> tuple[tuple[HsvCamera, ...], tuple[str, ...]]:
    for path in paths:
        if not path.exists():
            raise InputError(f"{path}: there is no such file or folder.")
        if not is_rig_file(path):
            raise InputError(f"{path}: expected --board BOARD with pictures, or files of others ({', '.join(SUFFIXES)}), got neither.")
    return read_rig(paths, convention)


def _gravity_options(part: argparse.ArgumentParser) -> None:
    part.add_argument(
        "pictures",
        type=Path,
        nargs="*",
        metavar="PICTURE",
        help="of a plumb line; of a rig a file or folder for each camera; or one CSV file with the columns camera,line,x_px,y_px",
    )
    part.add_argument("--camera", type=Path, metavar="CALIBRATION", help="with pictures: the calibrated camera or rig")
    part.add_argument(
        "--level",
        metavar="PITCH,ROLL±SIGMA",
        help="in the place of pictures: readings in degrees of a level on the (first) camera, as in 0.4,-0.1±0.05; PITCH: it looks up, "
        "ROLL: its right side, seen from behind, is low",
    )
    part.add_argument(
        "--strength", type=float, default=STANDARD_GRAVITY_MS2, metavar="MS2", help="of gravity where you are (default: %(default)s)"
    )
    add_output(part, default="out/gravity")


def _gravity(arguments: argparse.Namespace) -> int:
    if not 0 < arguments.strength <= STRONGEST_GRAVITY_MS2:
        raise InputError(f"--strength {arguments.strength:g}: expected m/s2, as 9.81, got another value.")
    seen = bool(arguments.pictures) and arguments.camera is not None
    if seen == (arguments.level is not None) or bool(arguments.pictures) != (arguments.camera is not None):
        form = "pictures of a plumb line with --camera, or --level PITCH,ROLL±SIGMA"
        raise InputError(f"calibrate gravity: expected {form}, got neither or both.")
    level = None if arguments.level is None else level_of(arguments.level)
    content = {"pictures": [str(p.resolve()) for p in arguments.pictures], "camera": None if level else str(arguments.camera.resolve())}
    content |= {"level": arguments.level, "strength": arguments.strength}
    described = Run("calibrate gravity", content, reads=() if level else (*arguments.pictures, arguments.camera))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        made = levelled(level, arguments.strength) if level else calibrate_gravity(arguments.pictures, arguments.camera, arguments.strength)
        _write(made, None, out)
    return say(made, arguments)


def _check_options(part: argparse.ArgumentParser) -> None:
    part.add_argument("calibration", type=Path, metavar="CALIBRATION", help="what `tumble calibrate` wrote, or a camera's file")
    part.add_argument("pictures", type=Path, nargs="*", metavar="BOARD", help="further pictures of a board; of a rig a folder each")
    part.add_argument("--board", metavar="BOARD", help=f"where it is not that of the calibration: {FORMS}")
    add_output(part, default="out/calibration_check")


def _check(arguments: argparse.Namespace) -> int:
    content = {"calibration": str(arguments.calibration.resolve()), "pictures": [str(p.resolve()) for p in arguments.pictures]}
    described = Run("calibrate check", {**content, "board": arguments.board}, reads=(arguments.calibration, *arguments.pictures))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        checked = check_calibration(arguments.calibration, arguments.pictures, arguments.board)
        write_calibration_page(checked.calibration, checked.fit, out / PAGE, extra=checked.rows)
    if arguments.json:
        found = checked.agreement
        figures = None if found is None else {"held_px": found.held_px, "free_px": found.free_px, **vars(found.test)}
        print(json.dumps({"good": checked.good, "pictures": figures}))
    elif not arguments.quiet:
        _say_calibration(checked.calibration, arguments)
        for name, text in checked.rows.items():
            console().print(f"{name}: {text}", soft_wrap=True)
    return ALL_MEASURED if checked.good else INCOMPLETE


def _write(calibration: Calibration, fit: RigFit | None, out: Path) -> None:
    """The page first: ``calibration.json`` says that all is there."""
    write_calibration_page(calibration, fit, out / PAGE)
    write_calibration(calibration, out / FILE)


def say(calibration: Calibration, arguments: argparse.Namespace) -> int:
    """Print the calibration."""
    if arguments.json:
        print((arguments.out / FILE).read_text(encoding="utf-8"), end="")
    elif not arguments.quiet:
        _say_calibration(calibration, arguments)
    return ALL_MEASURED


def _say_calibration(calibration: Calibration, arguments: argparse.Namespace) -> None:
    for c, camera in enumerate(calibration.cameras):
        _table(f"camera {camera.name}", camera_rows(calibration, c))
    if calibration.gravity_world is not None:
        _table("gravity", gravity_rows(calibration))
    for sentence in (verdict_of(calibration), *(f"note: {note}" for note in calibration.notes)):
        console().print(sentence, soft_wrap=True)
    console().print(f"page: {arguments.out / PAGE}", soft_wrap=True)


def _table(title: str, rows: list[tuple[str, str, str]]) -> None:
    table = Table(title=title, title_justify="left")
    for heading in ("parameter", "value", "standard deviation"):
        table.add_column(heading)
    for row in rows:
        table.add_row(*row)
    console().print(table)


PARTS: tuple[Part, ...] = (
    ("camera", "one camera from pictures of a board", _camera_options, _camera),
    ("rig", "several cameras, with their poses, from a board that they see at once, or from files of others", _rig_options, _rig),
    ("gravity", "the direction of gravity from pictures of a plumb line, or from a level", _gravity_options, _gravity),
    ("check", "a calibration: whether its uncertainty is honest, and whether further pictures agree with it", _check_options, _check),
)
