"""What a fit with the surface as an unknown says of itself: the noise that its samples were found to have, beside their outlines' own."""

from typing import Any

import numpy as np

from estimator.fitting.problem import M
from estimator.geometry.silhouettes import Silhouettes
from estimator.motion.flight import Motion
from estimator.surface.joint import JointFit

MISSED = 1.5
"""Effective noise over the outlines' own from which the surface misses them, and tangents have the last word, by judgement: trial runs had
1.0 to 1.3, and 1.9 for a stone whose spikes the mesh cannot follow. What views show finer than frames do is none of the motion's: their own
noise counts as what that of the frames is in their pixels, where that is more. Of rendered views, whose noise is a quarter of that, the
surface misses detail by 1.3 to 4 times their own, and velocities were right."""
RAN_AWAY = 100.0
"""Effective noise over the outlines' own from which a surface has left them, so that how far is no measurement, by judgement: misplaced
views are missed by up to 18 times, those that a fit left by 850 and more."""


def groups_of(joint: JointFit[M]) -> tuple[str, ...]:
    """What the groups of samples are called: the views, then the frames of each camera."""
    cameras = [joint.sightings.cameras[int(number)].name for number in np.unique(joint.sightings.camera)]
    return ("views", "frames") if len(cameras) == 1 else ("views", *(f"frames of {name}" for name in cameras))


def surface_statistics(joint: JointFit[Motion]) -> dict[str, Any]:
    """As an estimate holds them."""
    return {
        "effective_noise_px": dict(zip(groups_of(joint), joint.noise_px, strict=True)),
        "outline_noise_px": dict(zip(groups_of(joint), joint.outline_noise_px, strict=True)),
        "surface_scale": joint.scale,
        "view_shift_px": joint.shift_sd_px,
        "settled": joint.settled,
    }


def surface_sentence(joint: JointFit[Motion], finer: float) -> str:
    """Which outlines the surface misses by more than their noise, in words; empty where it meets them.

    ``finer``: how much larger views show the body than frames do.
    """
    views_px, *frames_px = joint.outline_noise_px
    counts_px = max(views_px, max(frames_px) * finer), *frames_px
    found = list(zip(groups_of(joint), joint.noise_px, joint.outline_noise_px, counts_px, strict=True))
    left = [f"the {group}" for group, noise_px, own_px, _ in found if noise_px > RAN_AWAY * own_px]
    if left:
        return f"The fit to all outline samples ran away from {' and '.join(left)}"
    missed = [
        f"those of the {group} by {noise_px:.2f} px (their own noise is {own_px:.2f} px)"
        for group, noise_px, own_px, most_px in found
        if noise_px > MISSED * most_px
    ]
    return f"The surface fitted to all samples misses outlines, {' and '.join(missed)}" if missed else ""


def finer_views(views: Silhouettes, frames: Silhouettes) -> float:
    """How much larger ``views`` show the body than ``frames`` do, in the median."""
    return _extent_px(views) / _extent_px(frames)


def _extent_px(seen: Silhouettes) -> float:
    hulls = (seen.points_px[seen.slice_of(i)] for i in np.flatnonzero(seen.samples).tolist())
    return float(np.median([np.ptp(hull, axis=0).max() for hull in hulls if len(hull)]))
