"""The command line: ``python -m studies NAME --out DIR [--small] [--jobs N] [--count N] [--seed S] [--particles FOLDER]``.

Rows, page and picture are written into ``DIR``; with ``--docs docs`` they go where committed ones lie. ``--page`` writes page and picture
anew from the rows that are there and measures nothing, ``--together`` the page over all studies. ``--again N``: make N cases of the
committed result anew, and say whether the code as it is makes the same rows. ``--list``: all studies, and of which code the committed
results are.
"""

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from datasets.errors import TumbleError
from studies.frame.again import made_again
from studies.frame.conduct import Conduct, conduct
from studies.frame.digests import of_libraries, of_modules
from studies.frame.pages import write_pages
from studies.frame.results import Result, read_result, write_result
from studies.frame.study import Study
from studies.reporting.words import write_page
from tumble.cli.exit_codes import ALL_MEASURED, BAD_INPUT, INCOMPLETE
from tumble.cli.options import add_engine, executor_of, positive

DOCS = Path("docs")
TOGETHER = "uncertainty.md"
Together = Callable[[Mapping[str, Result]], Sequence[str]]
"""Writes the page over all results."""


def main(studies: Sequence[Study], together: Together, arguments: Sequence[str] | None = None) -> int:
    """Run a study, or write its page anew, or list all; ``together`` writes the page over all."""
    given = _parser(studies).parse_args(arguments)
    try:
        if given.together:
            return _write_together(studies, together, given.docs or DOCS)
        return _listed(studies, given.docs or DOCS) if given.list else _run(studies, given)
    except TumbleError as error:
        print(error, file=sys.stderr)
        return BAD_INPUT


def _parser(studies: Sequence[Study]) -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m studies", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(study.name for study in studies) + "; several, or none: all")
    parser.add_argument("--out", type=Path, default=Path("out/studies"), help="where cases are kept (default: %(default)s)")
    parser.add_argument("--docs", type=Path, help="write the result to DOCS/results, page and picture to DOCS/studies")
    parser.add_argument("--small", action="store_true", help="the small size: minutes on two cores")
    parser.add_argument("--count", type=positive, help="repetitions of every point, instead of the size's")
    parser.add_argument("--seed", type=not_negative, help="instead of the size's")
    parser.add_argument("--particles", type=Path, help="folder with the scanned particles (PLY); without it the project's own bodies")
    parser.add_argument("--page", action="store_true", help="write page and picture anew from the rows that are there")
    parser.add_argument("--again", type=positive, metavar="N", help="make N cases of the committed result anew, drawn at random")
    parser.add_argument("--together", action="store_true", help="write the page over all committed results")
    parser.add_argument("--list", action="store_true", help="name all studies, and of which code the committed results are")
    parser.add_argument("-q", "--quiet", action="store_true", help="no progress")
    add_engine(parser)
    return parser


def not_negative(text: str) -> int:
    """A whole number of at least none, for argparse."""
    value = int(text)
    if value < 0:
        raise argparse.ArgumentTypeError(f"expected a whole number of at least 0, got {text}")
    return value


def _run(studies: Sequence[Study], given: argparse.Namespace) -> int:
    by_name = {study.name: study for study in studies}
    unknown = [name for name in given.names if name not in by_name]
    if unknown:
        raise TumbleError(f"studies: expected names among {', '.join(by_name)}, got {', '.join(unknown)}")
    return max(_one(by_name[name], given) for name in given.names or by_name)


def _one(study: Study, given: argparse.Namespace) -> int:
    results, pages = _folders(study, given)
    if given.page:
        print(write_pages(study, read_result(study.name, results), pages))
        return ALL_MEASURED
    if given.again:
        return _again(study, given)
    chosen = {key: value for key in ("seed", "count") if (value := getattr(given, key)) is not None}
    settings = replace(study.plan.small if given.small else study.plan.full, **chosen)
    size = "small" if given.small else "full"
    how = Conduct(executor_of(given), given.out / study.name, size, given.particles, quiet=given.quiet)
    result = write_result(conduct(study, settings, how), results)
    for message in result.failed:
        print(message)
    print(write_pages(study, result, pages))
    return INCOMPLETE if result.failed else ALL_MEASURED


def _again(study: Study, given: argparse.Namespace) -> int:
    """Whether cases of the committed result come out as they are; where all do, that is written into it and on to its page."""
    results, pages = (given.docs or DOCS) / "results", (given.docs or DOCS) / "studies"
    before = read_result(study.name, results)
    how = Conduct(executor_of(given), given.out / f"{study.name}_again", before.settings["size"], given.particles, quiet=given.quiet)
    result, different = made_again(study, before, given.again, how)
    if different:
        print(f"{study.name}: {len(different)} of {given.again} cases are others now ({', '.join(different)}): it has to be measured anew")
        return INCOMPLETE
    write_result(result, results)
    write_pages(study, result, pages)
    print(f"{study.name}: {state(study, results)}")
    return ALL_MEASURED


def _folders(study: Study, given: argparse.Namespace) -> tuple[Path, Path]:
    own = given.out / study.name
    return (own, own) if given.docs is None else (given.docs / "results", given.docs / "studies")


def committed(studies: Sequence[Study], results: Path) -> dict[str, Result]:
    """The results that are there, by study."""
    return {study.name: read_result(study.name, results) for study in studies if (results / f"{study.name}.json").is_file()}


def _write_together(studies: Sequence[Study], together: Together, docs: Path) -> int:
    write_page(together(committed(studies, docs / "results")), docs / "studies" / TOGETHER)
    print(docs / "studies" / TOGETHER)
    return ALL_MEASURED


def _listed(studies: Sequence[Study], docs: Path) -> int:
    """Name, question, and the state of the committed result of every study."""
    for study in studies:
        print(f"{study.name:16} {study.question}\n{'':16} {state(study, docs / 'results')}")
    return ALL_MEASURED


def state(study: Study, results: Path) -> str:
    """Of which code a committed result is, in words."""
    if not (results / f"{study.name}.json").is_file():
        return "no committed result"
    result = read_result(study.name, results)
    if dict(result.sources) != of_modules(study.plan.modules):
        return "older than its plan: has to be measured anew"
    now = of_libraries(study.plan.modules)
    older = [name for name, digest in result.code.items() if digest != now[name]]
    if not older:
        return "made with this code"
    same = result.again if result.again and dict(result.again.code) == now else None
    told = f"; of {same.of} cases {same.cases}, drawn at random, come out the same with this code" if same else ""
    return f"made with other code of {', '.join(older)}{told}"
