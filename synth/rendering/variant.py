"""Which of Mitsuba's variants can be used here, and switching one on.

LLVM is several times faster, but libLLVM 15 and 16 abort the whole process while they compile the first kernel. So the version is
asked for first, which only loads the library, and LLVM is switched on from 17 upwards. The scalar variant needs nothing but the wheel.
``DRJIT_LIBLLVM_PATH`` names the library to use where the default is too old. The choice holds for the whole process.
"""

from dataclasses import dataclass
from importlib import import_module
from typing import Any

from datasets.errors import InputError

OLDEST_LLVM = (17,)
PREFERENCE = ("llvm_ad_mono", "llvm_ad_rgb", "scalar_rgb")
"""Best first."""
INSTALL_LLVM = "apt-get install libllvm19  (any libLLVM from 17 on; where it is not found: export DRJIT_LIBLLVM_PATH=/path/to/libLLVM.so)"
INSTALL_MITSUBA = "pip install 'mitsuba>=3.9,<3.10'"


@dataclass(frozen=True)
class Variant:
    """A variant by its Mitsuba name; where it does not work, why, and what to type to get it."""

    name: str
    works: bool
    why_not: str = ""
    what_to_type: str = ""


def llvm_version() -> tuple[int, ...]:
    """The version of the libLLVM that Dr.Jit finds; ``(-1, -1, -1)`` where it finds none that it takes."""
    return tuple(int(part) for part in drjit_module().detail.llvm_version())


def drjit_module() -> Any:
    """Dr.Jit, imported when it is needed: all else works without a renderer."""
    return import_module("drjit")


def available_variants() -> tuple[Variant, ...]:
    """Every variant that this project can use, best first, with the reason where it does not work here."""
    try:
        compiled = set(import_module("mitsuba").variants())
    except ImportError as error:
        return tuple(Variant(name, False, f"Mitsuba cannot be imported ({error})", INSTALL_MITSUBA) for name in PREFERENCE)
    return tuple(_judged(name, compiled) for name in PREFERENCE)


def _judged(name: str, compiled: set[str]) -> Variant:
    if name not in compiled:
        return Variant(name, False, "this build of Mitsuba does not have it", INSTALL_MITSUBA)
    if not name.startswith("llvm"):
        return Variant(name, True)
    version = llvm_version()
    if version >= OLDEST_LLVM:
        return Variant(name, True)
    if version[0] < 0:
        return Variant(name, False, "no libLLVM was found, or one that is too old", INSTALL_LLVM)
    found = ".".join(map(str, version))
    return Variant(name, False, f"libLLVM {found} aborts the process; {OLDEST_LLVM[0]} or newer is needed", INSTALL_LLVM)


def choose_variant(requested: str = "auto") -> str:
    """The variant to use: the best that works for ``auto``, else the one requested.

    Raises
    ------
    InputError
        Where it does not work here; the message says why and what to type.
    """
    variants = available_variants()
    working = [variant.name for variant in variants if variant.works]
    if requested == "auto" and working:
        return working[0]
    if requested in working:
        return requested
    reasons = {variant.name: f"{variant.why_not}; try: {variant.what_to_type}" for variant in variants if not variant.works}
    reason = reasons.get(requested, "; ".join(reasons.values()) if requested == "auto" else "this build of Mitsuba does not have it")
    raise InputError(f"rendering.variant: expected one of {['auto', *working]}, got {requested!r}: {reason}")


def activate(name: str, *, threads: int = 1) -> Any:
    """Switch ``name`` on for this process and return the Mitsuba module; reruns are bit-identical at one thread."""
    mitsuba = import_module("mitsuba")
    mitsuba.set_variant(name)
    mitsuba.set_log_level(mitsuba.LogLevel.Error)
    drjit_module().set_thread_count(threads)
    return mitsuba
