"""Digests: of the files that decide a study's rows, of the libraries that do, of rows, and of what a picture was drawn from."""

import hashlib
from importlib.util import find_spec
from pathlib import Path

from tumble.versions import sources_digest

LIBRARIES = ("datasets", "synth", "estimator")
"""What makes, measures and scores a sequence."""
SHORT = 12
"""Hexadecimal digits of a digest that is read by people; two of a few thousand sources agree in it once in ten million times."""


def of_modules(names: tuple[str, ...]) -> dict[str, str]:
    """The short digest of the source of every module, by name."""
    return {name: of_bytes(source_of(name).read_bytes()) for name in sorted(names)}


def source_of(module: str) -> Path:
    """The file of a module."""
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    return Path(spec.origin)


def of_libraries() -> dict[str, str]:
    """The short digest of every library's sources."""
    return {name: sources_digest((name,))[:SHORT] for name in LIBRARIES}


def of_bytes(*parts: bytes) -> str:
    """A short digest of all parts."""
    found = hashlib.sha256()
    for part in parts:
        found.update(part + b"\0")
    return found.hexdigest()[:SHORT]
