"""Versions of the libraries that a result depends on."""

import platform
from importlib.metadata import version

LIBRARIES = ("tumble", "numpy", "scipy", "numba", "scikit-image", "opencv-python-headless", "trimesh")


def versions() -> dict[str, str]:
    """Versions of Python and of the libraries the result depends on."""
    return {"python": platform.python_version(), **{name: version(name) for name in LIBRARIES}}
