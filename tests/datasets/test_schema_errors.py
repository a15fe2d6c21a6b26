"""Lists of numbers are checked as a whole, and what is no number among them is still found where it is."""

import pytest

from datasets.schema_errors import _inlined, _Validator

SCHEMA = {
    "properties": {"row": {"type": "array", "items": {"$ref": "#/$defs/value"}}, "counts": {"type": "array", "items": {"type": "integer"}}},
    "$defs": {"value": {"type": ["number", "string"], "pattern": "^(NaN)$"}},
}


@pytest.mark.parametrize(
    ("document", "place"),
    [
        ({"row": [1.0, 2, "NaN"]}, None),
        ({"row": [1.0, "a"]}, "$.row[1]"),
        ({"row": [True, 1.0]}, "$.row[0]"),
        ({"row": [0.5, None]}, "$.row[1]"),
        ({"counts": [1, 2.0]}, "$.counts[1]"),
    ],
)
def test_what_is_no_number_is_found(document: dict[str, list[object]], place: str | None) -> None:
    checked = _Validator(_inlined(SCHEMA, SCHEMA["$defs"]))
    assert [error.json_path for error in checked.iter_errors(document)] == ([] if place is None else [place])
