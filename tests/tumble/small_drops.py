"""The recipe of a small, short recording of one falling stone, as a laboratory's own files are made of in tests."""

from datasets.recipes.recipe import HsvRecipe, MotionRecipe, NoiseRecipe, ParticleRecipe, Recipe, RigRecipe


def small_drop(*, frames: int, size_px: int) -> Recipe:
    """Outlines without noise of a cut stone of 3 mm, in square pictures."""
    return Recipe(
        seed=5,
        particle=ParticleRecipe(irregularity=0.6, size_mm=(3.0, 3.0)),
        motion=MotionRecipe(frames=frames, speed_ms=(0.3, 0.8), spin_rads=(120.0, 200.0)),
        hsv=HsvRecipe(width_px=size_px, height_px=size_px, focal_mm=60.0),
        rig=RigRecipe(drops=2),
        noise=NoiseRecipe(hsv_boundary_px=0.0),
    )
