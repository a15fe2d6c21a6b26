"""Writes two parts of docs/studies/acceptance.md from the committed result files: the first, and the one on another seed.

The rest of the page stays as it is.

``python -m scripts.acceptance.acceptance_page``.
"""

import json
from pathlib import Path
from typing import Any

import pandas as pd

PAGE = Path("docs/studies/acceptance.md")
SILHOUETTE = Path("docs/results/acceptance_silhouette.json")
RENDERED = Path("docs/results/acceptance_rendered.csv")
OTHER = Path("docs/results/acceptance_silhouette_73045998.json")
END = "How to make them again:"
ANOTHER_SEED = "## Another seed\n"
FIRST_RUN = 60
"""Sequences of the other seed that were run, and looked at, first."""


def first_part(result: dict[str, Any], rendered: pd.DataFrame) -> str:
    """The page up to ``END``."""
    median = result["median_percent"]
    other = {key: float(rendered[f"middle_{key}_percent"].median()) for key in ("in_plane", "out_of_plane", "angular")}
    rows = [
        ("in-plane velocity, of the speed", f"{median['in_plane']:.3f}%", f"{other['in_plane']:.3f}%"),
        ("out-of-plane velocity, of the speed", f"{median['out_of_plane']:.3f}%", f"{other['out_of_plane']:.3f}%"),
        ("angular velocity, of the spin", f"{median['angular']:.3f}%", f"{other['angular']:.3f}%"),
        (
            "within 0.5% in-plane",
            f"{100 * result['share_in_plane_within_0.5_percent']:.1f}%",
            f"{100 * float((rendered['middle_in_plane_percent'] <= 0.5).mean()):.0f}%",
        ),
        (
            "within 1% angular",
            f"{100 * result['share_angular_within_1_percent']:.1f}%",
            f"{100 * float((rendered['middle_angular_percent'] <= 1.0).mean()):.0f}%",
        ),
    ]
    table = "\n".join(f"| {a} | {b} | {c} |" for a, b, c in rows)
    statuses = ", ".join(f"{s['n']} {s['status']}" for s in result["status"])
    causes = ", ".join(f"{n} {cause}" for cause, n in result["worse_causes"].items())
    slow = sum(w["spin_rads"] < SLOW_SPIN_RADS or w["speed_ms"] < SLOW_SPEED_MS for w in result["worse"])
    ratios = {kind: [c["rmse_over_bound"] for c in result["coverage"] if c["component"].startswith(kind)] for kind in "vw"}
    v, w = (f"{min(ratios[kind]):.1f} to {max(ratios[kind]):.1f}" for kind in "vw")
    return f"""# Accuracy on scanned bodies

Six scanned bodies (three irregular, three regular), 4–8 mm, 100 frames at 4000 frames/s, 60 calibrated views, speeds to 4 m/s,
spins to 300 rad/s, every sequence started from nothing. This part is written by `python -m scripts.acceptance.acceptance_page` from
[acceptance_silhouette.json](../results/acceptance_silhouette.json) (seed {result["seed"]}, drawn after the estimator was final) and
[acceptance_rendered.csv](../results/acceptance_rendered.csv).

| median error | silhouette tier, 0.2 px, {result["sequences"]} sequences | rendered tier, matte, {len(rendered)} sequences |
| --- | --- | --- |
{table}

Silhouette tier: {statuses}. Outside the tolerances: {len(result["worse"])} sequences ({causes}), of which {slow} fly below
{SLOW_SPEED_MS} m/s or spin below {SLOW_SPIN_RADS:.0f} rad/s: large only against so small a speed or spin.

The 95% intervals cover the truth for {100 * result["coverage_v"]:.1f}% of the velocity components and
{100 * result["coverage_omega"]:.1f}% of the angular velocity components. RMS errors are {v} times the bound for v and
{w} times for the angular velocity. The bound is that of tangents under their noise model, and no weights that were tried reach it; a fit of
all outline samples with the true body is about four times as accurate
([decision 60](../decisions/0060-what-tangents-lose.md)). Noise is white along the outline and the calibration exact here; nature offers
neither.

"""


