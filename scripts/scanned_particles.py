"""The six scanned bodies that the studies share: three irregular and three regular ones."""

from pathlib import Path

from datasets.errors import InputError

IRREGULAR = ("stone_02", "stone_05", "stone_09")
REGULAR = ("imaged_bennu_geodesynets", "imaged_deimos", "radar_1998ky26")
SIX = (*IRREGULAR, *REGULAR)


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
