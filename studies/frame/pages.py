"""A study's page and picture, written from its result: at the end of a run, or anew from committed rows where the words change."""

from collections.abc import Mapping
from pathlib import Path

from studies.frame.digests import of_bytes, source_of
from studies.frame.results import Result
from studies.frame.study import Study
from studies.reporting.figures import write_figure
from studies.reporting.words import page_text, paragraph, write_page

DRAWING = ("studies.reporting.figures", "studies.reporting.medians")
"""What all pictures are drawn with."""


def write_pages(study: Study, result: Result, folder: Path) -> Path:
    """Write page and picture into ``folder``; where the page lies."""
    write_figure(study.picture(result), picture_path(study.name, folder), drawn_from=drawn_from_digest(study, result))
    path = folder / f"{study.name}.md"
    write_page(page_lines(study, result), path)
    return path


def text_of(study: Study, result: Result) -> str:
    """The page's text."""
    return page_text(page_lines(study, result))


def page_lines(study: Study, result: Result) -> list[str]:
    """What the study's page says, with what is the same for all: what could not be made, what made it, and how to repeat it."""
    heading, *rest = study.page(result)
    lost = [f"**Cases that could not be measured and are missing here: {len(result.failed)}.**", ""] if result.failed else []
    return [heading, "", *lost, *rest, "", *how_made(result)]


def how_made(result: Result) -> list[str]:
    """The last lines of a page."""
    asked = ", ".join(f"{key} {_said(value)}" for key, value in result.settings.items())
    size = " --small" if result.settings["size"] == "small" else ""
    drawn = f" --count {result.settings['count']} --seed {result.settings['seed']}"
    particles = " --particles FOLDER" if result.settings["bodies"] == "scanned" else ""
    command = f"python -m studies {result.study} --out FOLDER{size}{drawn}{particles}"
    again = result.again
    same = f"Of {again.of} cases {again.cases}, drawn at random, are the same with code of {_digests(again.code)}." if again else ""
    made = paragraph(
        f"Settings: {asked}. Made with code of {_digests(result.code)} (digests of what it uses of them;",
        "`python -m studies --list` says whether they are those of now),",
        f"{', '.join(f'{name} {version}' for name, version in result.versions.items())}.",
        *([same] if same else []),
        f"[Every row](../results/{result.study}.csv), [what made them](../results/{result.study}.json);",
        f"the page is written from these files. Cases took {result.rows['cpu_s'].sum() / 60:.1f} min of CPU.",
    )
    return ["## Again", "", "```sh", command, "```", "", *made]


def _digests(code: Mapping[str, str]) -> str:
    return ", ".join(f"`{name}` {digest}" for name, digest in code.items())


def _said(value: object) -> str:
    return " to ".join(str(each) for each in value) if isinstance(value, (list, tuple)) and len(value) == 2 else str(value)


def picture_path(name: str, folder: Path) -> Path:
    """Where a study's picture lies."""
    return folder / f"{name}.png"


def drawn_from_digest(study: Study, result: Result) -> str:
    """The digest of the rows that a picture shows and of the files that draw it."""
    return of_bytes(result.rows_digest.encode(), *(source_of(module).read_bytes() for module in (study.module, *DRAWING)))
