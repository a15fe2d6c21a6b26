"""Runs the commands of the tutorial as a new user types them, keeps what they print, takes the pictures, and writes docs/tutorial.md.

``python -m scripts.pages.tutorial --out out/tutorial`` takes about fifteen minutes of one core; a run that was stopped goes on where it
was, and a finished one is only written anew, unless the program has changed since. With ``--page`` the page alone is written, from the
committed result, docs/results/tutorial.json.
"""

import argparse
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from scripts.pages.browser import tab
from scripts.pages.tutorial_page import facts_of, page_text
from tumble.cli.exit_codes import ALL_MEASURED, INCOMPLETE

ROOT = Path(__file__).parents[2]
FILES = ROOT / "docs" / "tutorial_files"
RESULT, PAGE, IMAGES = ROOT / "docs/results/tutorial.json", ROOT / "docs/tutorial.md", ROOT / "docs/images/tutorial"
PACKAGES = ("datasets", "synth", "estimator", "tumble")
WIDTH = 110
"""Columns of the terminal that the commands print to."""
PROGRESS = re.compile(r"^\w+: \d+% of \d+")
WIDTH_PX = 1000


@dataclass(frozen=True)
class Step:
    """A command, as the user types it in one folder, the file or folder that it makes, and a file that the user has written before."""

    key: str
    command: str
    makes: str = ""
    brings: str = ""


STEPS = (
    Step("render", "tumble render --config drag.toml --out drag", "drag", "drag.toml"),
    Step("estimate", "tumble estimate drag --out drag-estimates", "drag-estimates"),
    Step("score", "tumble score drag-estimates --truth drag/truth --out drag-scores", "drag-scores"),
    Step("compare", "tumble compare drag --out drag-compare", "drag-compare"),
    Step("diagnose", "tumble diagnose drag --out drag-diagnose", "drag-diagnose"),
    Step("ladder", "tumble ladder drag --effects quadratic_drag --truth drag/truth --out drag-ladder", "drag-ladder"),
    Step("fitted", "tumble estimate drag --effects quadratic_drag --out drag-fitted", "drag-fitted"),
    Step("explain", "tumble explain drag --out drag-explain", "drag-explain"),
    Step("vent_render", "tumble render --config vent.toml --out vent", "vent", "vent.toml"),
    Step("vent_compare", "tumble compare vent --out vent-compare", "vent-compare"),
    Step("vent_explain", "tumble explain vent --out vent-explain", "vent-explain"),
    Step("law_new", "tumble effect new MyLaw --from vent-explain/diagnosis.json --out my_law.py", "my_law.py"),
    Step("law_ladder", "tumble ladder vent --effects ./my_law.py:MyLaw --out vent-ladder-law", "vent-ladder-law"),
    Step("blank", "tumble effect new Vent --kind force --out blank_vent.py", "blank_vent.py"),
    Step("check", "tumble effect check ./my_vent.py:Vent", "", "my_vent.py"),
    Step("vent_ladder", "tumble ladder vent --effects ./my_vent.py:Vent --truth vent/truth --out vent-ladder", "vent-ladder"),
    Step("vent_fitted", "tumble estimate vent --effects ./my_vent.py:Vent --out vent-fitted", "vent-fitted"),
    Step("vent_again", "tumble diagnose vent --effects ./my_vent.py:Vent --out vent-again", "vent-again"),
    Step("hidden", "tumble challenge hidden --seed 11 --out hidden", "hidden"),
)

