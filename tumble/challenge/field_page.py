"""The result of a field challenge as files: ``summary.json``, a page for people, and every table as CSV."""

import json
import math
from dataclasses import fields
from pathlib import Path

import pandas as pd

from datasets.atomic_files import written_whole
from datasets.json_documents import plain
from tumble.challenge.field_figures import effects_table, field_figures, field_summary, reliability
from tumble.challenge.field_scoring import FieldScored
from tumble.challenge.figures import Figure


def write_field_result(scored: FieldScored, out: Path) -> None:
    """Write all of them."""
    tables: dict[str, pd.DataFrame] = {each.name: getattr(scored, each.name) for each in fields(scored)}
    tables["reliability"] = reliability(scored.probabilities)
    for name, table in tables.items():
        with written_whole(out / f"{name}.csv") as temporary:
            table.to_csv(temporary, index=False, float_format="%.6g")
    _write(out / "summary.json", json.dumps(plain(field_summary(scored)), indent=1) + "\n")
    _write(out / "field.md", page(scored))


def page(scored: FieldScored) -> str:
    """The page, in Markdown."""
    cases = scored.cases
    kinds = ", ".join(f"{count} {str(kind).replace('_', ' ')}" for kind, count in cases["measured"].value_counts().items())
    figures = pd.DataFrame([_row(figure) for figure in field_figures(scored)])
    times = f"CPU time of one campaign: median {cases['cpu_s'].median():.1f} s, slowest {cases['cpu_s'].max():.1f} s."
    parts = [
        "# Field challenge",
        f"{len(cases)} campaigns ({kinds}), {int(cases['flights'].sum())} flights. Intervals are 95%. {times}",
        _table(figures),
        "## Are stated probabilities right?",
        _table(reliability(scored.probabilities).round(1)),
        "## Effect by effect",
        "How often each was hidden, then named or in a group, and how often it was a false name.",
        _table(effects_table(scored)),
    ]
    return "\n\n".join(parts) + "\n"


def _row(figure: Figure) -> dict[str, str]:
    interval = f"{figure.low:.3g} to {figure.high:.3g}" if math.isfinite(figure.low) else ""
    asked = [f"at least {figure.least:g}"] if math.isfinite(figure.least) else []
    asked += [f"at most {figure.most:g}"] if math.isfinite(figure.most) else []
    return {
        "figure": figure.what,
        "value": f"{figure.value:.3g} {figure.unit}",
        "interval": interval,
        "n": str(figure.n),
        "asked": " and ".join(asked),
        "verdict": figure.verdict.lower(),
    }


def _table(table: pd.DataFrame) -> str:
    if table.empty:
        return "None."
    rows = [list(table.columns), ["---"] * len(table.columns), *table.astype(str).to_numpy().tolist()]
    return "\n".join("| " + " | ".join(str(cell) for cell in row) + " |" for row in rows)


def _write(path: Path, text: str) -> None:
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
