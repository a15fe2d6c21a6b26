"""From light to digital numbers, after EMVA Standard 1288 (release 4.0 linear).

``n`` photo-electrons are Poisson distributed about ``mu = light * saturation * full_well * (1 + PRNU)``; dark signal and its
fixed pattern (DSNU) and Gaussian read noise add to them; the well clips at ``full_well``; ``DN = offset + K * electrons`` is
rounded and clipped to the bit depth, with the gain ``K = (2**bits - 1 - offset) / full_well`` (DN/e-). From ``GAUSSIAN_FROM_E``
electrons on, the Poisson distribution is replaced by the normal one of equal mean and variance. No dark current (exposures are short),
no non-linearity, no cross-talk.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float
from numpy.typing import NDArray

from datasets.recipes.recipe import SensorRecipe

Picture = NDArray[np.uint16]
Light = Float[NDArray[np.float64], "height width"]

GAUSSIAN_FROM_E = 200.0


@dataclass(frozen=True)
class Sensor:
    """One camera's sensor; ``pattern_seed`` decides its fixed pattern, so that a camera keeps it from picture to picture."""

    recipe: SensorRecipe
    width_px: int
    height_px: int
    pattern_seed: np.random.SeedSequence

    @property
    def full_scale_dn(self) -> int:
        """The largest digital number."""
        return int(2**self.recipe.bit_depth - 1)

    @property
    def gain_dn_per_e(self) -> float:
        """System gain K (DN/e-)."""
        return (self.full_scale_dn - self.recipe.dark_offset_dn) / self.recipe.full_well_e

    @cached_property
    def _pattern(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Relative photo-response and dark signal (e-) of every pixel."""
        rng = np.random.default_rng(self.pattern_seed)
        shape = (self.height_px, self.width_px)
        prnu = 1 + np.float32(self.recipe.prnu) * rng.standard_normal(shape, dtype=np.float32)
        return prnu, np.float32(self.recipe.dsnu_e) * rng.standard_normal(shape, dtype=np.float32)

    def mean_electrons(self, light: Light) -> NDArray[np.float32]:
        """Expected photo-electrons (e-) of relative ``light``; 1 is the open background."""
        prnu, _ = self._pattern
        scale = np.float32(self.recipe.saturation * self.recipe.full_well_e)
        return np.maximum(light.astype(np.float32) * prnu * scale, np.float32(0))

    def read_out(self, light: Light, rng: np.random.Generator) -> Picture:
        """One exposure of relative ``light`` (height, width): a picture in digital numbers."""
        mean = self.mean_electrons(light)
        read_variance = np.float32(self.recipe.read_noise_e**2)
        signal = mean + np.sqrt(mean + read_variance) * rng.standard_normal(mean.shape, dtype=np.float32)
        few = np.flatnonzero(mean < GAUSSIAN_FROM_E)
        if few.size:
            read = self.recipe.read_noise_e * rng.standard_normal(few.size, dtype=np.float32)
            signal.ravel()[few] = rng.poisson(mean.ravel()[few]) + read
        return self.digitise(signal + self._pattern[1])

    def digitise(self, electrons: NDArray[np.float32]) -> Picture:
        """Digital numbers of collected ``electrons``: clipped at the full well, amplified, offset, rounded and clipped."""
        dn = self.recipe.dark_offset_dn + self.gain_dn_per_e * np.minimum(electrons, np.float32(self.recipe.full_well_e))
        picture: Picture = np.clip(np.rint(dn), 0, self.full_scale_dn).astype(np.uint16)
        return picture

    def average(self, light: Light, exposures: int, rng: np.random.Generator) -> Picture:
        """The rounded mean of several exposures of the same light, as one takes a background."""
        total = np.zeros(light.shape, dtype=np.float64)
        for _ in range(exposures):
            total += self.read_out(light, rng)
        picture: Picture = np.rint(total / exposures).astype(np.uint16)
        return picture