PICTURES = (
    ("compare", "drag-compare", "#maps .maps", ("along y, over time", "along v, over time")),
    ("ladder", "drag-ladder", "#ladder", ()),
    ("explain", "vent-explain", "#verdict", ()),
    ("vent_ladder", "vent-ladder", "#ladder", ()),
)
"""Name, folder of the report, region of it, and titles of the figures of the region that are shown (none: all of it)."""
KEEP = """([region, titles]) => {
  const figures = [...document.querySelectorAll("figure")].filter(e => titles.includes(e.querySelector("h3")?.textContent));
  if (figures.length !== titles.length) throw new Error(`expected figures ${titles}, got ${figures.length} of them`);
  document.querySelector(region).replaceChildren(...figures);
}"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run, take the pictures, write result and page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/tutorial"), metavar="FOLDER")
    parser.add_argument("--page", action="store_true", help="only write the page from the committed result")
    options = parser.parse_args(arguments)
    if not options.page:
        result = run_steps(options.out)
        take_pictures(options.out / "work")
        _write(RESULT, json.dumps(result, indent=1, ensure_ascii=False) + "\n")
    _write(PAGE, page_text(json.loads(RESULT.read_text(encoding="utf-8")), FILES))
    return 0


def _write(path: Path, text: str) -> None:
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def run_steps(out: Path) -> dict[str, Any]:
    """What every step printed, the files that were written, and the numbers that the page's sentences need."""
    work, finished = out / "work", out / "steps"
    for folder in (work, finished):
        folder.mkdir(parents=True, exist_ok=True)
    digest, records = program_digest(), {}
    for step in STEPS:
        digest = _digest(digest, step)
        kept = finished / f"{step.key}.json"
        record = json.loads(kept.read_text(encoding="utf-8")) if kept.exists() else {}
        if record.get("digest") != digest:
            record = {"digest": digest, "command": step.command, **run_step(step, work)}
            _write(kept, json.dumps(record))
        records[step.key] = {key: record[key] for key in ("command", "printed", "written")}
    return {"steps": records, "facts": facts_of(work)}


def program_digest() -> str:
    """Digest of the code and the data that every command runs on."""
    digest = hashlib.sha256()
    for package in PACKAGES:
        for path in sorted(path for path in (ROOT / package).rglob("*") if path.is_file() and "__pycache__" not in path.parts):
            digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


def _digest(before: str, step: Step) -> str:
    """What a step's result depends on beside the program: the steps before it, its command, and its file."""
    brought = (FILES / step.brings).read_bytes() if step.brings else b""
    return hashlib.sha256(f"{before}{step.command}".encode() + brought).hexdigest()


def run_step(step: Step, work: Path) -> dict[str, str]:
    """Type the command in ``work``; what it printed, progress shortened to "…", and the text of the plug-in that it wrote.

    Raises
    ------
    RuntimeError
        Where it failed.
    """
    made = work / step.makes
    if step.makes and made.is_dir():
        shutil.rmtree(made)
    elif step.makes:
        made.unlink(missing_ok=True)
    if step.brings:
        shutil.copy(FILES / step.brings, work)
    print(step.command, file=sys.stderr, flush=True)
    environment = {**os.environ, "COLUMNS": str(WIDTH), "OMP_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
    words = [sys.executable, "-m", "tumble.cli.main", *step.command.split()[1:]]
    done = subprocess.run(words, cwd=work, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if done.returncode not in (ALL_MEASURED, INCOMPLETE):  # what a model lacks may leave its fit unsettled, and the verb says so
        raise RuntimeError(f"{step.command}: expected exit code {ALL_MEASURED} or {INCOMPLETE}, got {done.returncode}: {done.stdout}")
    written = made.read_text(encoding="utf-8") if made.suffix == ".py" else ""
    return {"printed": without_progress(done.stdout), "written": written}


def without_progress(text: str) -> str:
    """What was printed, lines that only say how far the work is replaced by "…"."""
    lines: list[str] = []
    for line in text.splitlines():
        shown = "…" if PROGRESS.match(line) else line.rstrip()
        if not (shown == "…" and lines and lines[-1] == "…"):
            lines.append(shown)
    return "\n".join(lines)


def take_pictures(work: Path) -> None:
    """Regions of the reports, as a browser shows them.

    Raises
    ------
    InputError
        Where there is no browser.
    """
    IMAGES.mkdir(parents=True, exist_ok=True)
    with tab(WIDTH_PX) as shown_in:
        for name, folder, region, titles in PICTURES:
            shown_in.goto((work / folder / "report.html").resolve().as_uri())
            if titles:
                shown_in.evaluate(KEEP, [region, list(titles)])
            shown_in.locator(region).first.screenshot(path=IMAGES / f"{name}.png")


if __name__ == "__main__":
    sys.exit(main())