SLOW_SPIN_RADS, SLOW_SPEED_MS = 50.0, 0.3


def another_seed(other: dict[str, Any], tables: tuple[pd.DataFrame, pd.DataFrame]) -> str:
    """The part on another seed; ``tables`` of the sequences of this seed and of the other."""
    this, that = tables
    both = pd.concat(tables)
    median, first = other["median_percent"], within(that[:FIRST_RUN])
    return f"""{ANOTHER_SEED}
Shares within a tolerance relative to speed and spin depend on how many slow flights a seed draws. The same point estimates on seed
{other["seed"]} ([summary](../results/{OTHER.name}), [sequences](../results/{OTHER.with_suffix(".csv").name}; of the seed above:
[sequences](../results/{SILHOUETTE.with_suffix(".csv").name})), written by the same command with `--seed {other["seed"]}`.
The {FIRST_RUN} sequences first run there gave {_shares(first, FIRST_RUN)}; the seed was then extended to {len(that)}.

| | seed {other["seed"]} | above | both |
| --- | --- | --- | --- |
| within 0.5% in-plane | {" | ".join(f"{within(t)[0] / len(t):.1%} ({within(t)[0]} of {len(t)})" for t in (that, this, both))} |
| within 1% angular | {" | ".join(f"{within(t)[1] / len(t):.1%} ({within(t)[1]} of {len(t)})" for t in (that, this, both))} |
| below {SLOW_SPEED_MS} m/s or {SLOW_SPIN_RADS:.0f} rad/s | {" | ".join(str(slow_flights(t)) for t in (that, this, both))} |
| median error of spin | {" | ".join(f"{t['middle_angular_rads'].median():.3f} rad/s" for t in (that, this, both))} |

Medians there: {median["in_plane"]:.3f}% in-plane, {median["out_of_plane"]:.3f}% out-of-plane, {median["angular"]:.3f}% angular.
That seed was run before [notebook 9](../notebook/0009-body-fixed-field.md) and has the error bars of the former body-fixed error of
0.085 px: coverage v {100 * other["coverage_v"]:.1f}%, ω {100 * other["coverage_omega"]:.1f}%. The command would now give other error bars.

"""


def within(table: pd.DataFrame) -> tuple[int, int]:
    """How many sequences are within 0.5% in-plane, and within 1% angular."""
    return int((table["middle_in_plane_percent"] <= 0.5).sum()), int((table["middle_angular_percent"] <= 1.0).sum())


def slow_flights(table: pd.DataFrame) -> int:
    """How many sequences fly or spin slowly."""
    return int(((table["speed_ms"] < SLOW_SPEED_MS) | (table["spin_rads"] < SLOW_SPIN_RADS)).sum())


def _shares(counts: tuple[int, int], total: int) -> str:
    return f"{counts[0] / total:.1%} within 0.5% in-plane and {counts[1] / total:.1%} within 1% angular"


def rewritten(page: str, first: str, another: str) -> str:
    """The ``page`` with its first part, and that on another seed, in place of the former ones."""
    rest = page[page.index(END) :]
    before, after = rest.split(ANOTHER_SEED)
    return first + before + another + after[after.index("## ") :]


def main() -> int:
    """Write the page."""
    result, other = (json.loads(path.read_text(encoding="utf-8")) for path in (SILHOUETTE, OTHER))
    this, that = (pd.read_csv(path.with_suffix(".csv")) for path in (SILHOUETTE, OTHER))
    page = rewritten(PAGE.read_text(encoding="utf-8"), first_part(result, pd.read_csv(RENDERED)), another_seed(other, (this, that)))
    PAGE.write_text(page, encoding="utf-8")
    print(f"{PAGE}: written from {SILHOUETTE}, {OTHER}, the tables beside them, and {RENDERED}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
