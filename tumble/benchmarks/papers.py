"""What lies beside the files of a set: the card for people, the manifest for `sha256sum -c`, and a description for search engines.

The description is Croissant 1.0 (http://mlcommons.org/croissant/1.0), JSON-LD over schema.org.
"""

import csv
import json
import mimetypes
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from datasets.file_digests import file_sha256
from tumble.benchmarks.sets import COLUMNS, BenchmarkSet, Target

CARD, MANIFEST, CROISSANT, TARGETS = "card.md", "manifest.sha256", "croissant.json", "targets.csv"
PAPERS = (CARD, MANIFEST, CROISSANT)
RUN = "run.json"
LICENCES = {"CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/"}
TYPES = {".npz": "application/x-npz", ".tif": "image/tiff", ".ply": "application/x-ply", ".toml": "application/toml"}
PREFIX = "http://mlcommons.org/croissant/"
TERMS = "citeAs column extract field fileObject fileSet format includes isLiveDataset md5 recordSet references source".split()


def write_targets(targets: list[Target], path: Path) -> None:
    """A list of targets; numbers come back to the bit."""
    with written_whole(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        rows = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        rows.writeheader()
        rows.writerows({key: repr(value) if isinstance(value, float) else value for key, value in row.items()} for row in targets)


def write_papers(told: BenchmarkSet, folder: Path) -> None:
    """Card, description and, last, the manifest of everything else."""
    with written_whole(folder / CARD) as temporary:
        temporary.write_text(card(told), encoding="utf-8")
    digests = digests_of(folder)
    with written_whole(folder / CROISSANT) as temporary:
        temporary.write_text(json.dumps(croissant(told, digests), indent=1) + "\n", encoding="utf-8")
    with written_whole(folder / MANIFEST) as temporary:
        temporary.write_text("".join(f"{digest}  {name}\n" for name, digest in digests.items()), encoding="utf-8")


def digests_of(folder: Path) -> dict[str, str]:
    """SHA-256 of every file of a set by its path in the folder, sorted; the papers and what a run notes of itself left out."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    names = {path: path.relative_to(folder).as_posix() for path in paths}
    return {name: file_sha256(path) for path, name in names.items() if not _is_paper(name)}


def read_manifest(folder: Path) -> dict[str, str]:
    """Digests by path, as the manifest has them.

    Raises
    ------
    InputError
        Where there is none, or a line is no such thing.
    """
    path = folder / MANIFEST
    if not path.is_file():
        raise InputError(f"{path}: expected the manifest of a benchmark set, got none. `tumble benchmark make` writes one.")
    found = {}
    for count, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        digest, gap, name = line.partition("  ")
        if len(digest) != 64 or not gap or not name:
            raise InputError(f"{path}, line {count}: expected a SHA-256, two blanks and a path, got {line!r}.")
        found[name] = digest
    return found


def against_manifest(folder: Path) -> list[str]:
    """Sentences for files that are missing, changed or not in the manifest."""
    listed, there = read_manifest(folder), digests_of(folder)
    missing = [f"{name}: missing" for name in listed if name not in there]
    changed = [f"{name}: changed" for name in listed if name in there and there[name] != listed[name]]
    return missing + changed + [f"{name}: not in the manifest" for name in there if name not in listed]


def card(told: BenchmarkSet) -> str:
    """The card, as Markdown."""
    made = (
        "\n".join(f"- `datasets/{name}`: {recipe.sequences} sequences, seed {recipe.seed}." for name, recipe in told.recipes.items())
        if told.recipes
        else f"- `challenge`: `tumble challenge {' '.join(told.challenge)}`."
    )
    listed = f"\n\n`{TARGETS}` lists what is to be measured: velocities at mid-sequence, as they truly are." if told.recipes else ""
    return (
        f"# {told.title} (`{told.name}` {told.version})\n\n{told.what}\n\n**Why.** {told.why}\n\n## What is in it\n\n{made}{listed}\n\n"
        f"Some {told.megabytes:g} MB, made in about {told.minutes:g} minutes on two cores by `tumble benchmark make {told.name}`. Made "
        f"anew it has the same sequences. Seeds are public: truth lies apart (`truth`), hidden from instruments, not from people.\n\n"
        f"## Use\n\nLicence: {told.licence}. `sha256sum -c {MANIFEST}` or `tumble benchmark verify FOLDER` checks the files. {_use(told)}\n"
    )


def croissant(told: BenchmarkSet, digests: dict[str, str]) -> dict[str, Any]:
    """The description, as JSON-LD."""
    files = [
        {
            "@type": "cr:FileObject",
            "@id": name,
            "name": name,
            "contentUrl": name,
            "encodingFormat": TYPES.get(Path(name).suffix) or mimetypes.guess_type(name)[0] or "application/octet-stream",
            "sha256": digest,
        }
        for name, digest in digests.items()
    ]
    context = {"@language": "en", "@vocab": "https://schema.org/", "sc": "https://schema.org/", "cr": PREFIX}
    context |= {"dct": "http://purl.org/dc/terms/", "conformsTo": "dct:conformsTo", **{term: f"cr:{term}" for term in TERMS}}
    typed: dict[str, Any] = {"dataType": {"@id": "cr:dataType", "@type": "@vocab"}}
    return {
        "@context": {**context, **typed},
        "@type": "sc:Dataset",
        "name": told.name,
        "version": told.version,
        "datePublished": told.published,
        "creator": {"@type": "sc:Organization", "name": "The Tumble authors"},
        "url": f"urn:tumble:benchmark:{told.name}:{told.version}",
        "description": f"{told.title}. {told.what}",
        "conformsTo": f"{PREFIX}1.0",
        "license": LICENCES.get(told.licence, told.licence),
        "isLiveDataset": False,
        "distribution": files,
        **({"recordSet": [_targets_described()]} if TARGETS in digests else {}),
    }


def _targets_described() -> dict[str, Any]:
    def described(column: str) -> dict[str, Any]:
        kind = "sc:Text" if column in COLUMNS[:2] else "sc:Float"
        source = {"fileObject": {"@id": TARGETS}, "extract": {"column": column}}
        return {"@type": "cr:Field", "@id": f"targets/{column}", "name": column, "dataType": kind, "source": source}

    return {"@type": "cr:RecordSet", "@id": "targets", "name": "targets", "field": [described(column) for column in COLUMNS]}


def _use(told: BenchmarkSet) -> str:
    if not told.recipes:
        return "`tumble challenge solve challenge --out answers`, then `tumble challenge score challenge answers`."
    first = next(iter(told.recipes))
    return f"`tumble estimate datasets/{first} --out estimates`, then `tumble leaderboard datasets/{first} --of tumble=estimates`."


def _is_paper(name: str) -> bool:
    return name in PAPERS or Path(name).name == RUN or name.startswith(".") or "/." in name
