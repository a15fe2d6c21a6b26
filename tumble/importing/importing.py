"""``tumble import`` over several flights, one item each: an observation, or a draft where something is missing, and a page to look at."""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from datasets.atomic_files import temporary_beside, write_failure
from datasets.errors import InputError
from datasets.observation_files import FILE, read_observation, write_observation
from datasets.plausibility import check_observation
from datasets.video import Moment
from estimator.readiness import inspect_recording
from tumble.checking.checked import Check, camera_check, plain_check
from tumble.checking.geometry import geometry_of
from tumble.engine import Executor, Item, Outcome, run
from tumble.importing.draft import DRAFT_FILE, IMPORT_FILE, write_values
from tumble.importing.gathering import Gathered, flight_name, gather
from tumble.importing.pulsed import Pulse, pulsed
from tumble.importing.request import Request
from tumble.progress import PULSE, progress
from tumble.reports.check_page import write_check_page

OBSERVATIONS = "observations"
PASSES = 3
"""How often an import reads a picture: to write it, to outline it, to count what is saturated."""


def flights_of(videos: Sequence[Path], request: Request) -> list[tuple[Path, ...]]:
    """Which videos are one flight: each by itself, or all of them where each has a calibration of its own.

    Raises
    ------
    InputError
        Where numbers do not fit, or two flights would have one name.
    """
    together = len(videos) > 1 and len(request.cameras) == len(videos)
    if not together and len(request.cameras) > 1:
        raise InputError(
            f"--camera: expected one calibration for all videos, or one for each of the {len(videos)} cameras of one flight, "
            f"got {len(request.cameras)}."
        )
    flights: list[tuple[Path, ...]] = [tuple(videos)] if together else [(video,) for video in videos]
    names = [flight_name(flight) for flight in flights]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"{name}: expected recordings with names of their own, got {names.count(name)} that become {name!r}.")
    return flights


def import_all(
    flights: Sequence[tuple[Path, ...]], request: Request, out: Path, *, command: str, executor: Executor, quiet: bool
) -> tuple[Outcome, ...]:
    """Import every flight that ``out`` lacks; ``command`` completes a draft."""
    drafts = [out / (DRAFT_FILE if len(flights) == 1 else f"{flight_name(flight)}.{DRAFT_FILE}") for flight in flights]
    items = [_item(flight, request, out, {"draft": d, "command": command}) for flight, d in zip(flights, drafts, strict=True)]
    with progress("import", len(items), quiet=quiet, pulses=out) as advance:
        return run(import_item, items, executor=executor, advance=advance)


def import_item(payload: dict[str, Any]) -> dict[str, Any]:
    """Import one flight: write its observation or draft, and its page."""
    pulse = Path(payload["pulse"])
    try:
        return _imported(payload, pulse)
    finally:
        pulse.unlink(missing_ok=True)


def _imported(payload: dict[str, Any], path: Path) -> dict[str, Any]:
    gathered = gather([Path(video) for video in payload["videos"]], _request(payload["request"]))
    folder = Path(payload["folder"])
    pulse = Pulse(path, PASSES * sum(len(source.frames) for source in gathered.sources))
    if gathered.observation is None:
        write_values(Path(payload["draft"]), gathered.values, gathered.missing, payload["command"])
    else:
        check_observation(gathered.observation, gathered.sources[0].path)
        counted = tuple(pulsed(recording, pulse) for recording in gathered.observation.recordings)
        with folder_whole(folder) as temporary:
            write_values(temporary / IMPORT_FILE, gathered.values, (), "")
            write_observation(replace(gathered.observation, recordings=counted), temporary)
    check = checked(gathered, folder, pulse)
    write_check_page(check, Path(payload["page"]))
    return {"missing": [vars(missing) for missing in gathered.missing], **plain_check(check)}


@contextmanager
def folder_whole(folder: Path) -> Iterator[Path]:
    """Hand out a temporary folder beside ``folder``; rename it when the block ends well, remove it otherwise."""
    temporary = temporary_beside(folder)
    shutil.rmtree(temporary, ignore_errors=True)
    try:
        temporary.mkdir(parents=True)
        yield temporary
        temporary.replace(folder)
    except OSError as error:
        raise write_failure(folder, error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        with suppress(OSError):  # other observations are in it
            folder.parent.rmdir()


def checked(gathered: Gathered, folder: Path, pulse: Pulse) -> Check:
    """The check of what was gathered; an observation's pictures are read from its own folder, and counted."""
    observation = read_observation(folder) if gathered.observation is not None else None
    recordings = [source.recording for source in gathered.sources] if observation is None else observation.recordings
    cameras = []
    for number, (source, recording) in enumerate(zip(gathered.sources, recordings, strict=True)):
        name = "hsv" if len(gathered.sources) == 1 else f"hsv_{number + 1}"
        size = source.size_px if source.size_px is not None else _calibrated_size(gathered, number)
        clock = gathered.clocks[number] if gathered.clocks else None
        times, exposure = (None, None) if clock is None else (clock.times_s, clock.exposure_s)
        inspection = inspect_recording(pulsed(recording, pulse), size, times_s=times, exposure_s=exposure, name=str(source.path))
        cameras.append(camera_check(name, recording, inspection))
    geometry = None if observation is None else geometry_of(observation, [each.inspection for each in cameras])
    return Check(gathered.name, tuple(cameras), geometry, gathered.values, gathered.missing, gathered.remarks)


def _calibrated_size(gathered: Gathered, number: int) -> tuple[int, int]:
    """Of outlines, whose file does not say how large the picture was."""
    if not gathered.cameras:
        return (1 << 16, 1 << 16)
    lens = gathered.cameras[number].intrinsics
    return lens.width_px, lens.height_px


def _item(flight: tuple[Path, ...], request: Request, out: Path, draft: dict[str, Any]) -> Item:
    """``draft``: where one would lie, and the command that completes it."""
    name = flight_name(flight)
    folder = out / OBSERVATIONS / name
    payload = {
        "videos": list(flight),
        "request": plain_request(request),
        "folder": folder,
        "page": out / f"{name}.check.html",
        "pulse": out / f"{name}{PULSE}",
        **draft,
    }
    return Item(name, payload, folder / FILE, apart=("command",))


def plain_request(request: Request) -> dict[str, Any]:
    """A request as JSON-compatible values, paths made absolute."""
    return {
        **vars(request),
        "frames": list(request.frames),
        "cameras": [str(path.resolve()) for path in request.cameras],
        "particle": None if request.particle is None else str(request.particle.resolve()),
        "stamped": None if request.stamped is None else request.stamped.value,
    }


def _request(plain: dict[str, Any]) -> Request:
    first, end = plain["frames"]
    return replace(
        Request(**{**plain, "frames": (first, end)}),
        cameras=tuple(Path(path) for path in plain["cameras"]),
        particle=None if plain["particle"] is None else Path(plain["particle"]),
        stamped=None if plain["stamped"] is None else Moment(plain["stamped"]),
    )
