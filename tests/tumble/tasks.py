"""Tasks for the engine's tests; local processes import them by name."""

import os
from pathlib import Path
from typing import Any


def write(payload: dict[str, Any]) -> dict[str, Any]:
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
