"""The page of the tutorial: the prose of tutorial.md.j2 with what the commands printed and the numbers they found."""

import json
import textwrap
from functools import partial
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

WIDTH = 110
"""Columns of a terminal: longer lines are wrapped at words."""
Facts = dict[str, Any]


def facts_of(work: Path) -> Facts:
    """Numbers of the documents that the commands wrote.

    Raises
    ------
    RuntimeError
        Where a run came out otherwise than the page tells it.
    """
    facts = {
        "compare": _floor(_document(work, "drag-compare")),
        "drag": _candidate(_document(work, "drag-diagnose"), "quadratic_drag"),
        "ladder": _rungs(_document(work, "drag-ladder")),
        "fitted": _document(work, "drag-fitted", "campaign.json")["values"],
        "vent_compare": _floor(_document(work, "vent-compare")),
        "unknown": _unknown(_document(work, "vent-explain")),
        "law_ladder": _rungs(_document(work, "vent-ladder-law")),
        "vent_ladder": _rungs(_document(work, "vent-ladder")),
        "vent_fitted": _document(work, "vent-fitted", "campaign.json")["values"],
        "again": _document(work, "vent-again")["verdict"]["kind"],
    }
    _as_told(_document(work, "drag-diagnose")["verdict"]["add"] == ["quadratic_drag"], "diagnose names quadratic drag")
    for name in ("ladder", "law_ladder", "vent_ladder"):
        _as_told(facts[name][-1]["held_out_px"] < facts[name][0]["held_out_px"], f"the held-out error falls ({name})")
    _as_told(facts["unknown"]["kind"] == "unknown", "explain calls the vent unknown")
    _as_told(facts["unknown"]["stage"] == "dynamics", "the unknown sits in the dynamics")
    _as_told(facts["unknown"]["terms"] == ["body_fixed"], f"the law is a thrust fixed to the body, got {facts['unknown']['terms']}")
    _as_told(facts["again"] == "nothing missing", f"nothing is missing beside the vent, got {facts['again']}")
    return facts


def _as_told(right: bool, what: str) -> None:
    if not right:
        raise RuntimeError(f"the page of the tutorial says otherwise; expected: {what}")


def _document(work: Path, folder: str, name: str = "diagnosis.json") -> Facts:
    found: Facts = json.loads((work / folder / name).read_text(encoding="utf-8"))
    return found


def _floor(document: Facts) -> Facts:
    return {key: document["noise_floor"][key] for key in ("rms_px", "repeated_px", "reduced_chi_square")}


def _candidate(document: Facts, key: str) -> Facts:
    found = next(each for each in document["diagnosis"]["candidates"] if each["effect"] == key)
    return {"share": found["share"], "values": found["values"]}


def _rungs(document: Facts) -> list[Facts]:
    return [
        {"added": rung["added"], "held_out_px": rung["held_out"]["rms_px"], "velocity": rung["velocity"]} for rung in document["ladder"]
    ]


def _unknown(document: Facts) -> Facts:
    left = document["unknown"]
    return {
        "kind": document["verdict"]["kind"],
        "stage": left["stage"],
        "removed": left["removed"],
        "terms": [term["term"] for term in left["law"]["terms"]],
        "values": left["law"]["values"],
    }


def page_text(result: Facts, files: Path) -> str:
    """The page's text; ``files`` are the user's own, as committed."""
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent), undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True
    )
    template = environment.get_template("tutorial.md.j2")
    return template.render(
        result["facts"],
        shown=partial(shown, result["steps"]),
        written=lambda key: result["steps"][key]["written"].rstrip(),
        file=lambda name: (files / name).read_text(encoding="utf-8").rstrip(),
        percent=lambda rungs: f"{1.0 - rungs[-1]['held_out_px'] / rungs[0]['held_out_px']:.0%}",
    )


def shown(steps: Facts, key: str, first: int | None = None) -> str:
    """A step as a block: its command and what it printed, or only its ``first`` lines and "…"."""
    step = steps[key]
    lines = step["printed"].splitlines()
    if first is not None and len(lines) > first:
        lines = [*lines[:first], "…"]
    return "\n".join(["```text", f"$ {step['command']}", *(wrapped for line in lines for wrapped in _wrapped(line)), "```"])


def _wrapped(line: str) -> list[str]:
    return textwrap.wrap(line, WIDTH, drop_whitespace=True) if len(line) > WIDTH else [line]
