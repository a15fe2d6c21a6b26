"""``tumble calibrate``: cameras, rigs and the direction of gravity, with their uncertainty and whether it is honest."""

import argparse
from collections.abc import Callable
from pathlib import Path

from rich.table import Table

from datasets.calibration_files import FILE, write_calibration
from datasets.vocabulary.board import FORMS, board_of
from datasets.vocabulary.calibration import Calibration
from estimator.calibration.fitting import RigFit
from tumble.calibrating.cameras import calibrate_camera, calibrate_rig
from tumble.calibrating.words import camera_rows, gravity_rows, verdict_of
from tumble.cli.console import console
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.options import add_output, verb_parser
from tumble.output_directory import Run, output_directory
from tumble.reports.calibration_page import write_calibration_page

Part = tuple[str, str, Callable[[argparse.ArgumentParser], None], Callable[[argparse.Namespace], int]]
PAGE = "calibration.html"


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "calibrate",
        description="Calibrate cameras from pictures of a flat board, rigs of several cameras, and the direction of gravity.\n"
        "Each part writes calibration.json, which `tumble import --camera` and `--gravity` take, and a page.",
        example="tumble calibrate camera boards --board charuco:12x9:5mm:3.7mm:DICT_5X5_250 --out out/camera",
    )
    parts = verb.add_subparsers(dest="part", required=True, metavar="PART")
    for name, text, options, _ in PARTS:
        part = parts.add_parser(name, help=text, description=text)
        options(part)
        part.add_argument("--json", action="store_true", help="print the result as JSON on standard output")
        part.add_argument("-v", "--verbose", action="store_true", help="say more; show the traceback of an error")
        part.add_argument("-q", "--quiet", action="store_true", help="no progress and no tables; errors only")
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Run one part."""
    return {name: action for name, _, _, action in PARTS}[arguments.part](arguments)


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
        "cameras", type=Path, nargs="+", metavar="CAMERA", help="a folder, stack or film for each; pictures of one number belong together"
    )
    _board_option(part)
    add_output(part, default="out/rig")


def _rig(arguments: argparse.Namespace) -> int:
    board = board_of(arguments.board)
    content = {"cameras": [str(path.resolve()) for path in arguments.cameras], "board": board.words}
    described = Run("calibrate rig", content, reads=tuple(arguments.cameras))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        made = calibrate_rig(arguments.cameras, board)
        _write(made.calibration, made.fit, out)
    return say(made.calibration, arguments)


def _write(calibration: Calibration, fit: RigFit | None, out: Path) -> None:
    """The page first: ``calibration.json`` says that all is there."""
    write_calibration_page(calibration, fit, out / PAGE)
    write_calibration(calibration, out / FILE)


def say(calibration: Calibration, arguments: argparse.Namespace) -> int:
    """Print the calibration; exit code 1 where its uncertainty had to be widened."""
    check = None if calibration.fit is None else calibration.fit.cross_validation
    if arguments.json:
        print((arguments.out / FILE).read_text(encoding="utf-8"), end="")
    elif not arguments.quiet:
        for c, camera in enumerate(calibration.cameras):
            _table(f"camera {camera.name}", camera_rows(calibration, c))
        if calibration.gravity_world is not None:
            _table("gravity", gravity_rows(calibration))
        for sentence in (verdict_of(calibration), *(f"note: {note}" for note in calibration.notes)):
            console().print(sentence, soft_wrap=True)
        console().print(f"page: {arguments.out / PAGE}", soft_wrap=True)
    return ALL_MEASURED if check is None or check.honest else INCOMPLETE


def _table(title: str, rows: list[tuple[str, str, str]]) -> None:
    table = Table(title=title, title_justify="left")
    for heading in ("parameter", "value", "standard deviation"):
        table.add_column(heading)
    for row in rows:
        table.add_row(*row)
    console().print(table)


PARTS: tuple[Part, ...] = (
    ("camera", "one camera from pictures of a board", _camera_options, _camera),
    ("rig", "several cameras, with their poses, from a board that they see at once", _rig_options, _rig),
)
