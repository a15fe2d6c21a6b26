"""Which software made a result."""

import platform
from importlib import metadata

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
