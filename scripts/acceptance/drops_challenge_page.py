"""The page of the challenge on drops onto a plate, copied from the committed result.

``python -m scripts.acceptance.drops_challenge_page [--result docs/results/drops_challenge.json] [--page docs/studies/drops_challenge.md]``:
reads what ``tumble challenge score --result`` wrote of a challenge made with ``--drops`` (the summary and, beside it, ``..._cases.csv``).
"""

import argparse
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from studies.reporting.words import number, table, write_page

RESULT, PAGE = Path("docs/results/drops_challenge.json"), Path("docs/studies/drops_challenge.md")
DRAWN = {"single": 40, "control": 20}
"""Campaigns that the command below makes."""
Row = Mapping[str, Any]


def page_lines(result: Row, cases: pd.DataFrame, remark: str = "") -> list[str]:
    """The page; ``remark``: what else is to be known of this run."""
    (seed,) = result["challenges"] or {"unknown": 0}
    counts = {kind: result["counts"].get(kind, 0) for kind in DRAWN}
    first = (
        f" The command makes {DRAWN['single']} and {DRAWN['control']} in a shuffled order; these are the first of them, as far as there "
        "was time to solve."
    )
    all_of_them = "" if counts == DRAWN else first
    cpu = ", ".join(f"{name} {number(value)} s" for name, value in result["cpu_s"].items())
    return [
        "# Effects in drops that meet a plate",
        "",
        f"{counts['single']} campaigns with one effect of clock, body, flight or optics hidden, and {counts['control']} with nothing "
        "hidden: each of four drops of one cut or jagged stone onto a plate, 60 to 80 frames before and after the first impact at 4000 Hz, "
        "40 calibrated views, outlines with 0.2 px noise. The solver sees the observations alone, finds the impacts, fits "
        "every flight before, between and after them with a state of its own, and explains the campaign; impacts are measured where two "
        f"flights meet, under the model that it ends with. Seed {seed}, drawn after the code was final.{all_of_them}",
        *(["", remark] if remark else []),
        "",
        "*Limit of its own*: the size that the score test finds in 95% of campaigns like this very one, by its Fisher information. The "
        "table's limits, to which sizes were drawn (2 to 10 times), are those of free flights of 80 frames.",
        "",
        "## Figures",
        "",
        "Shares with their exact 95% intervals; of impacts, a bootstrap over campaigns. An impact counts where it was a single contact.",
        "",
        *acceptance_lines(result),
        "",
        "## Every campaign",
        "",
        *case_lines(cases),
        "",
        f"CPU time per campaign, median: {cpu}.",
        "",
        "## Again",
        "",
        "```sh",
        f"tumble challenge make --drops --seed {seed} --out out/drops",
        "tumble challenge solve out/drops --out out/drops_answers",
        "tumble challenge score out/drops out/drops_answers --no-oracle --out out/drops_score --result docs/results/drops_challenge.json",
        "python -m scripts.acceptance.drops_challenge_page",
        "```",
    ]


def acceptance_lines(result: Row) -> list[str]:
    """The lines of acceptance."""
    rows = []
    for row in result["acceptance"]:
        interval = f" ({number(row['low'])} to {number(row['high'])})" if _finite(row["low"]) else ""
        value = f"{number(row['value'])}{interval} {row['unit']}" if _finite(row["value"]) else "–"
        rows.append([row["line"], row["what"], value, str(row["n"]), bounds(row), row["verdict"]])
    return table(["", "figure", "value", "n", "asked", ""], rows)


def case_lines(cases: pd.DataFrame) -> list[str]:
    """What was hidden and what was named, case by case; *limit of its own*: by the solver's information about that very campaign."""
    rows = []
    for case in cases.sort_values(["kind", "hidden"]).fillna({"hidden": "", "group": ""}).itertuples():
        right = (case.within_group or case.named_first) if case.kind == "single" else not case.false_alarm
        group = ", ".join(_words(key) for key in str(case.group).split("+") if key)
        sizes = [number(value) if _finite(value) else "–" for value in (case.ratio, case.own_ratio)]
        errors = f"{number(case.base_px)} → {number(case.final_px)}" if _finite(case.base_px) else "–"
        rows.append([_words(case.hidden or "nothing"), case.particle.replace("_", " "), *sizes, _words(case.first), group or "–", errors])
        rows[-1].append("yes" if right else "**no**")
    head = ["hidden", "particle", "size over the limit", "over the limit of its own", "named first", "alias group"]
    return table([*head, "held-out RMS (px)", "right"], rows)


def bounds(row: Row) -> str:
    """What was asked for."""
    parts = [f"≥ {number(row['least'])}" if _finite(row["least"]) else "", f"≤ {number(row['most'])}" if _finite(row["most"]) else ""]
    asked = " and ".join(part for part in parts if part)
    return f"{asked} {row['unit']}" if asked else "–"


def _finite(value: Any) -> bool:
    return isinstance(value, int | float) and bool(np.isfinite(value))


def _words(key: str) -> str:
    return key.replace("_", " ")


def main() -> int:
    """Write the page."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--result", type=Path, default=RESULT)
    parser.add_argument("--page", type=Path, default=PAGE)
    parser.add_argument("--remark", default="", help="what else is to be known of this run, as a paragraph of the page")
    arguments = parser.parse_args()
    cases = pd.read_csv(arguments.result.with_name(f"{arguments.result.stem}_cases.csv"))
    write_page(page_lines(json.loads(arguments.result.read_text(encoding="utf-8")), cases, arguments.remark), arguments.page)
    print(arguments.page)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
