"""Which software made a result."""

import hashlib
import platform
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path

LIBRARIES = ("tumble", "numpy", "scipy", "numba", "opencv-python-headless", "scikit-image", "trimesh", "shapely", "mitsuba", "drjit")


def _version(distribution: str) -> str:
    try:
        return metadata.version(distribution)
    except metadata.PackageNotFoundError:
        return "not installed"


def versions() -> dict[str, str]:
    """Version of Python, of the platform and of every library that can move a number."""
    found = {name: _version(name) for name in LIBRARIES}
    return {"python": platform.python_version(), "platform": platform.platform(), **found}


def sources_digest(packages: tuple[str, ...]) -> str:
    """SHA-256 of every source file of ``packages``; of those that are not installed, of none."""
    found = hashlib.sha256()
    for package in packages:
        spec = find_spec(package)
        for root in map(Path, spec.submodule_search_locations or () if spec else ()):
            for path in sorted(root.rglob("*.py")):
                found.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return found.hexdigest()
