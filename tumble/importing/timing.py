"""When each picture was taken: the middle of its exposure, from time stamps or from the frame rate."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.errors import InputError
from datasets.video import Header, Moment, Origin, Stated
from datasets.vocabulary.clock import Clock
from tumble.importing.request import Missing, Request, Value
from tumble.importing.sources import Source

Array = NDArray[np.float64]
DISAGREE = 0.01
"""Share by which the mean rate of time stamps may differ from the stated frame rate; clocks of cameras are good to 1e-4."""
APART = 0.1
"""Share of the time between two pictures by which cameras of one flight may differ."""
RATE = Missing("frame_rate", "velocities need the time between two pictures", "--rate HZ (pictures per second, as in 4000 or 4kHz)")
EXPOSURE = Missing(
    "exposure", "a moving outline is smeared by it", "--exposure TIME (as in 20us; 0 where it is far shorter than a pixel's motion)"
)


Found = tuple[Clock | None, list[Value], list[Missing], list[str]]
"""The clock where it is known, values with where they are from, what is missing, and what is odd."""


def clock_of(sources: Sequence[Source], request: Request) -> Found:
    """What is known of when the pictures of one flight were taken.

    Raises
    ------
    InputError
        Where the cameras of one flight differ.
    """
    if len({len(source.frames) for source in sources}) > 1:
        counts = ", ".join(f"{source.path.name}: {len(source.frames)}" for source in sources)
        raise InputError(f"{sources[0].path}: expected as many pictures of every camera of a flight, got {counts}.")
    found = [_one(source, request) for source in sources]
    first = found[0]
    for source, (clock, *_) in zip(sources, found, strict=True):
        _check_alike(source, clock, first[0])
    return first


def _one(source: Source, request: Request) -> Found:
    rate, exposure = _rate(source.header, request), _exposure(source.header, request)
    missing = ([RATE] if rate is None else []) + ([EXPOSURE] if exposure is None else [])
    values = [] if rate is None else [Value("frame_rate", f"{rate.value:.10g} Hz", rate.value, rate.origin, rate.note)]
    if exposure is not None:
        values.append(Value("exposure", f"{exposure.value * 1e6:.6g} us", exposure.value, exposure.origin, exposure.note))
    if rate is None:
        return None, values, missing, []
    stamps, remarks = _stamps(source, rate, request)
    moment = _moment(source.header, request)
    values.append(
        Value("time_stamps", f"{stamps.value[0]:.9f} to {stamps.value[-1]:.9f} s", _ends(stamps.value), stamps.origin, stamps.note)
    )
    values.append(Value("stamped", f"the {moment.value} of each exposure", str(moment.value), moment.origin, moment.note))
    if exposure is None:
        return None, values, missing, remarks
    shift = 0.5 * exposure.value if moment.value is Moment.START else 0.0
    return Clock(stamps.value + shift, exposure.value), values, missing, remarks


def _ends(stamps: Array) -> list[float]:
    return [float(stamps[0]), float(stamps[-1])]


def _rate(header: Header | None, request: Request) -> Stated[float] | None:
    if request.rate_hz is not None:
        return Stated(request.rate_hz, Origin.GIVEN, "--rate")
    return None if header is None else header.rate_hz


def _exposure(header: Header | None, request: Request) -> Stated[float] | None:
    if request.exposure_s is not None:
        return Stated(request.exposure_s, Origin.GIVEN, "--exposure")
    return None if header is None else header.exposure_s


def _moment(header: Header | None, request: Request) -> Stated[Moment]:
    if request.stamped is not None:
        return Stated(request.stamped, Origin.GIVEN, "--stamps")
    if header is None:
        return Stated(Moment.MIDDLE, Origin.ASSUMED, "outlines have no stamps")
    return header.stamped


def _stamps(source: Source, rate: Stated[float], request: Request) -> tuple[Stated[Float[NDArray[np.float64], " frame"]], list[str]]:
    """Stamps (s) of the pictures that are taken; the file's own unless a rate is given, and what speaks against them."""
    header, taken = source.header, slice(source.frames.start, source.frames.stop)
    if header is None or header.stamps_s is None or request.rate_hz is not None:
        first = 0 if header is None else header.first
        evenly = (first + np.arange(source.frames.start, source.frames.stop)) / rate.value
        return Stated(evenly, rate.origin, "evenly spaced by the frame rate"), []
    stamps = header.stamps_s.value
    remarks = []
    if len(stamps) > 1:
        seen = (len(stamps) - 1) / float(stamps[-1] - stamps[0])
        if abs(seen / rate.value - 1.0) > DISAGREE:
            remarks.append(
                f"{source.path.name}: its time stamps say {seen:.6g} pictures per second, its header {rate.value:.6g}. The stamps are "
                f"used; --rate {rate.value:.6g} takes the header's. Velocities hang on it: a fall tells which is right."
            )
    return Stated(stamps[taken], header.stamps_s.origin, header.stamps_s.note), remarks


def _check_alike(source: Source, clock: Clock | None, first: Clock | None) -> None:
    if clock is None or first is None or len(first.times_s) < 2:
        return
    own, other = (each.times_s - each.times_s[0] for each in (clock, first))
    apart = float(np.abs(own - other).max())
    if apart > APART * float(np.diff(other).min()):
        raise InputError(f"{source.path}: expected the times of the flight's other camera, got ones that are up to {apart:.3g} s apart.")
