"""LLVM is switched on only where it is safe, both kinds of variant show the same, and what does not work says why."""

import numpy as np
import pytest

from datasets.errors import InputError
from synth.rendering import variant
from synth.rendering.camera import ThinLens


@pytest.mark.parametrize(
    ("version", "works"), [((-1, -1, -1), False), ((15, 0, 7), False), ((16, 0, 0), False), ((17, 0, 0), True), ((19, 1, 7), True)]
)
def test_old_llvm_is_not_switched_on(monkeypatch, version, works) -> None:
    monkeypatch.setattr(variant, "llvm_version", lambda: version)
    found = {entry.name: entry for entry in variant.available_variants()}
    assert found["llvm_ad_mono"].works is works
    assert found["scalar_rgb"].works
    assert variant.choose_variant() == ("llvm_ad_mono" if works else "scalar_rgb")
    if not works:
        assert found["llvm_ad_mono"].why_not
        assert "libllvm" in found["llvm_ad_mono"].what_to_type


def test_a_variant_that_does_not_work_is_an_input_error(monkeypatch) -> None:
    monkeypatch.setattr(variant, "llvm_version", lambda: (16, 0, 6))
    with pytest.raises(InputError, match=r"libLLVM 16\.0\.6 aborts"):
        variant.choose_variant("llvm_ad_mono")
    with pytest.raises(InputError, match="does not have it"):
        variant.choose_variant("scalar_mono")


def test_without_mitsuba_nothing_works_but_the_reason_is_given(monkeypatch) -> None:
    def missing(name: str) -> object:
        raise ImportError(name)

    monkeypatch.setattr(variant, "import_module", missing)
    assert not any(entry.works for entry in variant.available_variants())
    with pytest.raises(InputError, match="pip install"):
        variant.choose_variant()


def test_both_kinds_of_variant_show_the_same(room, pose, pebble, llvm) -> None:
    name = llvm()
    lens, place = ThinLens(3e-3, 0.6), [pose(0.1, -0.2, 0.58, turn=(0.3, -0.8, 0.5))]
    scalar, again = (room(pebble, lens=lens, light="front").take(place, samples=64, seed=seed) for seed in (1, 2))
    wavefront = room(pebble, lens=lens, light="front", variant=name).take(place, samples=64)
    for part in ("radiance", "coverage"):
        ours, theirs, repeated = (getattr(traced, part) for traced in (wavefront, scalar, again))
        noise = np.std(theirs - repeated)
        assert np.std(ours - theirs) < 1.2 * noise
        assert abs(np.mean(ours - theirs)) < 4 * noise / np.sqrt(theirs.size)
