"""``tumble import``: a laboratory's own recordings become observations."""

import argparse
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from datasets.video import Moment
from datasets.video.header import FASTEST_HZ, SLOWEST_HZ
from datasets.video.photron import SIDE_CARS
from tumble.cli.check_words import check_code, check_next, say_check, say_values
from tumble.cli.console import console
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE
from tumble.cli.options import add_engine, add_output, executor_of, verb_parser
from tumble.cli.outcomes import report_failures
from tumble.commands import command
from tumble.engine import Outcome, State
from tumble.importing.gathering import gather
from tumble.importing.importing import flights_of, import_all, plain_request
from tumble.importing.request import PARTS, UNITS_HZ, UNITS_S, Request, frame_range, quantity
from tumble.output_directory import Run, output_directory
from tumble.read_paths import paths_given


def parser() -> argparse.ArgumentParser:
    """The verb's options."""
    verb = verb_parser(
        "import",
        description="Make observations of recordings: Phantom .cine, Photron .mraw with .cihx or .cih, TIFF stacks, folders of pictures\n"
        "(TIFF, PNG, BMP, PGM, JPEG), films (AVI, MP4, MOV; FFV1 without loss), masks (--masks) and outlines (.npz).\n"
        "Every value says where it is from: read from the file, given here, or assumed. Where something is missing, a draft\n"
        "says what to type (exit code 1). A page shows the outlines over the frames before anything is fitted; what speaks against a\n"
        "measurement is named (exit code 1).\n"
        "Each VIDEO is a flight of its own; with one --camera for each, all of them are cameras of one flight.",
        example="tumble import drop.cine --camera camera.toml --particle out/stone --gravity down --out out/run",
    )
    verb.add_argument("videos", type=Path, nargs="+", metavar="VIDEO", help="a recording's file, or a folder of pictures")
    verb.add_argument("--frames", default=":", metavar="FIRST:END", help="pictures to take, counted from 0, END not included: 120:340")
    verb.add_argument(
        "--background",
        default="auto",
        metavar="auto|FILE|first:N",
        help="the picture without the particle: modelled from the recording, a file, or the median of the first N pictures (default: auto)",
    )
    verb.add_argument("--camera", type=Path, action="append", default=[], metavar="FILE", help="the camera's calibration")
    verb.add_argument("--particle", type=Path, metavar="FOLDER", help="what tumble shape wrote, or an observation with views")
    verb.add_argument("--gravity", metavar="down|X,Y,Z|FILE", help="gravity in the first camera's frame, m/s2; down: along the columns")
    verb.add_argument("--rate", metavar="HZ", help="pictures per second, where the file does not say or is wrong: 4000, 4kHz")
    verb.add_argument("--exposure", metavar="TIME", help="length of an exposure, where the file does not say: 20us")
    verb.add_argument("--bits", type=int, choices=range(1, 17), metavar="N", help="bits that carry signal, where the file does not say")
    verb.add_argument("--stamps", choices=[moment.value for moment in Moment], help="what of an exposure the file's time stamps name")
    verb.add_argument(
        "--clock-sigma",
        metavar="TIME",
        help="how well the clocks of further cameras are known against the first one's: 20us (default: exactly)",
    )
    verb.add_argument(
        "--length-sigma",
        metavar="SHARE",
        help="how well lengths of the particle's views are known, as the squares of a printed board: 0.1%% (default: exactly)",
    )
    verb.add_argument(
        "--focal-sigma",
        metavar="SHARE",
        help="how well a focal length is known of which the camera's file does not say it: 1%% (default: exactly)",
    )
    verb.add_argument("--masks", action="store_true", help="the pictures are masks: bright where the particle is")
    verb.add_argument("--dry-run", action="store_true", help="print what the headers say and what is missing; decode and write nothing")
    add_output(verb, default="out/run")
    add_engine(verb)
    return verb


def run(arguments: argparse.Namespace) -> int:
    """Import and check; exit code 1 where something is missing, a recording failed, or something speaks against a measurement."""
    request = request_of(arguments)
    flights = flights_of(arguments.videos, request)
    if arguments.dry_run:
        return _dry_run(flights, request, arguments)
    content = {"videos": [str(video.resolve()) for video in arguments.videos], **plain_request(request)}
    described = Run("import", content, reads=_reads(arguments))
    with output_directory(arguments.out, described, resume=arguments.resume, force=arguments.force) as out:
        outcomes = import_all(
            flights, request, out, command=_whole_command(arguments), executor=executor_of(arguments), quiet=arguments.quiet
        )
        report_failures(out, outcomes, verbose=arguments.verbose)
    missing = any(outcome.result.get("missing") for outcome in outcomes)
    _say(outcomes, arguments)
    return max(check_code(outcomes), INCOMPLETE if missing else ALL_MEASURED)


