"""docs/architecture.md is what the source says, and its steps are on the way from the entry module."""

import pytest

from scripts.pages import architecture_page
from scripts.pages.source_reading import function, reached_from


def test_the_page_is_up_to_date() -> None:
    written = architecture_page.PAGE.read_text(encoding="utf-8")
    made = architecture_page.page()
    assert architecture_page.structure(written) == architecture_page.structure(made), "run `python -m scripts.pages.architecture_page`"


@pytest.mark.parametrize("way", [architecture_page.FREE, architecture_page.IMPACTS])
def test_the_steps_of_a_way_are_reached_from_its_first(way: tuple[str, ...]) -> None:
    first, *others = map(architecture_page.place_of, way)
    assert set(others) <= reached_from(first)


@pytest.mark.parametrize("name", [*architecture_page.steps(), *(name for _, name in architecture_page.DOORS)])
def test_what_the_page_names_is_there(name: str) -> None:
    assert function(name).name == name.rpartition(".")[2]


def test_a_step_that_is_not_on_the_way_is_refused() -> None:
    with pytest.raises(ValueError, match="expected one function fit_rig on the way"):
        architecture_page.place_of("fit_rig")


def test_arrows_give_all_imports_back() -> None:
    below: dict[str, set[str]] = {}
    drawn = architecture_page.arrows()
    for room in reversed(architecture_page.order()):
        direct = {other for one, other in drawn if one == room}
        below[room] = direct.union(*(below[other] for other in direct))
    imports = architecture_page.rooms_imported()
    assert [room for room in below if not imports[room] <= below[room]] == []


def test_only_files_and_lines_are_no_structure() -> None:
    text = "head | 1 | 2 |\n| --- | --- | --- | --- | --- |\n| `a` | is | 3 | 100 | b |\n"
    assert architecture_page.structure(text) == architecture_page.structure(text.replace("| 3 | 100 |", "| 4 | 300 |"))
    assert architecture_page.structure(text) != architecture_page.structure(text.replace("| b |", "| c |"))
