"""Taking a shot, with the effects that are in force: rows after one another, blur, edges drawn beside the silhouette, a bent response.

A segmentation that draws its outline at the darkness ``level`` instead of the half sees the picture as one at the half sees it through the
response ``light^gamma``, light 1 the open background, ``gamma = ln 0.5 / ln(1 - level)``: so a biased threshold is rendered. It acts on
every soft edge, on those that lens and pixels soften too.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from datasets.errors import InputError
from synth.effects import EffectsInForce
from synth.rendering.exposure import Optics, expose
from synth.rendering.redrawn import redrawn
from synth.rendering.shots import Shot
from synth.rendering.tracer import Traced, Tracer

Array = NDArray[np.float64]


def take(tracer: Tracer, optics: Optics, shot: Shot, effects: EffectsInForce) -> Traced:
    """The particle's light and coverage in the window of a shot."""
    if shot.window.empty:
        return _exposed(tracer, optics, shot)
    traced = _exposed(tracer, optics, shot)
    if shot.blur_px > 0:
        traced = Traced(
            *(np.asarray(gaussian_filter(picture, shot.blur_px, mode="nearest")) for picture in (traced.radiance, traced.coverage))
        )
    if not (effects.redraws_frames if shot.kind == "frame" else effects.redraws_views):
        return traced
    segmented = effects.segmented if shot.kind == "frame" else effects.view_segmented
    return redrawn(traced, shot.window, lambda outline: segmented(outline, optics.intrinsics))


def toned(light: Array, background: Array, effects: EffectsInForce, optics: Optics) -> Array:
    """A frame's relative light as a sensor with a bent response sees it; unchanged where the threshold is at the half.

    Raises
    ------
    InputError
        Where the particle is lit from the front, so that darkness says nothing about coverage.
    """
    if effects.level is None:
        return light
    if optics.light.kind != "back":
        raise InputError('motion_blur_threshold: expected hsv.light = "back" where pictures are rendered, got "front".')
    gamma = np.log(0.5) / np.log(1 - effects.level)
    return np.asarray(background * (light / background) ** gamma)


def _exposed(tracer: Tracer, optics: Optics, shot: Shot) -> Traced:
    if not shot.strips:
        return expose(
            tracer, optics, shot.window, shot.poses, samples=shot.samples, seeds=shot.seeds, cameras=shot.cameras, chips=shot.chips
        )
    parts = [
        expose(tracer, optics, strip.window, strip.poses, samples=shot.samples, seeds=shot.seeds, cameras=strip.cameras)
        for strip in shot.strips
    ]
    return Traced(np.concatenate([part.radiance for part in parts]), np.concatenate([part.coverage for part in parts]))
