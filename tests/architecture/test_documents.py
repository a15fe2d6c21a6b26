"""Documents: links lead somewhere, and so do commands; decisions are dated and a page at most; notebook pages say what binds now."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
DOCUMENTS = sorted([*(ROOT / "docs").rglob("*.md"), *ROOT.glob("*.md")])
DECISIONS = sorted((ROOT / "docs" / "decisions").glob("0*.md"))
NOTEBOOK = sorted((ROOT / "docs" / "notebook").glob("0*.md"))
MOST_LINES, MOST_BYTES = 60, 6000
RUN = re.compile(r"python -m ([\w.]*\w)")
OWN = ("rivals", "scripts", "studies", "tests", "tumble")
LINK = re.compile(r"\]\(([^)\s]+)\)")


def name_of(path: Path) -> str:
    return str(path.relative_to(ROOT))


def anchors_of(path: Path) -> set[str]:
    """The anchors of a page's headings, as the hosts of Markdown make them."""
    headings = re.findall(r"^#+ (.*)$", path.read_text(encoding="utf-8"), flags=re.MULTILINE)
    plain = (re.sub(r"\]\([^)]*\)", "]", heading) for heading in headings)
    return {re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-") for heading in plain}


def leads_nowhere(page: Path, link: str) -> bool:
    """Whether a link of a page has no target in this repository; addresses elsewhere are not looked at."""
    if re.match(r"[a-z]+:", link):
        return False
    place, _, anchor = link.partition("#")
    target = page if place == "" else (page.parent / place).resolve()
    return not target.exists() or (anchor != "" and target.suffix == ".md" and anchor not in anchors_of(target))


@pytest.mark.parametrize("page", DOCUMENTS, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    assert [link for link in LINK.findall(text) if leads_nowhere(page, link)] == []


def test_programs_that_documents_name_are_there() -> None:
    pages = [*DOCUMENTS, ROOT / "Makefile"]
    named = {module: name_of(page) for page in pages for module in RUN.findall(page.read_text(encoding="utf-8"))}
    own = {module: ROOT / module.replace(".", "/") for module in named if module.split(".")[0] in OWN}
    lost = [module for module, path in own.items() if not path.with_suffix(".py").is_file() and not (path / "__main__.py").is_file()]
    assert [(module, named[module]) for module in lost] == []


@pytest.mark.parametrize("page", DECISIONS, ids=name_of)
def test_a_decision_is_dated_and_one_page(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    number = int(page.name[:4])
    assert text.startswith(f"# {number}. "), "expected the file's number as the heading's"
    assert re.match(r"# .*\n\n20\d\d-\d\d-\d\d\b", text), "expected a date below the heading"
    assert len(text.splitlines()) <= MOST_LINES
    assert len(text.encode()) <= MOST_BYTES


@pytest.mark.parametrize("page", NOTEBOOK, ids=name_of)
def test_a_page_of_the_notebook_says_what_binds_now(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert text.startswith(f"# {int(page.name[:4])}. ")
    assert re.match(r"# .*\n\n\*Notebook of 20\d\d-\d\d-\d\d; what binds now: \[decision \d+\]\(\.\./decisions/", text)


@pytest.mark.parametrize("pages", [DECISIONS, NOTEBOOK], ids=["decisions", "notebook"])
def test_the_index_has_every_page(pages: list[Path]) -> None:
    folder = pages[0].parent
    index = (folder / "README.md").read_text(encoding="utf-8")
    assert re.findall(r"\]\((0\d+[^)]*)\)", index) == [page.name for page in pages]


def test_no_number_is_given_twice() -> None:
    kept = {page.name[:4]: page.name for page in NOTEBOOK}
    assert {page.name for page in DECISIONS if page.name[:4] in kept} == set()
