"""Writes the first part of docs/studies/acceptance.md from the committed result files; the rest of the page stays as it is.

``python -m scripts.acceptance_page``.
"""

import json
from pathlib import Path
from typing import Any

import pandas as pd

PAGE = Path("docs/studies/acceptance.md")
SILHOUETTE = Path("docs/results/acceptance_silhouette.json")
RENDERED = Path("docs/results/acceptance_rendered.csv")
END = "How to make them again:"


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
spins to 300 rad/s, every sequence started from nothing. This part is written by `python -m scripts.acceptance_page` from
[acceptance_silhouette.json](../results/acceptance_silhouette.json) (seed {result["seed"]}, drawn after the estimator was final) and
[acceptance_rendered.csv](../results/acceptance_rendered.csv).

| median error | silhouette tier, 0.2 px, {result["sequences"]} sequences | rendered tier, matte, {len(rendered)} sequences |
| --- | --- | --- |
{table}

Silhouette tier: {statuses}. Outside the tolerances: {len(result["worse"])} sequences ({causes}), of which {slow} fly below
{SLOW_SPEED_MS} m/s or spin below {SLOW_SPIN_RADS:.0f} rad/s: large only against so small a speed or spin.

The 95% intervals cover the truth for {100 * result["coverage_v"]:.1f}% of the velocity components and
{100 * result["coverage_omega"]:.1f}% of the angular velocity components. RMS errors are {v} times the bound for v and
{w} times for the angular velocity. The bound takes neighbouring tangents to say more than they do: generalised least squares
with the same noise model is not more accurate ([decision 9](../decisions/0009-body-fixed-field.md)). Noise is white along the
outline and the calibration exact here; nature offers neither.

"""


SLOW_SPIN_RADS, SLOW_SPEED_MS = 50.0, 0.3


def main() -> int:
    """Write the page."""
    page = PAGE.read_text(encoding="utf-8")
    rest = page[page.index(END) :]
    result = json.loads(SILHOUETTE.read_text(encoding="utf-8"))
    PAGE.write_text(first_part(result, pd.read_csv(RENDERED)) + rest, encoding="utf-8")
    print(f"{PAGE}: written from {SILHOUETTE} and {RENDERED}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
