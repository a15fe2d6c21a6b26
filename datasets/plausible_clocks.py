"""Whether the clocks of an observation can be true: each one by itself, and those of several cameras together."""

from pathlib import Path

import numpy as np

from datasets.errors import InputError
from datasets.observation import Observation
from datasets.vocabulary.clock import Clock

LONGEST_EXPOSURE_S = 1.0
MOST_RATE_SIGMA = 0.1
"""Clocks of cameras are good to 1e-4; a rate that is not known to a tenth is no stated rate."""
SIGMAS = 3.0
"""Standard deviations of its offset by which the stamps of a further camera may be off those of the first."""


def check_clocks(obs: Observation, path: Path) -> None:
    """Check every camera's clock, and that all cameras were recording at one time.

    Parameters
    ----------
    obs
        What was read.
    path
        ``observation.json``, to be named in messages.

    Raises
    ------
    InputError
        At the first thing that cannot be true.
    """
    _check_clock(obs.clock, f"{path}: at $.clock")
    if not obs.clock.known:
        raise InputError(
            f"{path}: at $.clock: expected no offset_sigma_s and no rate_sigma, since the others are told against it, got some."
        )
    for number, (camera, clock) in enumerate(zip(obs.cameras, obs.clocks, strict=True)):
        if clock is not obs.clock:
            where = f"{path}: at $.cameras[{number}].clock"
            _check_clock(clock, where)
            _check_spread(clock, where)
            _check_overlap(obs, camera.name, clock, where)


def _check_clock(clock: Clock, where: str) -> None:
    times, exposure = clock.times_s, clock.exposure_s
    backwards = np.flatnonzero(~(np.diff(times) > 0))
    if len(backwards):
        k = int(backwards[0])
        raise InputError(f"{where}.times_s[{k + 1}]: expected times that rise, got {float(times[k + 1])!r} after {float(times[k])!r}.")
    if exposure > LONGEST_EXPOSURE_S:
        raise InputError(f"{where}.exposure_s: expected seconds, got {exposure:g}; it looks like microseconds.")
    shortest = float(np.diff(times).min()) if len(times) > 1 else np.inf
    if exposure > shortest * (1 + 1e-9):
        raise InputError(
            f"{where}.exposure_s: expected at most the time between two frames ({shortest:g} s), got {exposure:g} s; "
            "one of them is in the wrong unit."
        )


def _check_spread(clock: Clock, where: str) -> None:
    lasts = float(np.ptp(clock.times_s))
    if len(clock.times_s) > 1 and clock.offset_sigma_s > lasts:
        raise InputError(
            f"{where}.offset_sigma_s: expected at most the time that the recording lasts ({lasts:g} s), got {clock.offset_sigma_s:g} s; "
            "find the frames of one event in both recordings."
        )
    if clock.rate_sigma > MOST_RATE_SIGMA:
        raise InputError(f"{where}.rate_sigma: expected at most {MOST_RATE_SIGMA:g} (1e-4 is usual), got {clock.rate_sigma:g}.")


def _check_overlap(obs: Observation, name: str, clock: Clock, where: str) -> None:
    own, first, slack = clock.times_s, obs.clock.times_s, SIGMAS * clock.offset_sigma_s
    if own[0] > first[-1] + slack or own[-1] < first[0] - slack:
        raise InputError(
            f'{where}.times_s: expected cameras that recorded at the same time, got "{name}" from {own[0]:g} to {own[-1]:g} s and '
            f'"{obs.cameras[0].name}" from {first[0]:g} to {first[-1]:g} s: their clocks do not overlap.'
        )
