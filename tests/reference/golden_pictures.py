"""The rendered pictures of the golden corpus, committed: a renderer's rays meet other facets on another processor.

A thousandth of the pixels that differ by one step move the flight by up to 0.08 standard deviations, more than the corpus allows; what the
instrument makes of the same pictures is the same on every machine. ``python -m tests.reference.golden_pictures`` renders them anew; the
corpus is then to be written anew, too.
"""

import tempfile
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from datasets.observation import Observation
from datasets.observation_files import read_observation
from datasets.recipes.recipe import HsvRecipe, MotionRecipe, ParticleRecipe, Recipe, RenderingRecipe, RigRecipe, SensorRecipe
from synth.rendering.sequence import render_sequence

PICTURES = Path(__file__).resolve().parents[1] / "golden" / "pictures.zip"
RECIPE = Recipe(
    seed=5,
    tier="rendered",
    particle=ParticleRecipe(irregularity=0.6, size_mm=(3.0, 3.0)),
    motion=MotionRecipe(frames=20, speed_ms=(0.3, 0.8), spin_rads=(120.0, 200.0)),
    hsv=HsvRecipe(width_px=192, height_px=192, focal_mm=60.0),
    sensor=SensorRecipe(bit_depth=10, dark_offset_dn=16.0),
    rig=RigRecipe(drops=3, width_px=256, height_px=256, mm_per_px=0.03),
    rendering=RenderingRecipe(variant="scalar_rgb", subframes=2, samples_per_subframe=1, rig_samples=1),
)


@contextmanager
def committed() -> Iterator[Observation]:
    """The observation as it was rendered once, to be used while its files are there."""
    with tempfile.TemporaryDirectory() as folder:
        with zipfile.ZipFile(PICTURES) as archive:
            archive.extractall(folder)
        yield read_observation(Path(folder))


def render() -> None:
    """Render the pictures and write them in place of the committed ones."""
    with tempfile.TemporaryDirectory() as folder:
        name = render_sequence(RECIPE, 0, Path(folder))
        with zipfile.ZipFile(PICTURES, "w", zipfile.ZIP_LZMA) as archive:
            for file in sorted((Path(folder) / "observations" / name).iterdir()):
                archive.write(file, file.name)


if __name__ == "__main__":
    render()
