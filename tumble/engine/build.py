"""What a worker is made of: versions, sources and threads, which must be those of the process that asks."""

import os
import platform
from collections.abc import Mapping
from functools import cache
from typing import Any

from datasets.errors import InputError
from tumble.differences import first_difference
from tumble.one_thread import THREAD_VARIABLES, keep_to_one_thread
from tumble.versions import sources_digest, versions

SOURCES = ("datasets", "synth", "estimator", "tumble", "scripts")
"""Packages whose code can move a result."""


@cache
def build() -> dict[str, Any]:
    """The build of this process; it keeps to one thread from here on."""
    threads = {name: os.environ.get(name, "not set") for name in THREAD_VARIABLES[:3]}
    keep_to_one_thread(os.environ)
    found = versions()
    del found["platform"]  # kernels of a cluster's machines differ
    return {**found, "machine": platform.machine(), "sources": sources_digest(SOURCES), "threads": threads}


def refuse_other_build(worker: str, found: Any, wanted: Mapping[str, Any]) -> None:
    """Refuse a worker whose results may differ.

    Raises
    ------
    InputError
        With what differs first; ``found`` may be what the worker raised when it was asked.
    """
    different = (
        f"it raised {found!r}"
        if isinstance(found, BaseException)
        else first_difference(found, wanted, words="{name} is {found!r} there and {wanted!r} here")
    )
    if different:
        raise InputError(
            f"worker {worker}: expected the software of this process, but {different}. Start workers from the same environment, with one "
            "thread each and a nanny (dask worker ADDRESS --nthreads 1)."
        )
