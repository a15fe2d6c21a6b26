"""What a status means, and what a person may do next, in plain words."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

from datasets.estimate import Estimate, Status
from datasets.observation import COMPANION
from datasets.vocabulary.effects import in_words, whose
from estimator.diagnosis.selection.names import JOINED

MEANING: dict[Status, str] = {
    Status.CONVERGED: "The fit converged. The numbers below are a measurement; the intervals say how good it is.",
    Status.AMBIGUOUS: "Two or more motions explain the pictures almost equally well. The best is shown, but do not rely on it.",
    Status.NOT_ENOUGH_FRAMES: "Too few pictures could be used for a motion.",
    Status.OUT_OF_VIEW: "The particle was not wholly in the picture for long enough.",
    Status.NO_CONVERGENCE: "No start of the search led to a motion that explains the pictures. There is no measurement.",
    Status.IMPACT_AT_EDGE: "The particle hits something within three frames of the recording's start or end.",
    Status.SECOND_CONTACT: "The particle touched twice within a few frames. Velocities near there are not to be relied on.",
    Status.RESTING: "The particle rests or rolls: it is not in free flight.",
    Status.BROKEN: "After an impact the pictures show another shape than the calibrated views. Do not rely on velocities after it.",
}

NEXT: dict[Status, str] = {
    Status.CONVERGED: "Play the frames and see that the outline stays on the particle.",
    Status.AMBIGUOUS: "Compare the competing minima. Add calibrated views from other sides, a second camera, or a longer sequence.",
    Status.NOT_ENOUGH_FRAMES: "See below why frames were left out; record longer, or widen the view.",
    Status.OUT_OF_VIEW: "Cut the recording to the frames that show the whole particle, or move the camera back.",
    Status.NO_CONVERGENCE: "Check units and gravity; of pictures, that the views belong to this particle and the focal length is right.",
    Status.IMPACT_AT_EDGE: "Cut the recording at the impact, or record more frames on either side of it.",
    Status.SECOND_CONTACT: "Record with a higher frame rate, so that there are frames between the contacts, or cut the recording there.",
    Status.RESTING: "Cut the recording to the frames in which the particle flies.",
    Status.BROKEN: "Look at the particle. Cut the recording at the impact, and calibrate what is left anew to measure the rest.",
}

FAMILY_WORDS = {
    "smooth_force": "a force",
    "smooth_torque": "a torque",
    "body_thrust": "a force and a torque that are fixed to the body",
    "force_field": "a force that depends on the place in the room",
    "force_curve": "a force over time",
    "torque_curve": "a torque over time",
    "smooth_time_shift": "time stamps that go wrong smoothly",
    "image_warp": "a warp of the picture",
    "volume_warp": "a warp of the volume that positions are measured in",
    "zoom_in_time": "a magnification that changes with time",
    "body_outline": "an outline offset that is fixed to the body",
}
"""What stands for something unknown, by the key of its empirical family."""
FREE_FLIGHT = "free flight"


def names_in_words(key: str) -> str:
    """An effect's key as it is said, or those of two effects that stand in one's place together."""
    return " with ".join(map(in_words, key.split(JOINED)))


def model_words(keys: Iterable[str]) -> list[str]:
    """The effects of a model as they are said, what stands for something unknown last and by what it is; free flight where none is."""
    keys = list(keys)
    unknown = [f"something unknown ({in_words(key)}: {FAMILY_WORDS[whose(key)[0]]})" for key in keys if whose(key)[0] in FAMILY_WORDS]
    return [*(in_words(key) for key in keys if whose(key)[0] not in FAMILY_WORDS), *unknown] or [FREE_FLIGHT]


def rms_word(unit: str) -> str:
    """What residuals of a campaign in ``unit`` are."""
    return "ETE" if unit == "px" else "residual"


def rung_name(rung: Mapping[str, Any]) -> str:
    """What a rung of a ladder changes: the effect it adds, or those that the last model lacks."""
    if rung["added"] is not None:
        return f"+ {rung['added']}"
    return FREE_FLIGHT


MANY_LEFT_OUT = 0.2
LARGE_ETE_PX = 1.5


MISFIT_MEANING = "The fit converged, but its residuals are not noise: the model misses something. The intervals contain what shows of it."
MISFIT_NEXT = "Run `tumble compare` on the observations: it says where the model misses, and `tumble diagnose` which effect may be missing."


def adequate(estimate: Estimate) -> bool:
    """Whether the residuals look like noise; so they do where nothing was tested."""
    tested = estimate.statistics.get("adequacy")
    return tested is None or bool(tested["adequate"])


def misses_something(estimate: Estimate) -> bool:
    """Whether a fit converged whose residuals are not noise."""
    return estimate.status is Status.CONVERGED and not adequate(estimate)


def meaning(estimate: Estimate) -> str:
    """What the status means, and whether the model fits."""
    return MISFIT_MEANING if misses_something(estimate) else MEANING[estimate.status]


def besides_status(estimate: Estimate) -> str:
    """What the message says besides naming the status, which stands beside it."""
    return estimate.message.removeprefix(f"{estimate.status.value}.").lstrip()


def next_steps(estimate: Estimate) -> list[str]:
    """What to do next, most important first."""
    steps = [*([MISFIT_NEXT] if misses_something(estimate) else []), NEXT[estimate.status]]
    left_out = [frame for frame in estimate.frames if not frame.used]
    if left_out and len(left_out) > MANY_LEFT_OUT * len(estimate.frames):
        reason = max({frame.reason for frame in left_out}, key=[frame.reason for frame in left_out].count)
        steps.append(f"{len(left_out)} of {len(estimate.frames)} frames were left out, mostly because: {reason}.")
    if (worst := rms_ete_px(estimate)) is not None and worst > LARGE_ETE_PX:
        steps.append(f"The RMS ETE of {worst:.2f} px is large; above {LARGE_ETE_PX} px velocities are often wrong. Check calibration.")
    return steps


def rms_ete_px(estimate: Estimate) -> float | None:
    """RMS ETE (px) over the frames used; ``None`` where there are none: rows of a trajectory, or outlines sample by sample."""
    if "rows" in estimate.statistics:
        return None
    squares = [frame.rms_ete_px**2 for frame in estimate.frames if frame.used and math.isfinite(frame.rms_ete_px)]
    return (sum(squares) / len(squares)) ** 0.5 if squares else None


def unmeasured(estimates: Iterable[Estimate]) -> dict[str, str]:
    """Of each estimate that is no measurement: its status, why, and what to do about it."""
    parts = [part for estimate in estimates for part in particles_of(estimate)]
    return {e.name: f"{e.status.value}: {e.message} {next_steps(e)[0]}" for e in parts if e.status is not Status.CONVERGED}


def particles_of(estimate: Estimate) -> list[Estimate]:
    """The estimate and, where there are two particles, that of the second under a name of its own."""
    second = estimate.companion
    return [estimate] if second is None else [estimate, replace(second, name=estimate.name + COMPANION)]
