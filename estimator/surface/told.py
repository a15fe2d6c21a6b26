"""What a fit with the surface as an unknown says of itself: the noise that its samples were found to have, beside their outlines' own."""

from typing import Any

from estimator.motion.flight import Motion
from estimator.surface.joint import JointFit

MISSED = 1.5
"""Effective noise over the outlines' own from which the surface misses them, and tangents have the last word, by judgement: trial runs had
1.0 to 1.3, and 1.9 for a stone whose spikes the mesh cannot follow."""
GROUPS = ("views", "frames")


def surface_statistics(joint: JointFit[Motion]) -> dict[str, Any]:
    """As an estimate holds them."""
    return {
        "effective_noise_px": dict(zip(GROUPS, joint.noise_px, strict=True)),
        "outline_noise_px": dict(zip(GROUPS, joint.outline_noise_px, strict=True)),
        "surface_scale": joint.scale,
        "settled": joint.settled,
    }


def surface_sentence(joint: JointFit[Motion]) -> str:
    """Which outlines the surface misses by more than their noise, in words; empty where it meets them."""
    missed = [
        f"those of the {group} by {found:.2f} px (their own noise is {own:.2f} px)"
        for group, found, own in zip(GROUPS, joint.noise_px, joint.outline_noise_px, strict=True)
        if found > MISSED * own
    ]
    if not missed:
        return ""
    return f"The surface fitted to all samples misses outlines, {' and '.join(missed)}"
