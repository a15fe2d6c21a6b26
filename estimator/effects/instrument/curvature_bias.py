"""What outlines of noisy samples do by themselves: hulls stand out where a body is flat and are cut where it is sharp.

Not an effect of nature but a known discrepancy of the instrument, always in the model and held near zero by a prior [Kennedy and O'Hagan,
J. R. Stat. Soc. B 63 (2001) 425]: ``delta = b1 f / (1 + f) + b2 / (1 + rho / RADIUS_PX) - b3 r``, each about its mean over a sequence,
f the flatness and rho the radius of curvature of the convex outline, r (px⁻¹) the recession of its tangents under a small blur over the
blur's square, hollows and spikes included. The level is not its business: the outlines' offset has a narrower prior, and a level that
follows from a shape's parameters makes every distance wrong. Without it, every effect that follows curvature would be found in data that
have none.
"""

import numpy as np
from numpy.typing import NDArray

from datasets.vocabulary.effects import EffectEntry, Parameter, Scope, Stage
from estimator.effects.link import Array, EffectModel, Places, Setting

RADIUS_PX = 3.0
"""Radius of curvature at which an outline counts as half sharp, near the reach of its smoothing. By judgement."""
HELD_PX, HELD_PX2 = 0.1, 0.1
"""Standard deviations of the terms' priors: smoothing and noise move tangents by some hundredths of a pixel. By judgement."""


class CurvatureBias(EffectModel):
    """Bias of smoothed, noisy outlines on flat and on sharp places and at corners."""

    entry = EffectEntry(
        "curvature_bias",
        Stage.SEGMENTATION,
        Scope.PARTICLE,
        (
            Parameter("flat", "px", (-0.3, 0.3), 1e-3, "on flat places"),
            Parameter("sharp", "px", (-0.3, 0.3), 1e-3, "on sharp places"),
            Parameter("cut", "px2", (-0.3, 0.3), 1e-3, "at corners, as a blur cuts them"),
        ),
        "delta = flat f / (1 + f) + sharp / (1 + rho / 3 px) - cut r about the mean, r the recession under a small blur over its square",
        "Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001) 425: model discrepancy",
    )
    held = (HELD_PX, HELD_PX, HELD_PX2)
    instrument = True

    def shift(self, theta: Array, places: Places, setting: Setting) -> Array | None:
        """The bias on the outline."""
        del setting
        told = np.any(places.normal != 0.0, axis=-1)
        flatness = places.radius_px / places.mean_radius_px[:, None, None]
        flat = _about_mean(flatness / (1.0 + flatness), told)
        sharp = _about_mean(1.0 / (1.0 + places.radius_px / RADIUS_PX), told)
        cut = _about_mean(places.sharpness, told)
        return np.asarray(theta[0] * flat + theta[1] * sharp - theta[2] * cut)


def _about_mean(values: Array, told: NDArray[np.bool_]) -> Array:
    return values - np.mean(values, where=told) if told.any() else values
