"""Names that become names of files."""

import re

import pytest

from datasets.names import file_name
from datasets.schema_errors import schema


@pytest.mark.parametrize(
    ("given", "name"),
    [
        ("toss_1.a-b", "toss_1.a-b"),
        ("Würfel 1", "Wurfel_1"),
        ("Wu\u0308rfel", "Wurfel"),
        ("[red]x[/red]", "_red_x__red_"),
        (".hidden", "_hidden"),
        ("投げ 3", "___3"),
        ("a\nb", "a_b"),
        ("", "_"),
    ],
)
def test_a_name_fits_the_schema(given, name):
    assert file_name(given) == name
    assert re.fullmatch(schema("estimate")["properties"]["name"]["pattern"], name)
