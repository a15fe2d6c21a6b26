"""What this machine can do: each check says what was found and, where something is missing, what to type."""

import importlib.util
import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import psutil

from synth.rendering.variant import available_variants

CHROMIUM_NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
LEAST_MEMORY_GB = 2.0
LEAST_DISK_GB = 2.0
GB = 1e9


@dataclass(frozen=True)
class Finding:
    """One check. ``needed``: without it something of Tumble fails; otherwise something is only slower or skipped."""

    name: str
    good: bool
    found: str
    what_to_type: str = ""
    needed: bool = True


def find_chromium() -> Path | None:
    """The browser for the report's tests."""
    found = next((path for name in CHROMIUM_NAMES if (path := shutil.which(name))), None)
    return Path(found) if found else None


def check_python() -> list[Finding]:
    """Python 3.11 or newer."""
    version = ".".join(map(str, sys.version_info[:3]))
    remedy = "apt-get install python3.11 python3.11-venv, then: make demo SYSTEM_PYTHON=python3.11"
    return [Finding("python", sys.version_info >= (3, 11), version, remedy)]


def check_datasets_package() -> list[Finding]:
    """Whether ``import datasets`` finds ours: a well-known package elsewhere has the same name."""
    spec = importlib.util.find_spec("datasets")
    origin = Path(spec.origin) if spec is not None and spec.origin else None
    ours = origin is not None and (origin.parent / "vocabulary" / "camera.py").is_file()
    remedy = "pip uninstall datasets && pip install --no-deps --force-reinstall -e ."
    return [Finding("datasets package", ours, "ours" if ours else f"another package of that name: {origin}", remedy)]


def check_variants() -> list[Finding]:
    """Every renderer variant; scalar_rgb is enough."""
    return [
        Finding(f"renderer {v.name}", v.works, "works" if v.works else v.why_not, v.what_to_type, needed=v.name == "scalar_rgb")
        for v in available_variants()
    ]


def check_numba() -> list[Finding]:
    """Whether Numba can be imported."""
    there = importlib.util.find_spec("numba") is not None
    return [Finding("numba", there, "installed" if there else "not installed", "pip install numba")]


def check_cores() -> list[Finding]:
    """Cores that this process may use."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return [Finding("cores", True, str(cores), needed=False)]


def check_memory() -> list[Finding]:
    """Memory that is free now."""
    free = psutil.virtual_memory().available / GB
    return [Finding("memory", free >= LEAST_MEMORY_GB, f"{free:.1f} GB free", "close other programs, or use --jobs 1", needed=False)]


def check_disk() -> list[Finding]:
    """Space where results go by default."""
    free = shutil.disk_usage(Path.cwd()).free / GB
    return [Finding("disk", free >= LEAST_DISK_GB, f"{free:.1f} GB free here", "choose an --out on another disk", needed=False)]


def check_chromium() -> list[Finding]:
    """The browser: only the report's own tests need it."""
    path = find_chromium()
    found = str(path) if path is not None else "not found; the browser test is skipped"
    return [Finding("chromium", path is not None, found, "apt-get install chromium", needed=False)]


CHECKS: tuple[Callable[[], list[Finding]], ...] = (
    check_python,
    check_datasets_package,
    check_numba,
    check_variants,
    check_cores,
    check_memory,
    check_disk,
    check_chromium,
)


def examine() -> list[Finding]:
    """Run every check."""
    return [finding for check in CHECKS for finding in check()]
