"""What a table of scored impacts says, as figures and as parts of a page."""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from datasets.scoring.impacts import impact_summary


def impact_figures(table: pd.DataFrame) -> dict[str, Any]:
    """The figures a reader asks for first, of all impacts and of the first of each sequence, and what was missed."""
    sequences = table.drop_duplicates("sequence")
    missed = table[~table["found"].astype(bool)]
    return {
        "sequences": len(sequences),
        "statuses": {str(k): int(v) for k, v in sequences["status"].value_counts().items()},
        "all_impacts": impact_summary(table),
        "first_impacts": impact_summary(table[table["impact"] == 1]),
        "median_cpu_s": float(sequences["cpu_s"].median()),
        "unmatched": int(sequences["unmatched"].sum()),
        "missed": missed[["sequence", "impact", "status", "message"]].to_dict("records"),
    }


def impacts_table(result: Mapping[str, Any]) -> str:
    """First and all impacts: found, errors, coverage."""
    first, every = result["first_impacts"], result["all_impacts"]
    rows = [("impacts", "impacts", "{:d}"), ("found", "found", "{:d}")]
    rows += [("error of the time, median (frames)", "median_time_error_frames", "{:.3f}")]
    for side in ("before", "after"):
        for key, name in (("in_plane", "in-plane v"), ("out_of_plane", "out-of-plane v"), ("angular", "ω")):
            rows.append((f"{name} {side} the impact, median error (%)", f"median_{side}_{key}_percent", "{:.3f}"))
    coverages = ("time", "before_v", "before_omega", "after_v", "after_omega")
    for key, name in zip(coverages, ("time", "v before", "ω before", "v after", "ω after"), strict=True):
        rows.append((f"95% intervals of {name} that hold the truth", f"coverage_{key}", "{:.1%}"))
    body = "\n".join(f"| {name} | {_cell(first, key, form)} | {_cell(every, key, form)} |" for name, key, form in rows)
    return f"| | first impacts | all impacts |\n| --- | --- | --- |\n{body}"


def _cell(told: Mapping[str, Any], key: str, form: str) -> str:
    return form.format(told[key]) if key in told else "–"


def statuses_of(result: Mapping[str, Any]) -> str:
    """How many sequences ended how."""
    return ", ".join(f"{count} {status}" for status, count in result["statuses"].items())


def not_found(result: Mapping[str, Any]) -> str:
    """The impacts that were missed, and what was said of their sequences."""
    missed = "\n".join(f"- {m['sequence']}, impact {m['impact']}: {m['status']}. {m['message']}" for m in result["missed"])
    invented = f"\n\nMeasured impacts that are none: {result['unmatched']}." if "unmatched" in result else ""
    return f"Not found:\n\n{missed or 'None.'}{invented}"
