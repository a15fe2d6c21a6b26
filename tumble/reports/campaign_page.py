"""The report of ``compare``, ``diagnose``, ``explain`` and ``ladder``: one HTML page from a ``diagnosis.json``, alike for all four."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from datasets.atomic_files import written_whole
from datasets.json_documents import revived
from datasets.vocabulary.effects import begins
from estimator.reports.misfit_words import p_value
from tumble.limiting import facts_told
from tumble.numbers import compact
from tumble.reports.campaign_charts import autocorrelation_chart, ladder_chart
from tumble.reports.drop_words import drops_sentence
from tumble.reports.map_charts import map_chart
from tumble.reports.payload import flat
from tumble.reports.verdict import percent
from tumble.reports.words import model_words, names_in_words, rms_word, rung_name
from tumble.versions import versions

TITLES = {
    "compare": "Model against measurement",
    "diagnose": "Which effect is missing?",
    "explain": "Explaining a campaign",
    "ladder": "The error, effect by effect",
}


def write_campaign_page(document: Mapping[str, Any], path: Path) -> None:
    """Write the report of a diagnosis to ``path``."""
    text = render(document)
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def render(document: Mapping[str, Any]) -> str:
    """The page's text."""
    environment = Environment(loader=PackageLoader("tumble.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters.update(words=names_in_words, value=_value, interval=_interval, p=p_value, percent=percent)
    environment.filters |= {"size": _size, "begins": begins}
    found = {
        "drops": [],
        "not_applicable": {},
        "begun": None,
        "facts": [],
        "limits": None,
        "values_in_place": [],
        **revived(dict(document)),
    }
    of_residuals = found.get("model_of_residuals", found["model"])
    return environment.get_template("campaign.html.j2").render(
        title=TITLES[found["verb"]],
        d=found,
        model=", ".join(model_words(found["model"])),
        of_residuals=", ".join(model_words(of_residuals)) if set(of_residuals) != set(found["model"]) else None,
        facts=facts_told(found["facts"]),
        drops=drops_sentence(found["drops"]) if found["drops"] else "",
        unit=found.get("unit", "px"),
        error=rms_word(found.get("unit", "px")),
        tone="good" if _nothing_to_do(found) else "neutral",
        missing=found["diagnosis"] is not None and bool(found["diagnosis"]["missing"]),
        maps=_maps(found["maps"] or []),
        unknown=_unknown(found.get("unknown")),
        ladder=_ladder(found["ladder"], found["noise_floor"], found.get("unit", "px")),
        steps=found["steps"] or [],
        own=_own(found),
        autocorrelation=Markup(autocorrelation_chart(found["noise_floor"])) if found["noise_floor"] else None,
        configuration=flat(found["configuration"]),
        libraries=flat(found["versions"]),
        made_by=versions()["tumble"],
    )


def _nothing_to_do(found: Mapping[str, Any]) -> bool:
    """Whether nothing is missing, the fit settled, what was found is established, rather that than unknown, and residuals are noise."""
    if not found["settled"] or found["verdict"]["kind"] not in ("nothing missing", "found"):
        return False
    complete = found["diagnosis"] is not None and not found["diagnosis"]["missing"] and found.get("unknown") is None
    sure = all(step["established"] for step in found["steps"] or [])
    doubts = [sum(name["probability"] for name in group["names"] if name["unknown"]) for group in found.get("names") or []]
    likely = complete and found["diagnosis"]["probability"] >= 0.5
    noise = not (found["noise_floor"] or {}).get("explainable", False)
    return bool(likely and sure and max(doubts, default=0.0) < 0.5 and noise)


def _maps(entries: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """The best map of every axis first, with its picture; the others after, marked ``more``."""
    seen: set[str] = set()
    first: list[dict[str, Any]] = []
    more: list[dict[str, Any]] = []
    for entry in entries:
        (more if entry["name"] in seen else first).append({**entry, "chart": Markup(map_chart(entry)), "more": entry["name"] in seen})
        seen.add(entry["name"])
    return [*first, *more]


def _ladder(rungs: Sequence[Mapping[str, Any]] | None, floor: Mapping[str, Any] | None, unit: str) -> dict[str, Any] | None:
    if not rungs or floor is None:
        return None
    rows, before = [], None
    for rung in rungs:
        value = rung["held_out"]["rms_px"]
        change = "" if before is None else f"{value / before - 1.0:+.1%}"
        above = f"{value / floor['floor_px'] - 1.0:+.0%}"
        rows.append({**rung, "name": rung_name(rung), "change": change, "above": above})
        before = value
    return {
        "rows": rows,
        "velocity": rows[0]["velocity"] is not None,
        "chart": Markup(ladder_chart(rungs, floor["floor_px"], unit)),
        "floor_px": floor["floor_px"],
    }


def _own(found: Mapping[str, Any]) -> dict[str, Markup]:
    """Pictures of the values that every sequence has for itself, by effect."""
    values = [*(found["values"] or []), *found["values_in_place"]]
    if all(value["sequence"] is None for value in values):
        return {}
    from tumble.reports.sequence_charts import sequence_charts  # noqa: PLC0415 - loads Matplotlib: 0.5 s, which few pages need

    recordings = [str(each["recording"]) for each in found["drops"]]
    charts = sequence_charts(values, found["sequences"], recordings)
    return {effect: Markup(chart) for effect, chart in charts.items()}


def _unknown(entry: Mapping[str, Any] | None) -> dict[str, Any] | None:
    """What no effect of the catalogue explains, with the pictures of its shapes."""
    if entry is None:
        return None
    from tumble.reports.shape_charts import shape_chart  # noqa: PLC0415 - as above

    return {**entry, "charts": [{**shape, "chart": Markup(shape_chart(shape))} for shape in entry["shapes"]]}


def _value(entry: Mapping[str, Any]) -> str:
    unit = "" if entry["unit"] == "1" else f" {entry['unit']}"
    return f"{entry['parameter'].replace('_', ' ')} = {compact(entry['value'], entry['sigma'])}{unit}"


def _interval(entry: Mapping[str, Any]) -> str:
    low, high = entry["interval"]
    return f"{low:.4g} to {high:.4g}"


def _size(value: float) -> str:
    return f"{value:.2g}" if math.isfinite(value) else "–"
