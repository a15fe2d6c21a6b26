"""What a fit with the surface as an unknown says of itself: the noise that its samples were found to have, beside their outlines' own."""

from typing import Any

import numpy as np

from estimator.fitting.problem import M
from estimator.motion.flight import Motion
from estimator.surface.joint import JointFit

SWALLOWED = 1.5
"""Effective noise of pictures over the outlines' own from which a fit may have taken for noise what a motion lacks, by judgement: trial
runs in which nothing was missing had 1.0 to 1.3."""
LEFT = "The fit to all outline samples ran away"
RAN_AWAY = 100.0
"""Effective noise over the outlines' own from which a surface has left them, so that how far is no measurement, by judgement: misplaced
views are missed by up to 18 times, outlines of diamonds, which are alike from picture to picture, by 20, those that a fit left by 850 and
more. What is less is noise that the fit has found: velocities are as uncertain as it makes them."""


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
        "view_shift_px": joint.views.sd_px,
        "settled": joint.settled,
    }


def is_noisy(joint: JointFit[M]) -> bool:
    """Whether the noise that was found of pictures is more than theirs."""
    return bool(_noisy(joint))


def noisy_sentence(joint: JointFit[M]) -> str:
    """Which pictures are missed by more than their outlines' own noise, in words; empty where none are."""
    missed = [f"those of the {group} by {ratio:.1f} times their own noise" for group, ratio in _noisy(joint).items()]
    return f"The surface misses outlines, {' and '.join(missed)}: the uncertainties contain that as noise." if missed else ""


def _noisy(joint: JointFit[M]) -> dict[str, float]:
    """Effective noise over the outlines' own of the pictures of each camera where it is more."""
    of_pictures = zip(groups_of(joint)[1:], joint.noise_px[1:], joint.outline_noise_px[1:], strict=True)
    return {group: noise_px / own_px for group, noise_px, own_px in of_pictures if noise_px > SWALLOWED * own_px}


def surface_sentence(joint: JointFit[Motion]) -> str:
    """Which outlines the surface has left, in words; empty where it meets them, however noisy they are."""
    found = zip(groups_of(joint), joint.noise_px, joint.outline_noise_px, strict=True)
    left = [f"the {group}" for group, noise_px, own_px in found if noise_px > RAN_AWAY * own_px]
    return f"{LEFT} from {' and '.join(left)}" if left else ""
