"""When each picture was taken: the middle of its exposure, from time stamps or from the frame rate."""

from collections.abc import Sequence
from dataclasses import replace

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
RATE = Missing("frame_rate", "velocities need the time between two pictures", "--rate HZ (pictures per second, as in 4000 or 4kHz)")
EXPOSURE = Missing(
    "exposure", "a moving outline is smeared by it", "--exposure TIME (as in 20us; 0 where it is far shorter than a pixel's motion)"
)


Found = tuple[Clock | None, list[Value], list[Missing], list[str]]
"""The clock where it is known, values with where they are from, what is missing, and what is odd."""
AllFound = tuple[tuple[Clock, ...], list[Value], list[Missing], list[str]]
"""The same of all cameras of a flight: a clock for each, none where the first one's is not known."""


def clocks_of(sources: Sequence[Source], request: Request) -> AllFound:
    """What is known of when the pictures of one flight were taken; a further camera without times of its own has the first one's.

    Raises
    ------
    InputError
        Where such a camera has another number of pictures.
    """
    first, values, missing, remarks = _one(sources[0], request)
    if first is None:
        return (), values, missing, remarks
    clocks = [first]
    for number, source in enumerate(sources[1:], start=2):
        timed = _says_when(source)
        if not timed and len(source.frames) != len(first.times_s):
            raise InputError(
                f"{source.path}: expected as many pictures as the flight's first camera took ({len(first.times_s)}), since the file does "
                f"not say when they were taken, got {len(source.frames)}."
            )
        exposed = request if _exposure(source.header, request) else replace(request, exposure_s=first.exposure_s)
        own, _, _, more = _one(source, exposed) if timed else (first, [], [], [])
        clock = replace(own or first, offset_sigma_s=request.clock_sigma_s)
        clocks.append(clock)
        values += [] if _alike(clock, first) else [_clock_value(number, clock, not timed)]
        remarks = [*remarks, *more]
    return tuple(clocks), values, missing, remarks


def _says_when(source: Source) -> bool:
    """Whether a file says when its pictures were taken: by stamps, or by a rate and the number of its first picture from the trigger."""
    return source.header is not None and (source.header.stamps_s is not None or source.header.rate_hz is not None)


def own_clocks(clocks: tuple[Clock, ...]) -> tuple[Clock, ...]:
    """The clocks of all cameras where they are not all that of the first one; none where they are."""
    return () if all(_alike(clock, clocks[0]) for clock in clocks) else clocks


def _alike(clock: Clock, first: Clock) -> bool:
    return clock.known and clock.exposure_s == first.exposure_s and np.array_equal(clock.times_s, first.times_s)


def _clock_value(number: int, clock: Clock, taken: bool) -> Value:
    """What is told of a further camera's clock; ``taken`` from the first one."""
    ends = _ends(clock.times_s)
    sure = "" if clock.known else f" ± {clock.offset_sigma_s * 1e6:.6g} us against the first camera's"
    note = "that of the first camera" if taken else "its own stamps"
    origin = Origin.ASSUMED if taken else Origin.READ
    return Value(f"clock_of_hsv_{number}", f"{ends[0]:.9f} to {ends[1]:.9f} s{sure}", ends, origin, note)


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
