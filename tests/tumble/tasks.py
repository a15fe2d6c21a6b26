"""Tasks for the engine's tests; local processes import them by name."""

import os
import time
from pathlib import Path
from typing import Any


def write(payload: dict[str, Any]) -> dict[str, Any]:
    Path(payload["product"]).parent.mkdir(parents=True, exist_ok=True)
    Path(payload["product"]).write_text(payload["text"], encoding="utf-8")
    return {"length": len(payload["text"])}


def fail_on_bad(payload: dict[str, Any]) -> dict[str, Any]:
    if payload["text"] == "bad":
        raise ValueError("this one is bad")
    return write(payload)


def die_on_bad(payload: dict[str, Any]) -> dict[str, Any]:
    if payload["text"] == "bad":
        os._exit(9)
    return write(payload)


def hang_on_bad(payload: dict[str, Any]) -> dict[str, Any]:
    if payload["text"] == "bad":
        time.sleep(60.0)
    return write(payload)


def take_a_while(payload: dict[str, Any]) -> dict[str, Any]:
    """Say which process works on it, in a file that all share; long enough to be killed meanwhile."""
    with Path(payload["pids"]).open("a", encoding="utf-8") as file:
        file.write(f"{os.getpid()}\n")
    time.sleep(0.3)
    return write(payload)
