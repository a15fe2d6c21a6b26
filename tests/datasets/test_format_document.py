"""What docs/format.md says is what the code does."""

import json
import re
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator

from datasets.schema_errors import schema

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "format.md").read_text(encoding="utf-8")
KINDS = sorted(path.name.removesuffix(".schema.json") for path in (ROOT / "datasets" / "schemas").glob("*.schema.json"))


def block(language: str) -> str:
    found = re.findall(rf"```{language}\n(.*?)```", TEXT, flags=re.DOTALL)
    assert len(found) == 1
    return found[0]


def test_the_worked_example_writes_what_the_page_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(block("python"), "docs/format.md", "exec"), {})
    written = (tmp_path / "falling_square" / "observation.json").read_text(encoding="utf-8")
    assert written == block("json"), f"docs/format.md should show:\n{written}"
    assert sorted(path.name for path in (tmp_path / "falling_square").iterdir()) == [
        "observation.json",
        "outlines_hsv.npz",
        "view_outlines.npz",
    ]


def test_the_example_fits_the_schema():
    Draft202012Validator(schema("observation")).validate(json.loads(block("json")))


def test_links_lead_somewhere():
    for target in re.findall(r"\]\((\.\./[^)]+)\)", TEXT):
        assert (ROOT / "docs" / target).exists(), target


@pytest.mark.parametrize("kind", KINDS)
def test_schemas_are_valid_and_described(kind):
    Draft202012Validator.check_schema(schema(kind))
    assert f"{kind}.schema.json" in TEXT
    assert schema(kind)["properties"]["format"]["const"] == f"tumble {kind}"
