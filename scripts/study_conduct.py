"""One study from its cases to its page: run what is missing, write the tidy tables, draw, write."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure

from scripts.study_pages import write_csv
from scripts.study_runs import Case, Options, parsed_options, run_cases
from scripts.study_summaries import summary
from studies.looks.figures import write_figure
from studies.looks.words import write_page


@dataclass(frozen=True)
class Study:
    """What makes a study: name of its script, its description, the columns that name a point, its cases, its figure and its page.

    ``drawn`` gets the medians, ``page`` the rows of all sequences, the medians and the options. ``absolute``: errors in mm/s and rad/s.
    """

    name: str
    description: str
    by: tuple[str, ...]
    cases: Callable[[Options], list[Case]]
    drawn: Callable[[pd.DataFrame], Figure]
    page: Callable[[pd.DataFrame, pd.DataFrame, Options], list[str]]
    absolute: bool = False


def conduct(study: Study, arguments: Sequence[str] | None) -> int:
    """Run and write everything; exit code 1 when a sequence could not be made."""
    began = time.monotonic()
    options = parsed_options(study.name, study.description, arguments)
    table, failed = run_cases(study.cases(options), options)
    results, pages = options.docs / "results", options.docs / "studies"
    table = write_csv(table, results / f"{options.name}.csv")
    points = write_csv(summary(table, study.by, absolute=study.absolute), results / f"{options.name}_summary.csv")
    write_figure(study.drawn(points), pages / f"{options.name}.png")
    lost = [f"**Sequences that could not be made and are missing here: {len(failed)}.**", ""] if failed else []
    page = study.page(table, points, options)
    write_page([*page[:2], *lost, *page[2:]], pages / f"{options.name}.md")
    for message in failed:
        print(message)
    print(points.to_string(index=False, float_format="%.4g"))
    print(f"{len(table)} sequences, {len(failed)} failed, {time.monotonic() - began:.0f} s: {pages / options.name}.md")
    return 1 if failed else 0
