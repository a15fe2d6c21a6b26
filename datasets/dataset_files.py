"""A benchmark folder: ``dataset.json``, ``observations/<sequence>/`` and, apart from it, ``truth/<sequence>/``."""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from datasets.errors import InputError
from datasets.json_documents import read_document, revived, write_document

FILE = "dataset.json"


@dataclass(frozen=True)
class Dataset:
    """What a benchmark contains and how it was made.

    ``recipe`` is the resolved recipe as plain values, ``variant`` the renderer's (``None`` where nothing was rendered).
    """

    name: str
    sequences: tuple[str, ...]
    seed: int
    recipe: dict[str, Any] = field(default_factory=dict)
    versions: dict[str, str] = field(default_factory=dict)
    variant: str | None = None


def observation_folder(root: Path, sequence: str) -> Path:
    """Where the observation of ``sequence`` lies."""
    return root / "observations" / sequence


def truth_folder(root: Path, sequence: str) -> Path:
    """Where the truth of ``sequence`` lies."""
    return root / "truth" / sequence


def write_dataset(dataset: Dataset, root: Path) -> None:
    """Write ``dataset.json``.

    Raises
    ------
    TumbleError
        When the disk does not take it.
    """
    write_document(root / FILE, "dataset", {**vars(dataset), "sequences": list(dataset.sequences)})


def read_dataset(root: Path) -> Dataset:
    """Read ``dataset.json``.

    Raises
    ------
    InputError
        Naming the file, what was expected and what came.
    """
    if not root.is_dir():
        raise InputError(f"{root}: expected the folder of a dataset, got {'a file' if root.exists() else 'nothing'}.")
    document = read_document(root / FILE, "dataset")
    return Dataset(
        name=document["name"],
        sequences=tuple(document["sequences"]),
        seed=document["seed"],
        recipe=revived(document["recipe"]),
        versions=document["versions"],
        variant=document["variant"],
    )
