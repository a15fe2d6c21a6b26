"""The report of ``validate-contact``: one HTML page from a ``contact_validation.json``."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from datasets.atomic_files import written_whole
from datasets.json_documents import revived
from estimator.contact_validation.verdict import NOTHING
from tumble.numbers import compact, with_sigma
from tumble.reports.contact_charts import contact_ladder_chart, contact_map_chart, experiment_chart, experiments_of, map_sentence
from tumble.versions import versions

MAPS_SHOWN = 6


def write_contact_page(document: Mapping[str, Any], path: Path) -> None:
    """Write the report of a validation to ``path``."""
    text = render_contact(document)
    with written_whole(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def render_contact(document: Mapping[str, Any]) -> str:
    """The page's text."""
    environment = Environment(loader=PackageLoader("tumble.reports"), autoescape=True, undefined=StrictUndefined, trim_blocks=True)
    environment.filters.update(value=_value, pm=_plus_minus, size=_size)
    found = {"heights": None, **revived(dict(document))}
    maps = [{**m, "chart": Markup(contact_map_chart(m)), "sentence": map_sentence(m)} for m in found["maps"]]
    rungs = found["ladder"]["rungs"]
    return environment.get_template("contact.html.j2").render(
        d=found,
        tone="good" if found["verdict"]["kind"] == NOTHING else "neutral",
        figures=[(name, Markup(experiment_chart(found, rows))) for name, rows in experiments_of(found["impacts"])] if rungs else [],
        ladder=Markup(contact_ladder_chart(rungs, len(found["impacts"]))) if rungs else None,
        maps=maps[:MAPS_SHOWN],
        more_maps=maps[MAPS_SHOWN:],
        made_by=versions()["tumble"],
    )


def _value(entry: Mapping[str, Any]) -> str:
    unit = "" if entry["unit"] == "1" else f" {entry['unit']}"
    return f"{entry['name'].replace('_', ' ')} {_plus_minus([entry['value'], entry['sigma']])}{unit}"


def _plus_minus(pair: list[float]) -> str:
    return with_sigma(pair[0], pair[1]) if pair[1] > 0 else compact(pair[0], 0)


def _size(size: float | None) -> str:
    return "no size tried" if size is None else f"{size:.2g}"
