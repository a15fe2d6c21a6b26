"""From a laboratory's own files to a scored flight: draws the files, types every command, and writes docs/first_recording.md.

``python -m scripts.pages.first_recording --out out/first_recording``. The page gives what each command printed and took, all together at
most 15 minutes on two cores; drawing the files (two minutes) is not part of it.
"""

import argparse
import json
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from scripts.pages.browser import tab
from scripts.pages.first_recording_files import NAME, draw_everything
from scripts.pages.tutorial import ROOT, Step, run_step
from scripts.pages.tutorial_page import shown

PAGE, IMAGES = ROOT / "docs/first_recording.md", ROOT / "docs/images/first_recording"
RESULT = ROOT / "docs/results/first_recording.json"
BOARD = "charuco:12x9:4mm:2.9mm:DICT_5X5_250"
DROPS, PLACEMENTS, FRAMES, SEED = 10, 40, 60, 33
RIG = " ".join(f"boards/cam{k}" for k in range(6))
STEPS = (
    Step("rig", f"tumble calibrate rig {RIG} --board {BOARD} --out rig", "rig"),
    Step("camera", f"tumble calibrate camera boards/hsv --board {BOARD} --out camera", "camera"),
    Step("shape", f"tumble shape {' '.join(f'drops/{k:02d}' for k in range(1, DROPS + 1))} --rig rig --out stone", "stone"),
    Step("import", f"tumble import {NAME}.cine --camera camera --particle stone --gravity down --out run", "run"),
    Step("estimate", "tumble estimate run --out estimates", "estimates"),
    Step("score", "tumble score estimates --truth truth --out scores", "scores"),
    Step("report", "tumble report estimates --truth truth --out report", "report"),
)
PICTURES = (("check", f"run/{NAME}.check.html", "main", 760), ("report", "report/report.html", ".columns", 1200))
"""Name, page, region of it, and how much of its height (px) at most."""
WIDTH_PX, FRAME = 1100, 20


def main(arguments: Sequence[str] | None = None) -> int:
    """Draw, type, take the pictures, write result and page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/first_recording"), metavar="FOLDER", help="a new folder")
    parser.add_argument("--page", action="store_true", help="only write the page from the committed result")
    options = parser.parse_args(arguments)
    if not options.page:
        options.out.mkdir(parents=True)
        draw_everything(options.out, placements=PLACEMENTS, drops=DROPS, frames=FRAMES, seed=SEED)
        result = {step.key: timed(step, options.out) for step in STEPS}
        _write(RESULT, json.dumps(result, indent=1, ensure_ascii=False) + "\n")
        take_pictures(options.out)
    result = json.loads(RESULT.read_text(encoding="utf-8"))
    _write(PAGE, page_text(result))
    took = sum(step["seconds"] for step in result.values())
    print(f"{len(result)} commands (at most 8), {took / 60:.1f} minutes (at most 15)")
    return 0


def timed(step: Step, work: Path) -> dict[str, Any]:
    """The command, what it printed (paths as seen from ``work``), and the seconds it took."""
    began = time.perf_counter()
    printed = run_step(step, work)["printed"].replace(f"{work.resolve()}/", "")
    return {"command": step.command, "printed": printed, "seconds": round(time.perf_counter() - began, 1)}


def page_text(result: dict[str, Any]) -> str:
    """The page: the prose of first_recording.md.j2 with what the commands printed."""
    loader = FileSystemLoader(Path(__file__).parent)
    environment = Environment(loader=loader, undefined=StrictUndefined, trim_blocks=True, keep_trailing_newline=True)
    took = sum(step["seconds"] for step in result.values())
    return environment.get_template("first_recording.md.j2").render(
        shown=lambda key: shown(result, key),
        ends=lambda key, first, last: shown({key: {**result[key], "printed": ends_of(result[key]["printed"], first, last)}}, key),
        seconds=lambda key: f"{result[key]['seconds']:.0f} s",
        commands=len(result),
        minutes=f"{took / 60:.1f}",
        drops=DROPS,
        frames=FRAMES,
        placements=PLACEMENTS,
    )


def ends_of(text: str, first: int, last: int) -> str:
    """The first and the last lines of a text, and "…" for those between."""
    lines = text.splitlines()
    return text if len(lines) <= first + last else "\n".join([*lines[:first], "…", *lines[-last:]])


def take_pictures(work: Path) -> None:
    """The check and the report, as a browser shows them.

    Raises
    ------
    InputError
        Where there is no browser.
    """
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tab(WIDTH_PX) as shown_in:
        for name, page, region, highest in PICTURES:
            shown_in.goto((work / page).resolve().as_uri())
            if name == "report":
                shown_in.evaluate(f"show({FRAME})")
            shown_in.wait_for_timeout(300)
            box = shown_in.locator(region).first.bounding_box()
            if box is None:
                raise InputError(f"{page}: expected {region} on it, got nothing")
            clip = {**box, "height": min(box["height"], highest)}
            shown_in.screenshot(path=IMAGES / f"{name}.png", clip=clip, full_page=True)


def _write(path: Path, text: str) -> None:
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
