"""Dull particles before a back light: fewer rays are shaded, and the picture stays what it was."""

import numpy as np
import pytest

from synth.rendering import tracer
from synth.rendering.camera import ThinLens
from synth.rendering.light import lighting
from synth.rendering.materials import material
from synth.rendering.scene import rays_per_shaded_one

FOCUS_M = 0.6
REPEATS = 24


CASES = [("matte", "back", True), ("matte", "front", False), ("rough_metal", "back", False), ("diamond", "back", False)]


@pytest.mark.parametrize(("surface", "light", "shared"), CASES)
def test_only_where_noise_stays_below_the_sensors(surface, light, shared) -> None:
    lamp = lighting(light, focus_m=FOCUS_M, widest_slope=0.1, falloff=0.2)
    assert (rays_per_shaded_one(material(surface), lamp) > 1) == shared


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm"])
def test_light_and_coverage_stay_what_they_were(room, pose, pebble, llvm, monkeypatch, variant) -> None:
    """Sums over the picture, with and without the share, against the spread of repetitions with seeds of their own."""
    name = llvm() if variant == "llvm" else variant
    sums = {}
    for share in (True, False):
        if not share:
            monkeypatch.setattr(tracer, "rays_per_shaded_one", lambda *_: 1)
        dark_room = room(pebble, lens=ThinLens(0.01, FOCUS_M), variant=name)
        taken = [dark_room.take([pose(turn=(0.3, 0.2, 0.1))], samples=16, seed=100 * share + k) for k in range(REPEATS)]
        sums[share] = np.array([[t.radiance.sum(), t.coverage.sum()] for t in taken])
    apart = sums[True].mean(axis=0) - sums[False].mean(axis=0)
    error = np.sqrt(sum(s.var(axis=0, ddof=1) for s in sums.values()) / REPEATS)
    assert np.all(np.abs(apart) < 4 * error)
    assert np.all(error < 0.003 * sums[False].mean(axis=0))
