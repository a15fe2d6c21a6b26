"""What was made once of a particle, as arrays beside its document, with digests of what it was made from and of the arrays themselves.

``made.npz`` counts only where ``particle.json`` beside it names its digest. A particle file that has gone, or whose arrays were made from
something else, is no error: they are made again.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from datasets.array_files import read_arrays, write_arrays
from datasets.errors import InputError
from datasets.file_digests import file_sha256
from datasets.json_documents import Document, read_document

PARTICLE_FILE, MADE_FILE, KIND = "particle.json", "made.npz", "particle"
Arrays = Mapping[str, NDArray[np.generic]]


@dataclass(frozen=True)
class MadeFile:
    """``made.npz`` of a particle's ``folder``: digest ``of`` what it was made from, ``sha256`` of the file, ``names`` of its arrays."""

    folder: Path
    of: str
    sha256: str
    names: tuple[str, ...]

    def __str__(self) -> str:
        """The file, for messages."""
        return str(self.folder / MADE_FILE)

    def load(self, of: str) -> Arrays | None:
        """See :class:`datasets.observation.Made`.

        Raises
        ------
        InputError
            Where the file is not the one that the document names.
        """
        path = self.folder / MADE_FILE
        if of != self.of or not path.exists():
            return None
        if file_sha256(path) != self.sha256:
            raise InputError(f"{path}: expected the file that {PARTICLE_FILE} names by its digest, got another; run tumble shape again.")
        return read_arrays(path, self.names)


def write_made(folder: Path, of: str, arrays: Arrays) -> Document:
    """Write the arrays; their entry in the particle's document."""
    write_arrays(folder / MADE_FILE, arrays)
    return {"of": of, "sha256": file_sha256(folder / MADE_FILE), "names": sorted(arrays)}


def made_in(folder: Path) -> MadeFile | None:
    """What is kept in the particle file ``folder``; ``None`` where there is no such file or nothing is kept.

    Raises
    ------
    InputError
        Where its document is damaged.
    """
    path = folder / PARTICLE_FILE
    return made_of_entry(folder, read_document(path, KIND)["made"]) if path.is_file() else None


def made_of_entry(folder: Path, entry: Document | None) -> MadeFile | None:
    """From a document's entry that fits the schema."""
    return None if entry is None else MadeFile(folder, entry["of"], entry["sha256"], tuple(entry["names"]))
