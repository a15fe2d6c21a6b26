"""The bodies of studies: six scanned ones, three irregular and three regular, or six of the project's own."""

from pathlib import Path

import numpy as np

from datasets.errors import InputError
from datasets.recipes.recipe import ParticleRecipe

IRREGULAR = ("stone_02", "stone_05", "stone_09")
REGULAR = ("imaged_bennu_geodesynets", "imaged_deimos", "radar_1998ky26")
SIX = (*IRREGULAR, *REGULAR)
PROCEDURAL = tuple((family, irregularity) for irregularity in (0.4, 0.7, 1.0) for family in ("cut_stone", "jagged"))
"""Three regular and three irregular bodies of the procedural family."""


def scanned_files(folder: Path) -> list[str]:
    """Their PLY files.

    Raises
    ------
    InputError
        Where one is missing.
    """
    files = [folder / f"{name}.ply" for name in SIX]
    for file in files:
        if not file.is_file():
            raise InputError(f"{file}: expected a scanned particle, found nothing; name the folder that holds them with --particles")
    return [str(file) for file in files]


def bodies(folder: Path | None) -> tuple[ParticleRecipe, ...]:
    """Six bodies, regular and irregular in turn: the scanned ones of a folder, or the project's own."""
    if folder is None:
        return tuple(ParticleRecipe(family=family, irregularity=a) for family, a in PROCEDURAL)  # type: ignore[arg-type]
    files = dict(zip(SIX, scanned_files(folder), strict=True))
    return tuple(ParticleRecipe(files=(files[name],)) for pair in zip(REGULAR, IRREGULAR, strict=True) for name in pair)


def drawn_seed(seed: int, repetition: int) -> int:
    """The recipe's seed of a repetition, the same for all points of a study: they differ by what is varied, not by the draw."""
    return int(np.random.SeedSequence([seed, repetition]).generate_state(1)[0])