def request_of(arguments: argparse.Namespace) -> Request:
    """The options as a request."""
    return Request(
        frames=frame_range(arguments.frames),
        background=arguments.background,
        cameras=tuple(arguments.camera),
        particle=arguments.particle,
        gravity=arguments.gravity,
        rate_hz=None if arguments.rate is None else _rate(arguments.rate),
        exposure_s=None if arguments.exposure is None else quantity("--exposure", arguments.exposure, UNITS_S),
        bits=arguments.bits,
        stamped=None if arguments.stamps is None else Moment(arguments.stamps),
        masks=arguments.masks,
        length_sigma=None if arguments.length_sigma is None else quantity("--length-sigma", arguments.length_sigma, PARTS) or None,
        focal_sigma=None if arguments.focal_sigma is None else quantity("--focal-sigma", arguments.focal_sigma, PARTS) or None,
        clock_sigma_s=0.0 if arguments.clock_sigma is None else quantity("--clock-sigma", arguments.clock_sigma, UNITS_S),
    )


def _rate(text: str) -> float:
    rate = quantity("--rate", text, UNITS_HZ)
    if not SLOWEST_HZ <= rate <= FASTEST_HZ:
        raise InputError(f"--rate {text}: expected {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz, got {rate:g}.")
    return rate


def _reads(arguments: argparse.Namespace) -> tuple[Path, ...]:
    """Every file that is read, those beside the videos included."""
    beside = [video.with_suffix(suffix) for video in arguments.videos for suffix in (".mraw", *SIDE_CARS) if not video.is_dir()]
    stated = [Path(said) for said in (arguments.background, arguments.gravity) if said and Path(said).exists()]
    return (*arguments.videos, *(path for path in beside if path.exists()), *arguments.camera, *stated, *paths_given(arguments.particle))


def _dry_run(flights: Sequence[tuple[Path, ...]], request: Request, arguments: argparse.Namespace) -> int:
    """Headers and what is missing."""
    found = [gather(flight, request, decode=False) for flight in flights]
    if arguments.json:
        plain = [
            {
                "name": each.name,
                "values": [{"name": v.name, "value": v.plain, "origin": v.origin.value, "note": v.note} for v in each.values],
                "missing": [vars(missing) for missing in each.missing],
                "remarks": list(each.remarks),
            }
            for each in found
        ]
        print(json.dumps(plain))
    elif not arguments.quiet:
        for each in found:
            rows = [{"name": v.name, "value": v.shown, "origin": v.origin.value, "note": v.note} for v in each.values]
            say_values(each.name, rows)
            _say_missing([vars(missing) for missing in each.missing])
            for remark in each.remarks:
                console().print(f"note: {remark}", soft_wrap=True)
    return ALL_MEASURED


def _say_missing(missing: Sequence[dict[str, Any]]) -> None:
    for each in missing:
        console().print(f"missing: {each['name'].replace('_', ' ')} ({each['why']}). Type: {each['what_to_type']}", soft_wrap=True)


def _whole_command(arguments: argparse.Namespace) -> str:
    """The command that completes a draft, with what is to be filled in written large."""
    words = [*map(str, (video.resolve() for video in arguments.videos)), "--out", str(arguments.out), "--force"]
    for option in ("frames", "background", "rate", "exposure", "bits", "stamps"):
        said = getattr(arguments, option)
        if said not in (None, ":", "auto"):
            words += [f"--{option}", str(said)]
    words += ["--masks"] if arguments.masks else []
    words += [] if arguments.clock_sigma is None else ["--clock-sigma", arguments.clock_sigma]
    words += [] if arguments.length_sigma is None else ["--length-sigma", arguments.length_sigma]
    words += [] if arguments.focal_sigma is None else ["--focal-sigma", arguments.focal_sigma]
    cameras = [str(path) for path in arguments.camera] or ["CAMERA"]
    words += [word for camera in cameras for word in ("--camera", camera)]
    words += ["--particle", str(arguments.particle or "PARTICLE"), f"--gravity={arguments.gravity or 'down'}"]
    return command("import", *words)


def _say(outcomes: Sequence[Outcome], arguments: argparse.Namespace) -> None:
    made = [outcome for outcome in outcomes if outcome.state is not State.FAILED]
    whole = [outcome for outcome in made if not outcome.result.get("missing")]
    if arguments.json:
        print(json.dumps([{"item": outcome.name, "state": outcome.state.value, **outcome.result} for outcome in outcomes]))
        return
    if arguments.quiet:
        return
    out = console()
    for outcome in made:
        if outcome.state is State.DONE:
            say_check(outcome.result, with_values=True)
            _say_missing(outcome.result["missing"])
        out.print(f"page: {arguments.out / f'{outcome.name}.check.html'}", soft_wrap=True)
    if len(whole) < len(made):
        out.print(f"to complete the draft, type: {_whole_command(arguments)}", soft_wrap=True)
    if whole:
        own = arguments.out.parent / f"{arguments.out.resolve().name}_estimates"  # of this import: others may lie beside it
        out.print(check_next(whole, command("estimate", arguments.out, "--out", own)), soft_wrap=True)
