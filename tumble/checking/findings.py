"""What speaks against a recording, in sentences: bad (a measurement would fail or be wrong) or worth knowing."""

from collections import Counter
from dataclasses import dataclass

import numpy as np

from estimator.data.configuration import Configuration
from estimator.readiness import Inspection

SATURATED_SHARE = 0.01
"""Share of a picture's pixels at full scale that is more than glints on a particle; a saturated background fills most of a picture."""
FAINT = 0.1
"""Contrast, as a share of full scale, below which 8 bit leave some 25 grey levels between particle and background."""
UNLIKE = 0.15
"""Difference of pictures from those of their outlines, as a share of the contrast: 0.04 of a real back-lit ball, 0.2 to 1.4 of bubbles."""
SMALL_PX = 20.0
"""Extent below which an outline has fewer than 60 points: too few for three angles."""
LONG_SMEAR_PX = 2.0
"""Motion during an exposure from which the outline is that of a smear; the estimator's blur model holds below a few pixels."""
UNEVEN = 0.01
"""Share by which the time between two frames may differ from the usual one; cameras keep it to 1e-4."""
STILL_PX = 0.02
"""Motion per frame that is no more than the noise of an outline's centre."""


@dataclass(frozen=True)
class Finding:
    """One sentence; ``bad``: a measurement would fail or be wrong. Otherwise it is worth knowing."""

    bad: bool
    sentence: str


def findings_of(inspection: Inspection) -> tuple[Finding, ...]:
    """What speaks against one camera's recording."""
    told = (
        _used(inspection),
        _saturation(inspection),
        *_steps(inspection),
        _times(inspection),
        _faint(inspection),
        _edges(inspection),
        _small(inspection),
        _smear(inspection),
        _still(inspection),
    )
    return tuple(finding for finding in told if finding is not None)


def left_out(inspection: Inspection) -> dict[str, list[int]]:
    """Frames that are not used whole, by reason."""
    reasons: dict[str, list[int]] = {}
    for number, frame in enumerate(inspection.track.frames):
        if not frame.used:
            reasons.setdefault(str(frame.status), []).append(number)
    return reasons


def numbers_text(numbers: list[int]) -> str:
    """Numbers with runs drawn together: ``0-3, 7, 9-12``."""
    runs: list[list[int]] = []
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(f"{a}-{b}" if b > a else str(a) for a, b in runs)


def _used(inspection: Inspection) -> Finding | None:
    wanted, used = Configuration().minimum_frames, int(inspection.track.used.sum())
    if used >= wanted:
        return None
    counts = Counter(reason for reason in inspection.track.reasons if reason != "used")
    why = ", ".join(f"{count} {reason}" for reason, count in counts.most_common())
    return Finding(True, f"{used} usable frames, and a measurement needs {wanted}: {why or 'the recording is too short'}.")


def _saturation(inspection: Inspection) -> Finding | None:
    if not np.isfinite(inspection.saturated).any():
        return None
    share = float(np.nanmedian(inspection.saturated))
    if share < SATURATED_SHARE:
        return None
    return Finding(
        True,
        f"{share:.0%} of the pixels are at full scale (saturated): light above it was cut off, so the half level of an edge is not "
        "known and outlines are shifted by a part of the blur. Record darker (shorter exposure, smaller aperture, less light).",
    )


def _steps(inspection: Inspection) -> tuple[Finding, ...]:
    return tuple(
        Finding(
            True,
            f"between frames {step.first} and {step.second} the particle moved {round(step.times, 1) + 0.0:.1f} times as far as between "
            "their neighbours: a picture is missing or twice there, or a time stamp is wrong.",
        )
        for step in inspection.odd_steps
    )


def _times(inspection: Inspection) -> Finding | None:
    if inspection.times_s is None or len(inspection.times_s) < 3:
        return None
    gaps = np.diff(inspection.times_s)
    usual = float(np.median(gaps))
    odd = np.flatnonzero(np.abs(gaps / usual - 1.0) > UNEVEN)
    if len(odd) == 0:
        return None
    k = int(odd[0])
    more = f" and {len(odd) - 1} more" if len(odd) > 1 else ""
    return Finding(
        False, f"time stamps are uneven: {1e6 * gaps[k]:.2f} us between frames {k} and {k + 1}{more}, usually {1e6 * usual:.2f} us."
    )


def _faint(inspection: Inspection) -> Finding | None:
    contrast = np.array([frame.contrast for frame in inspection.track.frames if frame.seen])
    if not np.isfinite(contrast).any() or float(np.nanmedian(contrast)) >= FAINT:
        return None
    return Finding(False, f"the contrast is {np.nanmedian(contrast):.0%} of full scale: more light makes outlines less noisy.")


def _edges(inspection: Inspection) -> Finding | None:
    misfit = np.array([frame.misfit for frame in inspection.track.frames if frame.seen])
    if not np.isfinite(misfit).any() or float(np.nanmedian(misfit)) <= UNLIKE:
        return None
    return Finding(
        False,
        f"near the outline pictures differ from those of an opaque body by {np.nanmedian(misfit):.0%} of the contrast: glare, light that "
        "leaks through, or an outline that is not on the particle's edge. Look at the pictures.",
    )


def _small(inspection: Inspection) -> Finding | None:
    if not np.isfinite(inspection.extent_px).any() or float(np.nanmedian(inspection.extent_px)) >= SMALL_PX:
        return None
    return Finding(
        False, f"the particle is {np.nanmedian(inspection.extent_px):.0f} px large: rotation is hardly seen below {SMALL_PX:.0f} px."
    )


def _smear(inspection: Inspection) -> Finding | None:
    if inspection.smear_px is None or inspection.smear_px < LONG_SMEAR_PX:
        return None
    return Finding(False, f"the particle moves {inspection.smear_px:.1f} px during an exposure: expose shorter.")


def _still(inspection: Inspection) -> Finding | None:
    if not inspection.step_px < STILL_PX:
        return None
    return Finding(True, "what was found does not move: it is scenery or a particle at rest. State a background without the particle.")
