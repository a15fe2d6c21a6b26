"""How long ``tumble explain`` takes, as a user starts it, on the campaigns of challenges that took their solver longest.

``python -m scripts.benchmarks.time_explain CHALLENGE… --answers ANSWERS… [--slowest N] [--jobs N…] [--result
docs/results/time_explain.json]``: of the campaigns that ``tumble challenge solve`` has answered, those with the most CPU time as a whole,
registration and empirical terms included. Each is explained anew by the verb, with every number of ``--jobs`` in turn, on a machine that
should do nothing else; times are those of a clock on the wall, from the command to its end, report included.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from datasets.atomic_files import written_whole
from datasets.errors import InputError
from tumble.challenge.solving import answer_path, campaigns_in
from tumble.cli.options import cores, positive
from tumble.diagnosing import DIAGNOSIS_FILE
from tumble.versions import versions

ASKED_S = 300.0


@dataclass(frozen=True)
class Answered:
    """A campaign's folder, the effects that were found in it, and the CPU time (s) of one process that the whole took."""

    folder: Path
    found: tuple[str, ...]
    cpu_s: float


def answered(challenge: Path, answers: Path) -> list[Answered]:
    """The campaigns of a challenge that were answered."""
    found = []
    for folder in campaigns_in(challenge):
        path = answer_path(answers, folder.name)
        if path.exists():
            answer = json.loads(path.read_text(encoding="utf-8"))
            found.append(Answered(folder, tuple(answer["found"]), float(answer["cpu_s"].get("whole", 0.0))))
    if not found:
        raise InputError(f"{answers}: expected answers to campaigns of {challenge}, got none.")
    return found


def timed(campaign: Answered, jobs: int) -> dict[str, Any]:
    """One run of the verb."""
    with tempfile.TemporaryDirectory() as out:
        verb = [sys.executable, "-m", "tumble.cli.main", "explain"]
        began = time.perf_counter()
        done = subprocess.run([*verb, str(campaign.folder), "--out", f"{out}/explain", "--jobs", str(jobs), "--quiet"], check=False)
        wall = time.perf_counter() - began
        path = Path(out) / "explain" / DIAGNOSIS_FILE
        if not path.exists():
            raise InputError(f"{campaign.folder}: expected tumble explain to explain it, got exit code {done.returncode}.")
        document = json.loads(path.read_text(encoding="utf-8"))
    return {
        "campaign": f"{campaign.folder.parent.parent.name}/{campaign.folder.name}",
        "jobs": jobs,
        "wall_s": wall,
        "cpu_s": campaign.cpu_s,
        "found": list(campaign.found),
        "same": [step["added"] for step in document["steps"]] == list(campaign.found),
    }


def line_of(row: dict[str, Any]) -> str:
    """One printed line."""
    judged = "HELD" if row["wall_s"] <= ASKED_S else "MISSED"
    found = ", ".join(row["found"]) or "nothing of the catalogue"
    same = "" if row["same"] else "; NOT what was found before"
    before = f"{row['cpu_s']:.0f} s of CPU before; {found}{same}"
    return f"{row['campaign']}: {row['wall_s']:.0f} s with --jobs {row['jobs']} ({before}): {judged}"


def main(arguments: Sequence[str] | None = None) -> int:
    """Time, print and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("challenges", type=Path, nargs="+", metavar="CHALLENGE")
    parser.add_argument("--answers", type=Path, nargs="+", required=True)
    parser.add_argument("--slowest", type=positive, default=3, metavar="N")
    parser.add_argument("--jobs", type=positive, nargs="+", default=[cores()], metavar="N")
    parser.add_argument("--result", type=Path)
    asked = parser.parse_args(arguments)
    if len(asked.challenges) != len(asked.answers):
        raise InputError(f"--answers: expected a folder for each of {len(asked.challenges)} challenges, got {len(asked.answers)}.")
    every = [each for pair in zip(asked.challenges, asked.answers, strict=True) for each in answered(*pair)]
    slowest = sorted(every, key=lambda each: -each.cpu_s)[: asked.slowest]
    rows = []
    for campaign in slowest:
        for jobs in asked.jobs:
            rows.append(timed(campaign, jobs))
            print(line_of(rows[-1]), flush=True)
            if asked.result is not None:
                content = {"of": len(every), "asked_s": ASKED_S, "cores": cores(), "runs": rows, "versions": versions()}
                with written_whole(asked.result) as temporary:
                    temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
