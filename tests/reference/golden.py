"""Whether results are what they were: the golden corpus made anew, and a table of what differs.

``python -m tests.reference.golden`` prints every quantity that moved by more than :mod:`tests.reference.golden_records` allows and exits
with 1 where there is one. ``--write`` renews the corpus: a change of it is a commit of its own, with the reason. ``--only CASE`` compares
some cases.
"""

import argparse
import json
import math
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.reference.golden_cases import CASES
from tests.reference.golden_records import Difference, Record, differences, document_of, record_of

CORPUS = Path(__file__).resolve().parents[1] / "golden" / "corpus.json"
COLUMNS = ("case", "quantity", "before", "after", "in sigma")


def corpus() -> dict[str, Record]:
    """The committed records by case."""
    return {case: record_of(document) for case, document in json.loads(CORPUS.read_text(encoding="utf-8")).items()}


def write(records: dict[str, Record]) -> None:
    """Replace the records of these cases in the corpus."""
    known = json.loads(CORPUS.read_text(encoding="utf-8")) if CORPUS.exists() else {}
    known |= {case: document_of(record) for case, record in records.items()}
    CORPUS.write_text(_lines({case: known[case] for case in CASES if case in known}) + "\n", encoding="utf-8")


def _lines(documents: Mapping[str, Any], depth: int = 3) -> str:
    """JSON with a line for every quantity, so that a difference of two versions can be read."""
    if not depth or not documents:
        return json.dumps(documents, ensure_ascii=False)
    inner = (f"{json.dumps(key, ensure_ascii=False)}: {_lines(each, depth - 1)}" for key, each in documents.items())
    return "{\n" + ",\n".join(inner) + "\n}"


def table(found: Iterable[Difference]) -> str:
    """Differences as lines of aligned columns."""
    rows = [COLUMNS, *((d.case, d.quantity, _word(d.before), _word(d.after), _sigmas(d)) for d in found)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return "\n".join("  ".join(word.ljust(width) for word, width in zip(row, widths, strict=True)).rstrip() for row in rows)


def _word(value: Any) -> str:
    if isinstance(value, tuple):
        return "{:.6g} ± {:.3g}".format(*value)
    return f"{value:.6g}" if isinstance(value, float) else "-" if value is None else str(value)


def _sigmas(difference: Difference) -> str:
    return "" if math.isnan(difference.sigmas) else f"{difference.sigmas:.3f}"


def main(words: Sequence[str] | None = None) -> int:
    """Compare or renew the corpus."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", nargs="+", choices=list(CASES), default=list(CASES), metavar="CASE", help=f"of {', '.join(CASES)}")
    parser.add_argument("--write", action="store_true", help="renew the corpus")
    given = parser.parse_args(words)
    made = {case: CASES[case]() for case in given.only}
    known = corpus() if CORPUS.exists() else {}
    nothing = Record({}, {}, {})
    found = [each for case, record in made.items() for each in differences(case, known.get(case, nothing), record)]
    print(table(found) if found else "results are what they were")
    if given.write:
        write(made)
    return int(bool(found) and not given.write)


if __name__ == "__main__":
    sys.exit(main())
